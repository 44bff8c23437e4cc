"""`tumble export` and `tumble import` as they are typed."""

import json
from pathlib import Path

import numpy as np
import pytest

from dataflash_fixtures import DataFlashWriter
from exchange_units import READABLE, calibration, needed
from tumble.calibration.document import Calibration
from tumble.tools.exchange.parameters import numbers_of
from tumble.tools.exchange.registry import TARGETS
from turntable_sessions import one_line, typed
from ulog_fixtures import ULogWriter


def settings_for(word):
    return [part for name, value in needed(word).items() for part in ("--set", f"{name}={value}")]


@pytest.fixture
def unit(tmp_path):
    path = tmp_path / "unit.yaml"
    calibration(7).save(path)
    return path


@pytest.mark.parametrize("word", TARGETS)
def test_every_format_is_written_and_written_again(tmp_path, unit, word):
    out = tmp_path / f"exported{TARGETS[word].ending}"
    for _ in range(2):
        done = typed("export", unit, "--format", word, *settings_for(word), "-o", out)
        assert done.code == 0, done.err
    assert f"1 calibration written: {out}" in done.out
    losses = [line for line in done.err.splitlines() if " is lost: " in line]
    strict = typed("export", unit, "--format", word, *settings_for(word), "-o", out, "--strict")
    assert strict.code == (2 if losses else 0)
    assert TARGETS[word].kind.begins(out)


def test_all_formats_are_written_as_each_alone(tmp_path, unit):
    every = [part for word in TARGETS for part in settings_for(word)]
    done = typed("export", unit, "--all", *every, "-o", tmp_path / "all", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["verdict"] == "all written"
    assert list(found["written"]) == list(TARGETS)
    for word, target in TARGETS.items():
        alone = tmp_path / f"{word}{target.ending}"
        assert typed("export", unit, "--format", word, *settings_for(word), "-o", alone).code == 0
        assert Path(found["written"][word]["file"]).read_bytes() == alone.read_bytes()


def test_formats_that_lack_a_setting_are_listed_with_it(tmp_path, unit):
    done = typed("export", unit, "--all", "--set", "rate=200", "-o", tmp_path / "all", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["verdict"] == "some refused"
    assert set(found["refused"]) == {"px4", "record", "record-hex", "record-c"}
    assert "--set identity=" in found["refused"]["record"]
    assert len(list((tmp_path / "all").iterdir())) == len(TARGETS) - 4
    shown = typed("export", unit, "--all", "--set", "rate=200", "-o", tmp_path / "all")
    assert shown.code == 0
    assert "unit-fast-lio.yaml" in shown.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--all", "--format", "vins"], "--all writes every format; leave out --format vins"),
        (["--all", "--set", "speed=3"], "no format has a setting 'speed'"),
        (["--all", "--strict", "--set", "rate=0"], "give a number above zero"),
    ],
)
def test_bad_words_beside_all_are_one_line(tmp_path, unit, words, said):
    done = typed("export", unit, *words, "-o", tmp_path / "all")
    assert done.code == (2 if "--strict" not in words else 0)
    assert said in done.err + done.out


@pytest.mark.parametrize("word", READABLE)
def test_written_content_is_read_back(tmp_path, unit, word):
    out = tmp_path / f"exported{TARGETS[word].ending}"
    assert typed("export", unit, "--format", word, *settings_for(word), "-o", out).code == 0
    done = typed("import", out, "-o", tmp_path / "back", "--format", word, "--json")
    assert done.code == 0, done.err
    (found,) = json.loads(done.out)["calibrations"]
    back, first = Calibration.load(found["file"]), Calibration.load(unit)
    assert back.method.procedure == "import"
    for triad, parts in TARGETS[word].holds.items():
        section, expected = getattr(back, triad), getattr(first, triad)
        if expected is None:
            continue
        assert ("bias" in section.estimated) == ("bias" in parts)
        assert np.allclose(section.b, expected.b if "bias" in parts else 0.0, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("word", ["px4", "ardupilot"])
def test_temperature_goes_out_and_comes_back(tmp_path, word):
    first = calibration(3, parts=("scale",), over_temperature=True)
    first.save(tmp_path / "unit.yaml")
    out = tmp_path / f"exported{TARGETS[word].ending}"
    assert typed("export", tmp_path / "unit.yaml", "--format", word, *settings_for(word), "-o", out).code == 0
    assert typed("import", out, "-o", tmp_path / "back").code == 0
    (path,) = (tmp_path / "back").iterdir()
    force = np.random.default_rng(1).normal(size=(20, 3))
    for temperature in (-40.0, 0.0, 33.0, 90.0):
        theirs, _ = Calibration.load(path).correct(force, force, temperature)
        ours, _ = first.correct(force, force, temperature)
        assert np.abs(theirs - ours).max() < 2e-5


def written_log(folder, word, parameters):
    if word == "px4":
        whole = ("_ID", "_ENABLE")
        typed_ = {name: int(v) if name.endswith(whole) else v for name, v in parameters.items()}
        return ULogWriter(typed_).add("other", 0, [1.0], value=3.0).write(folder / "flight.ulg")
    return DataFlashWriter(parameters).write(folder / "flight.bin")


@pytest.mark.parametrize(
    ("word", "separator", "fields"), [("px4", r"\t", (2, 3)), ("ardupilot", ",", (0, 1))]
)
def test_flight_log_gives_the_same_calibration_as_its_parameter_file(tmp_path, word, separator, fields):
    calibration(5, parts=("scale",), over_temperature=True).save(tmp_path / "unit.yaml")
    out = tmp_path / f"vehicle{TARGETS[word].ending}"
    assert typed("export", tmp_path / "unit.yaml", "--format", word, *settings_for(word), "-o", out).code == 0
    log = written_log(tmp_path, word, numbers_of(out.read_text(), separator, *fields))
    for path in (out, log):
        assert typed("import", path, "-o", tmp_path / path.suffix[1:]).code == 0
    theirs, ours = (Calibration.load(next((tmp_path / each.suffix[1:]).iterdir())) for each in (out, log))
    assert theirs.serial == ours.serial
    force = np.random.default_rng(1).normal(size=(20, 3))
    for temperature in (-40.0, 33.0, 90.0):
        expected = theirs.correct(force, force, temperature)
        assert np.allclose(ours.correct(force, force, temperature), expected, atol=1e-6)


def test_uncalibrated_autopilot_log_is_refused_in_one_line(tmp_path):
    done = typed("import", written_log(tmp_path, "px4", {"SYS_AUTOSTART": 4001.0}))
    assert (done.code, len(done.err.strip().splitlines())) == (2, 1)
    assert "holds no calibration of PX4 parameters" in done.err
    done = typed("import", tmp_path / "flight.ulg", "--format", "ardupilot")
    assert "is a log of px4; leave out --format ardupilot" in done.err


def test_several_imus_get_numbers_of_their_own(tmp_path):
    for name in ("a", "b"):
        calibration(ord(name)).save(tmp_path / f"{name}.yaml")
    done = typed(
        *(
            "export",
            tmp_path / "a.yaml",
            tmp_path / "b.yaml",
            "--format",
            "px4",
            "-o",
            tmp_path / "two.params",
        ),
        *("--set", "accelerometer-id=11,12", "--set", "gyroscope-id=21,22"),
    )
    assert done.code == 0, done.err
    back = typed("import", tmp_path / "two.params", "-o", tmp_path / "back", "--json")
    assert [each["calibration"]["serial"] for each in json.loads(back.out)["calibrations"]] == ["11", "12"]


def test_the_list_says_what_each_format_holds_and_needs():
    found = json.loads(typed("export", "--format", "list", "--json").out)["formats"]
    assert set(found) == set(TARGETS)
    assert found["px4"]["holds"]["gyroscope"] == ["bias", "bias over temperature"]
    assert "kalibr-noise" in typed("export").out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--format", "px44"), "--format px44: no such format; did you mean px4?"),
        (("--format", "px4"), "px4 needs --set accelerometer-id=...: device id"),
        (("--format", "px4", "--set", "id=3"), "px4 has no setting 'id'"),
        (("--format", "px4", "--set", "accelerometer-id=x"), "--set accelerometer-id=x: give a whole number"),
        (("--format", "kalibr", "--set", "rate=0"), "--set rate=0: give a number above zero"),
        (("--format", "imucal", "--set", "rate"), "--set rate: give NAME=VALUE"),
        (("--format", "ardupilot", "--set", "instance=6"), "--set instance=6: ArduPilot numbers IMUs 1 to 5"),
    ],
)
def test_impossible_export_is_refused_in_one_line_and_leaves_nothing(tmp_path, unit, words, message):
    done = typed("export", unit, *words, "-o", tmp_path / "out")
    assert done.code == 2
    assert message in done.err
    assert len(done.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_calibration_is_never_written_over(unit):
    before = unit.read_bytes()
    assert typed("export", unit, "--format", "ros2", "-o", unit).code == 2
    assert unit.read_bytes() == before


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.params", b"hello", "is of no format that is known"),
        ("a.params", b"", "holds no calibration of PX4"),
        ("a.params", b"1\t1\tCAL_ACC0_ID\tx\t6\n", "line 1: '1\\t1\\tCAL_ACC0_ID\\tx\\t6' is no parameter"),
        ("a.params", b"1\t1\tCAL_ACC0_ID\t1e400\t6\n", "CAL_ACC0_ID is inf, no whole number"),
        ("a.params", b"1\t1\tSYS_AUTOSTART\t4001\t6\n", "holds no calibration of PX4"),
        ("a.param", b"INS_ACCOFFS_X,0.1\nINS_ACCSCAL_X,0\n", "INS_ACCSCAL_X is 0, no scale"),
        ("a.param", b"INS_ACC_ID,nan\n", "INS_ACC_ID is nan, no whole number"),
        ("a.calib", b"1 0 0 0 1 0 0 0 1\n", "holds 9 numbers"),
        ("a.calib", b"0 " * 21, "has no inverse"),
        ("a.json", b'{"cal_type": "ferraris"', "is no JSON"),
        ("a.json", b'{"cal_type": "ferraris"}', "cal_type is 'ferraris', not Ferraris or Turntable"),
        ("a.json", b'{"cal_type": "Ferraris", "_format_version": "1.0.0"}', "convert it with imucal.legacy"),
        ("a.json", b'{"cal_type": "Ferraris", "_format_version": "2.0", "acc_unit": "g"}', "acc_unit is 'g'"),
        ("a.json", b"[" * 100000, "is of no format that is known"),
        ("a.bin", b"\xff\xfe\x00\x01", "is of no format that is known"),
        ("a.json", b'{"cal_type": "\xff"}', "is no text"),
    ],
)
def test_failed_import_is_reported_in_one_line(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    chosen = ("--format", "imu-tk-accelerometer") if name == "a.calib" else ()
    done = typed("import", path, *chosen, "-o", tmp_path / "out")
    assert done.code == 2
    assert message in done.err
    assert len(done.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_calibrations_without_a_format_are_not_passed_over(tmp_path, unit, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = typed("export", unit)
    assert done.code == 2
    assert "missing --format" in one_line(done.err)
    assert typed("export").code == 0
