"""`tumble compare` as it is typed."""

import json
import os

import numpy as np
import pytest

from compare_units import drawn, truth
from tumble.calibration.document import Calibration
from tumble.tools.exchange.procedure import export
from turntable_sessions import one_line, typed


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two calibrations of one unit, one of it half a sigma of a datasheet later, and one of another unit."""
    folder, generator = tmp_path_factory.mktemp("units"), np.random.default_rng(3)
    unit, other, shift = truth(generator), truth(generator), np.zeros(12)
    shift[9] = 0.05
    drawn(generator, unit, date="2026-01-10T08:00:00Z").save(folder / "january.yaml")
    drawn(generator, unit, date="2026-06-10T08:00:00Z").save(folder / "june.yaml")
    drawn(generator, unit, date="2027-01-10T08:00:00Z", accelerometer=shift).save(folder / "later.yaml")
    drawn(generator, other, serial="8").save(folder / "other.yaml")
    return folder


def compared(*arguments):
    return typed("compare", *arguments)


def test_two_calibrations_of_one_unit_are_reported_as_the_same(folder, tmp_path):
    done = compared(folder / "january.yaml", folder / "june.yaml", "-o", tmp_path)
    assert (done.code, done.err) == (0, "")
    assert "january and june are the same within what is known: chi-square" in done.text
    assert "rms on rests in all orientations" in done.text
    page = (tmp_path / "compare.html").read_text()
    assert "january and june are the same within what is known" in page


def test_changed_parameter_is_named_with_its_size(folder, tmp_path):
    done = compared(folder / "january.yaml", folder / "later.yaml", "-o", tmp_path, "--json")
    assert done.code == 3
    found = json.loads(done.out)
    (pair,) = found["pairs"]
    assert found["verdict"] == pair["verdict"] == "differ"
    worst = max(pair["parameters"], key=lambda row: abs(row["sigmas"]))
    assert worst["parameter"] == "accelerometer bias x"
    assert worst["difference"] == pytest.approx(0.05, abs=4 * worst["sigma"])
    assert pair["motion"][0]["rms"] == pytest.approx(0.05, rel=0.3)
    screen = compared(folder / "january.yaml", folder / "later.yaml", "-o", tmp_path)
    assert "most in accelerometer bias x" in screen.text
    assert "only biases differ: scale and angles agree" in screen.text


def test_calibrations_of_one_serial_are_laid_over_time(folder, tmp_path):
    files = [folder / f"{name}.yaml" for name in ("january", "june", "later")]
    done = compared(*files, "-o", tmp_path, "--json")
    found = json.loads(done.out)
    assert done.code == 3
    rows = {row["parameter"]: row for row in found["history"]}
    assert len(rows) == 24
    assert rows["accelerometer bias x"]["rate"] == pytest.approx(0.05, rel=0.5)
    assert rows["accelerometer bias x"]["years"] == pytest.approx([0.0, 151 / 365.25, 365 / 365.25])
    page = (tmp_path / "compare.html").read_text()
    assert page.count('id="history') >= 2
    assert "drift over 1.0 years, of 24 parameters" in page


def test_other_serials_are_distinguished_from_drift(folder, tmp_path):
    files = [folder / f"{name}.yaml" for name in ("january", "june", "other")]
    done = compared(*files, "-o", tmp_path, "--json")
    found = json.loads(done.out)
    assert [pair["verdict"] for pair in found["pairs"]] == ["same", "differ"]
    assert "serial 7 and serial 8: these are two units" in found["pairs"][1]["notes"]
    assert found["history"] == []
    assert "nothing is laid over time, as the serials differ" in found["notes"]


def test_calibration_on_a_vehicle_is_compared_without_an_import(folder, tmp_path):
    unit = Calibration.load(folder / "january.yaml")
    path = tmp_path / "vehicle.json"
    path.write_bytes(export(unit, "imucal").content)
    same = compared(folder / "january.yaml", path, "-o", tmp_path)
    assert same.code == 0, same.err
    assert "vehicle states no uncertainty of accelerometer and gyroscope" in same.text
    assert compared(folder / "later.yaml", path, "-o", tmp_path).code == 3
    neither = compared(path, path, "-o", tmp_path, "--json")
    assert json.loads(neither.out)["verdict"] == "same"


def test_numbers_without_any_uncertainty_are_not_tested(folder, tmp_path):
    for name in ("january", "later"):
        unit = Calibration.load(folder / f"{name}.yaml")
        (tmp_path / f"{name}.json").write_bytes(export(unit, "imucal").content)
    done = compared(tmp_path / "january.json", tmp_path / "later.json", "-o", tmp_path)
    assert done.code == 3
    assert "january and later are the same cannot be told: neither states an uncertainty" in done.text
    assert "accelerometer bias x" in done.text
    assert "rms on rests in all orientations" in done.text


def test_the_rate_of_the_turns_is_stated(folder, tmp_path):
    files = (folder / "january.yaml", folder / "later.yaml")
    slow, fast = (
        json.loads(compared(*files, "--turn-rate", rate, "-o", tmp_path, "--json").out)["pairs"][0]["motion"][
            1
        ]
        for rate in (0.1, 10.0)
    )
    assert slow["rms"] < fast["rms"]
    assert fast["motion"] == "turns about all axes at up to 10 rad/s"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("{}/january.yaml",), "give two calibrations or more"),
        (("{}/january.yaml", "{}/none.yaml"), "none.yaml: no such file or folder"),
        (("{}/january.yaml", "{}/june.yaml", "--turn-rate", "0"), "--turn-rate 0: give a rate above zero"),
        (("{}/january.yaml", "{}/two.param"), "two.param: holds imu1 and imu2; name one, as in"),
        (("{}/january.yaml", "{}/two.param:imu3"), "two.param: holds imu1 and imu2; name one, as in"),
    ],
)
def test_impossible_comparison_is_reported_in_one_line(folder, tmp_path, words, message):
    text = "INS_ACCOFFS_X,0.1\nINS_ACC2OFFS_X,0.2\n"
    (folder / "two.param").write_text(text)
    done = compared(*(word.format(folder) for word in words), "-o", tmp_path / "out")
    assert done.code == 2
    assert message in done.err
    assert len(done.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_one_imu_of_several_on_a_vehicle_is_named(folder, tmp_path):
    (tmp_path / "two.param").write_text("INS_ACCOFFS_X,0.1\nINS_ACC2OFFS_X,0.2\n")
    done = compared(folder / "january.yaml", f"{tmp_path}/two.param:imu2", "-o", tmp_path, "--json")
    assert done.code == 3
    assert json.loads(done.out)["calibrations"][1]["name"] == "two:imu2"


def test_the_same_result_is_had_from_python(folder):
    import tumble

    result = tumble.compare([folder / "january.yaml", folder / "june.yaml"])
    assert result.verdict == "same"
    assert result["january and june"].joint.degrees_of_freedom == 24
    assert len(result.to_pandas()) == 24
    assert "are the same within what is known" in result._repr_html_()


def test_a_pipe_or_a_device_is_no_calibration_to_compare(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero"):
        done = typed("compare", path, path, "-o", tmp_path / "out")
        assert done.code == 2
        assert "is a device or a pipe" in one_line(done.err)
    assert not (tmp_path / "out").exists()
