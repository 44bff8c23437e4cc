"""Units of single-axis sensors, each with a log of its own."""

import csv
import re

import numpy as np
import pytest
import yaml

from redundancy_sets import BIASED, CHANNELS, PRIMARY, QUICK, motion, record, refusal, replay

UNITS_OF_MEASUREMENT = ("--accelerometer-unit", "m/s^2", "--gyroscope-unit", "rad/s")
MOVED = motion()


def written_apart(folder, said, channels=CHANNELS, every=None):
    """Writes each channel of a unit to a log of its own; `every` thins out readings of a channel."""
    parts = []
    for channel in channels:
        rows = slice(None, None, (every or {}).get(channel, 1))
        path = folder / f"{said.imu.name}-{channel}.csv"
        readings = said.readings[rows, CHANNELS.index(channel)]
        lines = (
            f"{time!r},{value!r}"
            for time, value in zip(said.time[rows].tolist(), readings.tolist(), strict=True)
        )
        path.write_text("\n".join(["time,value", *lines]) + "\n")
        parts.append(f"{channel}:{path}")
    return f"{said.imu.name}={','.join(parts)}"


def test_six_logs_of_one_unit_give_what_one_log_of_it_gives(tmp_path):
    said = record([PRIMARY, BIASED], 61, MOVED)
    primary = said["imu1"].write(tmp_path / "imu1.csv")
    whole, _ = replay(
        *("--primary", primary, "--secondary", said["imu2"].write(tmp_path / "imu2.csv")),
        *(*QUICK, *UNITS_OF_MEASUREMENT, "-o", tmp_path / "whole"),
    )
    apart, _ = replay(
        *("--primary", primary, "--unit", written_apart(tmp_path, said["imu2"])),
        *(*QUICK, *UNITS_OF_MEASUREMENT, "-o", tmp_path / "apart"),
    )
    assert apart["errors"] == whole["errors"]


def test_the_primary_may_be_put_together_of_single_axes(tmp_path):
    said = record([PRIMARY, BIASED], 62, MOVED)
    result, _ = replay(
        *("--primary", "imu1", "--unit", written_apart(tmp_path, said["imu1"])),
        *("--secondary", said["imu2"].write(tmp_path / "imu2.csv")),
        *(*QUICK, *UNITS_OF_MEASUREMENT, "-o", tmp_path / "out"),
    )
    found = {each["sensor"]: each for each in result["errors"]}
    np.testing.assert_allclose(found["accelerometer"]["bias"], BIASED.accelerometer_bias, atol=0.02)


def test_axes_with_a_rate_of_their_own_are_calibrated(tmp_path):
    said = record([PRIMARY, BIASED], 63, MOVED)
    unit = written_apart(tmp_path, said["imu2"], ("ax", "ay", "gz"), every={"ay": 2})
    result, _ = replay(
        *("--primary", said["imu1"].write(tmp_path / "imu1.csv"), "--unit", unit),
        *(*QUICK, *UNITS_OF_MEASUREMENT, "-o", tmp_path / "out"),
        code=None,
    )
    found = {each["sensor"]: each for each in result["errors"]}
    np.testing.assert_allclose(found["accelerometer"]["bias"][:2], BIASED.accelerometer_bias[:2], atol=0.02)
    assert found["gyroscope"]["bias"][2] == pytest.approx(BIASED.gyroscope_bias[2], abs=5e-4)


def replayed_axes(tmp_path, seed, axes, corrupt=lambda said: said):
    """Replays two units of single axes, those named of the first and of the second."""
    said = corrupt(record([PRIMARY, BIASED], seed, MOVED))
    units = [written_apart(tmp_path, said[name], of) for name, of in zip(("imu1", "imu2"), axes, strict=True)]
    return replay(
        *("--primary", "imu1", "--unit", units[0], "--unit", units[1]),
        *("--output-log", tmp_path / "output.csv", "-o", tmp_path / "out"),
        *(*QUICK, *UNITS_OF_MEASUREMENT),
        code=None,
    )


def test_a_primary_may_lack_axes_and_shows_those_it_has(tmp_path):
    result, _ = replayed_axes(tmp_path, 67, (("ax", "ay", "gz"), CHANNELS))
    found = {each["sensor"]: each for each in result["errors"]}
    force, rate = found["accelerometer"], found["gyroscope"]
    assert force["bias_sigma"][2] is None
    assert rate["bias_sigma"][:2] == [None, None]
    np.testing.assert_allclose(force["bias"][:2], BIASED.accelerometer_bias[:2], atol=0.01)
    assert rate["bias"][2] == pytest.approx(BIASED.gyroscope_bias[2], abs=5e-4)
    sigmas = force["bias_sigma"][:2] + rate["bias_sigma"][2:]
    assert all(0.0 < sigma < 0.01 for sigma in sigmas)


def test_the_bias_of_an_axis_that_a_unit_lacks_is_not_observable(tmp_path):
    result, _ = replayed_axes(tmp_path, 68, (CHANNELS, ("ax", "ay", "gz")))
    found = {each["sensor"]: each for each in result["errors"]}
    assert found["accelerometer"]["bias_sigma"][2] is None
    assert found["gyroscope"]["bias_sigma"][:2] == [None, None]
    assert found["accelerometer"]["bias"][2] is None
    stored = (tmp_path / "out" / "store" / "imu2-accelerometer.yaml").read_text()
    assert re.search(r"b_sigma: \[[\d.e-]+, [\d.e-]+, null\]", stored)
    calibration = yaml.safe_load((tmp_path / "out" / "imu2.redundancy.yaml").read_text())
    assert "bias of axis z" in calibration["accelerometer"]["unobservable"]
    assert calibration["accelerometer"]["sigma"]["bias"][2] is None
    page = (tmp_path / "out" / "redundancy.html").read_text()
    shown = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", page))
    assert "bias z not observable: the unit, or the primary, lacks the axis" in shown


def test_a_failover_to_a_unit_that_lacks_axes_says_so(tmp_path):
    def fails(said):
        return said | {"imu1": said["imu1"].part(end=38.0)}

    replayed_axes(tmp_path, 69, (CHANNELS, ("ax", "ay", "gz")), fails)
    rows = list(csv.DictReader((tmp_path / "output.csv").open()))
    assert {row["source"] for row in rows} == {"imu1", "imu2"}
    for row in rows:
        shown = {channel for channel in CHANNELS if row[channel] not in ("", "nan")}
        assert shown == (set(CHANNELS) if row["source"] == "imu1" else {"ax", "ay", "gz"})
        assert row["source"] == "imu1" or row["flags"] == "1"


def test_a_sensor_that_pauses_is_a_fault_of_its_unit(tmp_path):
    said = record([PRIMARY, BIASED], 64, MOVED)
    unit = written_apart(tmp_path, said["imu2"], ("ax", "gz"))
    path = tmp_path / "imu2-gz.csv"
    kept = [line for line in path.read_text().splitlines() if not line.startswith(("20.", "21."))]
    path.write_text("\n".join(kept) + "\n")
    _, events = replay(
        *("--primary", said["imu1"].write(tmp_path / "imu1.csv"), "--unit", unit),
        *(*QUICK, *UNITS_OF_MEASUREMENT, "-o", tmp_path / "out"),
        code=None,
    )
    found = [each for each in events if each["figures"].get("reason") == "not finite"]
    assert 20.0 < found[0]["time"] < 20.5


@pytest.mark.parametrize(
    ("unit", "said"),
    [
        ("imu2", "expected NAME=CHANNEL:LOG"),
        ("imu2=ab:{log}", "expected NAME=CHANNEL:LOG"),
        ("imu2=ax:{log},ax:{log}", "once at most"),
        ("imu2=ax:absent.csv", "no such file"),
        ("imu2=ax:{log}:b", "no column 'b' for ax"),
        ("imu2=ay:{several}", "2 columns may be ay; columns found: time, one, two; name one, as ay:"),
    ],
)
def test_units_that_make_no_sense_are_refused(tmp_path, unit, said):
    primary = record([PRIMARY], 65, MOVED)["imu1"].write(tmp_path / "imu1.csv")
    log = tmp_path / "x.csv"
    log.write_text("time,value\n0.0,1.0\n0.01,1.0\n")
    several = tmp_path / "xy.csv"
    several.write_text("time,one,two\n0.0,1.0,2.0\n0.01,1.0,2.0\n")
    line = refusal(
        "--primary",
        primary,
        "--unit",
        unit.format(log=log, several=several),
        *UNITS_OF_MEASUREMENT,
        "-o",
        tmp_path / "out",
    )
    assert said in line


def test_one_axis_needs_its_unit_of_measurement_stated(tmp_path):
    said = record([PRIMARY, BIASED], 66, MOVED)
    line = refusal(
        *("--primary", said["imu1"].write(tmp_path / "imu1.csv")),
        *("--unit", written_apart(tmp_path, said["imu2"], ("ax",)), "-o", tmp_path / "out"),
    )
    assert "one axis does not show its unit; give --accelerometer-unit" in line
