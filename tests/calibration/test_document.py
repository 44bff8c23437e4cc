"""The calibration file as a user keeps, reads, edits and breaks it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

import made_up_batch as made_up
from tumble.calibration.document import Calibration
from tumble.foundation.errors import CalibrationFileError, OutputError, ProcedureError
from tumble.foundation.files import PAGE, prepare_folder, replacing

ROOT = Path(__file__).parents[2]
FINITE = st.floats(-1e6, 1e6)


def calibration(**changes):
    target = made_up.target(**changes)
    return made_up.batch(target).calibration_of(target)


@pytest.fixture
def saved(tmp_path):
    path = tmp_path / "target_1.yaml"
    calibration().save(path)
    return path


def refusal(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(CalibrationFileError) as caught:
        Calibration.load(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(path))
    return message


def test_a_saved_file_reads_back_as_the_same_calibration(saved):
    assert Calibration.load(saved) == calibration()


def test_every_number_survives_the_file_bit_by_bit(saved):
    before, after = calibration(), Calibration.load(saved)
    for name in ("M", "b", "K", "L", "Q", "covariance", "noise_density"):
        for triad in ("accelerometer", "gyroscope"):
            one, other = getattr(getattr(before, triad), name), getattr(getattr(after, triad), name)
            assert one.tobytes() == other.tobytes(), f"{triad} {name}"


@given(bias=st.tuples(FINITE, FINITE, FINITE))
def test_any_bias_that_a_sensor_can_have_survives_the_file(tmp_path_factory, bias):
    path = tmp_path_factory.mktemp("bias") / "c.yaml"
    section = {"unit": "m/s^2", "M": np.eye(3), "b": bias}
    Calibration.model_validate({"name": "any", "accelerometer": section}).save(path)
    assert Calibration.load(path).accelerometer.b.tobytes() == np.array(bias).tobytes()


def test_unobserved_values_are_null_in_the_file_and_nan_in_memory(tmp_path):
    path = tmp_path / "c.yaml"
    calibration(gyroscope=made_up.triad("gyroscope", bias_only=True)).save(path)
    content = yaml.safe_load(path.read_text())
    assert content["gyroscope"]["covariance"][0][0] is None
    assert content["gyroscope"]["sigma"]["non-orthogonality"] == {"xy": None, "yz": None, "zx": None}
    loaded = Calibration.load(path).gyroscope
    assert np.isnan(loaded.covariance[0, 0])
    assert np.isfinite(loaded.covariance[9:, 9:]).all()
    assert loaded.estimated == ("bias",)


def test_a_target_without_gyroscope_has_no_gyroscope_section(tmp_path):
    path = tmp_path / "c.yaml"
    calibration(gyroscope=None).save(path)
    assert "gyroscope" not in yaml.safe_load(path.read_text())
    assert Calibration.load(path).gyroscope is None


def test_a_target_that_was_not_calibrated_has_no_file():
    target = made_up.target(failure="it moved during every rest")
    with pytest.raises(ProcedureError, match="target_1: has no calibration to save: it moved"):
        made_up.batch(target).calibration_of(target)


def test_the_file_says_where_the_numbers_come_from(saved):
    content = yaml.safe_load(saved.read_text())
    assert content["schema"] == "tumble-calibration/3"
    assert content["serial"] == "SN-1"
    assert content["reference"]["name"] == "reference"
    assert content["reference"]["serial"] == "REF-7"
    assert content["reference"]["log"]["file"] == "reference.csv"
    assert content["method"]["truth"] == "reference"
    assert content["method"]["options"] == {"clock": "auto", "jobs": 2, "span": [1.0, 2.0]}
    assert content["gravity"] == {"value": 9.80665, "source": "standard"}
    assert content["temperature"] == {"low": 24.5, "mean": 25.0, "high": 25.5}
    assert content["software"] == "tumble 0.1.0"


def test_a_matrix_takes_one_line_a_row(saved):
    lines = saved.read_text().splitlines()
    start = lines.index("  M:")
    assert all(line.startswith("  - [") and line.endswith("]") for line in lines[start + 1 : start + 4])


def test_matrix_and_bias_alone_make_a_calibration(tmp_path):
    path = tmp_path / "certificate.yaml"
    path.write_text(
        "schema: tumble-calibration/1\nname: reference\naccelerometer:\n  unit: m/s^2\n"
        "  M:\n  - [1, 0, 0]\n  - [0, 1, 0]\n  - [0, 0, 1]\n  b: [1e-3, 0, -2]\n"
    )
    assert Calibration.load(path).accelerometer.b.tolist() == [0.001, 0.0, -2.0]


def test_the_hash_follows_the_content_and_not_the_layout(saved):
    before = Calibration.load(saved)
    content = yaml.safe_load(saved.read_text())
    saved.write_text(yaml.safe_dump(content, default_flow_style=True))
    assert Calibration.load(saved).hash() == before.hash()
    content["accelerometer"]["b"][0] = float(np.nextafter(content["accelerometer"]["b"][0], 1.0))
    saved.write_text(yaml.safe_dump(content))
    assert Calibration.load(saved).hash() != before.hash()


def test_a_saved_file_obeys_the_published_schema(saved):
    schema = json.loads((ROOT / "docs/schema/calibration.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(yaml.safe_load(saved.read_text()), schema)


def test_the_published_schema_refuses_what_the_reader_refuses(saved):
    schema = json.loads((ROOT / "docs/schema/calibration.schema.json").read_text())
    content = yaml.safe_load(saved.read_text())
    content["accelerometer"]["b"] = [1.0, 2.0]
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(content, schema)


def test_the_published_schemas_are_those_of_the_code():
    script = ROOT / "scripts/write_schemas.py"
    done = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("name: target_1", "nam: target_1", ["line 5", "nam is not a known key", "did you mean 'name'?"]),
        ("unit: m/s^2", "unit: g", ["accelerometer.unit", "needs to be 'm/s^2', found 'g'"]),
        ("value: 9.80665", "value: -9.80665", ["gravity.value", "greater than 0"]),
        ("serial: SN-1", "serial: 12", ["serial", "string", "found 12"]),
        ("schema: tumble-calibration/3", "schema: tumble-calibration/9", ["line 4", "tumble-calibration/3"]),
        ("serial: SN-1", "serial: SN-1\nserial: SN-2", ["line 7", "'serial' is given twice"]),
        ("  b: [", "  b: [7.0, ", ["accelerometer.b", "needs 3 numbers"]),
        ("name: target_1", "name: [", ["line "]),
    ],
)
def test_a_mistake_is_named_with_its_line_and_key(saved, old, new, parts):
    message = refusal(saved, old, new)
    for part in parts:
        assert part in message


@pytest.mark.parametrize("number", [".inf", ".nan", "true", "'1.0'", "null"])
def test_a_bias_holds_numbers_only(saved, number):
    text = saved.read_text()
    start = text.index("  b: [") + len("  b: [")
    saved.write_text(text[:start] + number + text[text.index(",", start) :])
    with pytest.raises(CalibrationFileError, match=r"accelerometer\.b needs 3 numbers"):
        Calibration.load(saved)


def test_a_number_that_no_sensor_has_is_refused_for_its_size(saved):
    text = saved.read_text()
    start = text.index("  b: [") + len("  b: [")
    saved.write_text(text[:start] + "1.0e+308" + text[text.index(",", start) :])
    with pytest.raises(CalibrationFileError, match=r"needs 3 numbers no larger than 1e\+30, found 1e\+308"):
        Calibration.load(saved)


@pytest.mark.parametrize(
    "content",
    [b"time,ax,ay\n0,0,0\n", b"# serial: 7\ntime: no\n\ttab\n", b"\x89MCAP0\r\n\xff", b"#" * (5 << 20)],
)
@pytest.mark.parametrize("ending", [".csv", ".mcap", ".TXT"])
def test_a_log_in_place_of_a_calibration_is_named_as_one(tmp_path, content, ending):
    log = tmp_path / f"drive{ending}"
    log.write_bytes(content)
    with pytest.raises(CalibrationFileError) as refused:
        Calibration.load(log)
    assert str(refused.value) == f"{log}: is a log, not a calibration file; give another file"


def test_missing_file_with_the_ending_of_a_log_is_reported_missing(tmp_path):
    with pytest.raises(CalibrationFileError, match="no such calibration file"):
        Calibration.load(tmp_path / "drive.csv")


def test_a_matrix_that_differs_from_its_factors_is_refused(saved):
    content = yaml.safe_load(saved.read_text())
    content["accelerometer"]["M"][0][0] += 0.01
    saved.write_text(yaml.safe_dump(content))
    with pytest.raises(CalibrationFileError, match=r"accelerometer M differs from K L Q by 0\.01"):
        Calibration.load(saved)


def test_a_matrix_that_cannot_be_inverted_is_refused():
    section = {"unit": "m/s^2", "M": np.diag([1.0, 1.0, 0.0]), "b": np.zeros(3)}
    with pytest.raises(ValueError, match="M cannot be inverted"):
        Calibration.model_validate({"name": "flat", "accelerometer": section})


def test_a_file_without_either_sensor_is_refused(tmp_path):
    path = tmp_path / "c.yaml"
    path.write_text("schema: tumble-calibration/1\nname: nothing\n")
    with pytest.raises(CalibrationFileError, match="no accelerometer, gyroscope or magnetometer"):
        Calibration.load(path)


@pytest.mark.parametrize("text", ["", "# only a comment\n", "a,b,c\n1,2,3\n", "- 1\n- 2\n", "\x00\x01"])
def test_a_file_that_is_no_calibration_is_refused_in_one_line(tmp_path, text):
    path = tmp_path / "c.yaml"
    path.write_text(text)
    with pytest.raises(CalibrationFileError) as caught:
        Calibration.load(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_bytes_that_are_not_text_are_refused(tmp_path):
    path = tmp_path / "c.yaml"
    path.write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(CalibrationFileError, match="is no text in UTF-8"):
        Calibration.load(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(CalibrationFileError, match=r"gone\.yaml: no such calibration file"):
        Calibration.load(tmp_path / "gone.yaml")


def test_saving_into_a_missing_folder_says_so(tmp_path):
    with pytest.raises(OutputError, match=r"folder .*missing does not exist; create it first"):
        calibration().save(tmp_path / "missing" / "c.yaml")


def test_saving_below_a_file_says_that_it_is_one(tmp_path):
    (tmp_path / "mine").write_text("mine")
    with pytest.raises(OutputError, match=r"mine is a file, no folder to write in"):
        calibration().save(tmp_path / "mine" / "c.yaml")
    assert (tmp_path / "mine").read_text() == "mine"


def test_a_failed_write_leaves_the_old_file_and_no_litter(tmp_path):
    path = tmp_path / "c.html"
    old = '<!doctype html><meta name="generator" content="Tumble">old'
    path.write_text(old)

    def fill_the_disk():
        with replacing(path, PAGE) as file:
            file.write(b"<!doctype html>half of the n")
            raise OSError(28, "No space left on device")

    with pytest.raises(OutputError, match="No space left"):
        fill_the_disk()
    assert path.read_text() == old
    assert list(tmp_path.iterdir()) == [path]


def test_an_output_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(OutputError, match="cannot write in this output folder"):
        prepare_folder(tmp_path / "out")
    assert (tmp_path / "out").read_text() == "mine"


def test_an_output_folder_is_made_and_left_empty(tmp_path):
    folder = prepare_folder(tmp_path / "a" / "b")
    assert list(folder.iterdir()) == []


def test_correction_undoes_the_forward_model():
    seed = 20
    random = np.random.default_rng(seed)
    print("seed", seed)
    made = calibration()
    force, rate = 9.8 * random.standard_normal((50, 3)), random.standard_normal((50, 3))
    measured_force = force @ made.accelerometer.M.T + made.accelerometer.b
    measured_rate = rate @ made.gyroscope.M.T + made.gyroscope.b
    corrected_force, corrected_rate = made.correct(measured_force, measured_rate)
    np.testing.assert_allclose(corrected_force, force, rtol=0, atol=1e-12)
    np.testing.assert_allclose(corrected_rate, rate, rtol=0, atol=1e-12)


def test_correction_removes_the_g_sensitivity_of_the_gyroscope():
    seed = 21
    random = np.random.default_rng(seed)
    print("seed", seed)
    G = 1e-3 * random.standard_normal((3, 3))
    gyroscope = {"unit": "rad/s", "M": 1.01 * np.eye(3), "b": [0.1, 0.2, 0.3], "g_sensitivity": G}
    accelerometer = {"unit": "m/s^2", "M": 0.99 * np.eye(3), "b": [0.3, 0.2, 0.1]}
    made = Calibration.model_validate({"name": "g", "accelerometer": accelerometer, "gyroscope": gyroscope})
    force, rate = 9.8 * random.standard_normal((50, 3)), random.standard_normal((50, 3))
    measured_rate = 1.01 * rate + [0.1, 0.2, 0.3] + force @ G.T
    _, corrected = made.correct(0.99 * force + [0.3, 0.2, 0.1], measured_rate)
    np.testing.assert_allclose(corrected, rate, rtol=0, atol=1e-12)


def test_a_triad_without_calibration_is_left_as_measured():
    made = calibration(gyroscope=None)
    rate = np.arange(6.0).reshape(2, 3)
    assert made.correct(np.ones((2, 3)), rate)[1] is rate


def test_the_representations_tell_a_person_what_it_is():
    made = calibration(gyroscope=made_up.triad("gyroscope", bias_only=True))
    assert repr(made).startswith("Calibration('target_1', serial 'SN-1')")
    assert "bias only" in repr(made)
    assert made._repr_html_().startswith("<table><caption>target_1 (SN-1)</caption>")


def test_a_name_cannot_smuggle_markup_into_a_notebook():
    section = {"unit": "m/s^2", "M": np.eye(3), "b": np.zeros(3)}
    made = Calibration.model_validate({"name": "<script>", "accelerometer": section})
    assert "<script>" not in made._repr_html_()
