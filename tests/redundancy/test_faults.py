"""Units that fail, lie or are not there are judged by the monitor, not refused by the reader."""

from __future__ import annotations

import re

import numpy as np
import pytest

from redundancy_sets import (
    BIASED,
    CHANNELS,
    PRIMARY,
    QUICK,
    SOUND,
    Imu,
    motion,
    of,
    record,
    refusal,
    replay,
    units,
    write_table,
)

MOVED = motion()
SHORT = motion(moving=8.0, after=3.0)


@pytest.fixture
def said():
    return record([PRIMARY, BIASED, SOUND], 41, SHORT)


def logs(said, folder):
    return [said[name].write(folder / f"{name}.csv") for name in said]


def replayed(said, folder, *more, code=3):
    """Each unit in a log of its own; the secondary is not given the time to be calibrated."""
    return replay(*units(logs(said, folder)), *more, "-o", folder / "out", code=code)


def faults(events, unit):
    return [event["figures"]["reason"] for event in of(events, unit, "unhealthy")]


def test_invalid_readings_make_the_unit_unhealthy_not_the_log(said, tmp_path):
    said["imu3"].readings[said["imu3"].between(3.0, 6.0), 1] = np.nan
    _, events = replayed(said, tmp_path)
    first = of(events, "imu3", "unhealthy")[0]
    assert first["figures"]["reason"] == "not finite"
    assert first["figures"]["channel"] == "specific force y"
    assert 3.0 < first["time"] < 3.3
    assert of(events, "imu3", "healthy")[0]["time"] > 6.0


def test_table_may_hold_units_of_different_rates_with_blanks_between(tmp_path):
    said = record([PRIMARY, BIASED], 42, SHORT)
    slow = said["imu2"].readings
    slow[np.arange(len(slow)) % 2 == 1] = np.nan
    path = write_table(tmp_path / "flight.csv", said)
    path.write_text(path.read_text().replace("nan", ""))
    _, events = replay(path, *units(said), "-o", tmp_path / "out", code=3)
    assert faults(events, "imu2") == []
    assert of(events, "imu2", "triggered")


def test_a_unit_of_a_table_that_goes_blank_has_fallen_silent(tmp_path):
    said = record([PRIMARY, BIASED, SOUND], 43, SHORT)
    said["imu1"].readings[said["imu1"].time > 9.0] = np.nan
    path = write_table(tmp_path / "flight.csv", said)
    result, events = replay(path, *units(said), "-o", tmp_path / "out", code=3)
    assert faults(events, "imu1") == ["late"]
    assert result["selected"][-1]["reason"] == "primary failed"


def test_time_that_runs_backwards_in_one_unit_is_a_fault_of_that_unit(said, tmp_path):
    broken = said["imu3"]
    broken.time[broken.time > 8.0] -= 3.0
    _, events = replayed(said, tmp_path)
    assert faults(events, "imu3")
    assert {event["unit"] for event in events if event["event"] == "unhealthy"} == {"imu3"}
    assert [event for event in events if event["event"] == "time jumped"] == []


def test_time_that_jumps_in_all_units_is_a_jump_of_the_common_clock(said, tmp_path):
    for unit in said.values():
        unit.time[unit.time > 8.0] += 1e6
    result, events = replayed(said, tmp_path)
    jumps = [event for event in events if event["event"] == "time jumped"]
    assert len(jumps) == 1
    assert jumps[0]["figures"]["by"] == pytest.approx(1e6, abs=0.1)
    assert result["end"] - result["start"] > 1e6


@pytest.mark.parametrize("shift", [1.7e9, -100.0])
def test_only_differences_of_time_matter(said, tmp_path, shift):
    _, events = replayed(said, tmp_path)
    for unit in said.values():
        unit.time += shift
    _, shifted = replayed(said, tmp_path)
    assert [(e["unit"], e["event"]) for e in shifted] == [(e["unit"], e["event"]) for e in events]
    apart = [one["time"] - other["time"] - shift for one, other in zip(shifted, events, strict=True)]
    # Windows lie on whole multiples of their length since the log began, to a microsecond.
    assert np.abs(apart).max() < 0.051


def test_clocks_of_different_years_are_aligned_by_their_offset(said, tmp_path):
    _, events = replayed(said, tmp_path)
    late = said["imu2"].part(start=4.0)
    late.time -= 1.7e9
    paths = [said["imu1"].write(tmp_path / "imu1.csv"), late.write(tmp_path / "imu2.csv")]
    apart = ("--set", "units.imu2.time_offset=1.7e9")
    _, shifted = replay(*units(paths), *apart, "-o", tmp_path / "apart", code=None)
    assert [event for event in shifted if event["event"] == "time jumped"] == []
    assert of(shifted, "imu2", "healthy") or not faults(shifted, "imu2")
    ends = [
        max(event["time"] for event in each if event["event"] == "rest began") for each in (events, shifted)
    ]
    assert ends[0] == pytest.approx(ends[1], abs=0.11)


@pytest.mark.parametrize("ahead", [50.0, -50.0])
def test_secondary_of_another_clock_is_followed_before_the_primary(said, tmp_path, ahead):
    late, early = said["imu1"].part(start=4.0), said["imu2"]
    late.write(tmp_path / "imu1.csv")
    early.time += ahead
    early.write(tmp_path / "imu2.csv")
    paths = [tmp_path / "imu1.csv", tmp_path / "imu2.csv"]
    offset = ("--set", f"units.imu2.time_offset={-ahead}")
    result, events = replay(*units(paths), *offset, "-o", tmp_path / "out", code=None)
    assert faults(events, "imu2") == []
    first = result["selected"][0]
    assert (first["unit"], first["reason"]) == ("imu2", "primary failed")
    assert first["start"] == pytest.approx(result["start"], abs=0.2)


def test_missing_unit_is_refused_or_replayed_as_silent_on_request(said, tmp_path):
    paths = [*logs(said, tmp_path), tmp_path / "gone.csv"]
    assert "no such file" in refusal(*units(paths), "-o", tmp_path / "out")
    result, events = replay(*units(paths), "--allow-missing", "-o", tmp_path / "out", code=3)
    assert faults(events, str(paths[-1])) == ["late"]
    assert any("is missing and replayed as a unit that sends nothing" in line for line in result["warnings"])
    assert of(events, "imu2", "triggered")


def test_a_primary_that_is_missing_is_replaced_from_the_start(said, tmp_path):
    paths = [tmp_path / "gone.csv", *logs(said, tmp_path)[1:]]
    result, events = replay(*units(paths), "--allow-missing", "-o", tmp_path / "out", code=3)
    (source,) = {span["unit"] for span in result["selected"]}
    assert source in ("imu2", "imu3")
    told = " ".join(result["known_faults"])
    assert re.search(rf"{source} was the source since \S+ s without having been calibrated", told)
    assert result["selected"][0]["reason"] == "primary failed"
    assert [event for event in events if event["event"] == "triggered"] == []


def test_a_set_that_never_says_anything_is_refused(tmp_path):
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    line = refusal(*units(paths), "--allow-missing", "-o", tmp_path / "out")
    assert "none of these units has a sample" in line


def test_a_set_whose_only_unit_freezes_ends_with_code_3(said, tmp_path):
    paths = [tmp_path / "gone.csv", said["imu3"].write(tmp_path / "imu3.csv")]
    said["imu3"].readings[:] = said["imu3"].readings[0]
    said["imu3"].write(paths[1])
    result, _ = replay(*units(paths), "--allow-missing", "-o", tmp_path / "out", code=3)
    assert [span["unit"] for span in result["selected"]] == ["imu3", ""]
    assert result["selected"][-1]["reason"] == "none fit"


def test_the_only_unit_that_speaks_is_the_source_though_it_lacks_axes(said, tmp_path):
    paths = [tmp_path / "gone.csv", said["imu3"].write(tmp_path / "imu3.csv")]
    single = ("--set", "units.imu3.axes=[ax, ay, gz]")
    result, _ = replay(*units(paths), "--allow-missing", *single, "-o", tmp_path / "out", code=3)
    assert [span["unit"] for span in result["selected"]] == ["imu3"]
    assert result["degraded"] == 1.0


def test_frozen_unit_is_reported(said, tmp_path):
    kept = said["imu3"].between(7.0, 9.0)
    said["imu3"].readings[kept] = said["imu3"].readings[kept][0]
    _, events = replayed(said, tmp_path)
    assert faults(events, "imu3")[0] == "frozen"


def test_unit_at_the_end_of_its_stated_range_is_reported(said, tmp_path):
    unit = said["imu3"]
    np.clip(unit.readings[:, 3:], -0.5, 0.5, out=unit.readings[:, 3:])
    _, events = replayed(said, tmp_path, "--set", "units.imu3.angular_rate_range=0.5")
    assert "saturated" in faults(events, "imu3")


def test_log_with_missing_time_stamps_is_read_with_the_remaining_rows(said, tmp_path):
    path = said["imu3"].write(tmp_path / "imu3.csv")
    lines = path.read_text().splitlines()
    lines[100:110] = [",".join(["nan", *line.split(",")[1:]]) for line in lines[100:110]]
    path.write_text("\n".join(lines) + "\n")
    paths = [said["imu1"].write(tmp_path / "imu1.csv"), path]
    result, _ = replay(*units(paths), "-o", tmp_path / "out")
    assert any("left out 10 samples without a number (time 10)" in line for line in result["warnings"])


def test_a_primary_that_deviates_itself_calibrates_nobody(tmp_path):
    wrong = Imu("imu1", accelerometer_bias=(0.0, 0.0, 0.4))
    said = record([wrong, BIASED], 44, MOVED)
    log = write_table(tmp_path / "flight.csv", said)
    result, events = replay(log, *units(said), *QUICK, "-o", tmp_path / "out", code=3)
    assert {event["figures"]["reason"] for event in of(events, "imu2", "withheld")} == {"primary invalid"}
    assert "imu1 deviated at rest and stayed the source" in result["known_faults"][0]
    assert result["errors"] == []
    alone, _ = replay(
        log, *units(said), *QUICK, "--set", "gate=secondary alone", "-o", tmp_path / "alone", code=None
    )
    assert alone["events"].get("triggered", 0) >= 1


def test_turn_about_one_axis_shows_the_gyroscope_about_that_axis_only(tmp_path):
    turned = motion(swing=(0.0, 0.0, 2.0), push=3.0)
    said = record([PRIMARY, BIASED], 45, turned)
    log = write_table(tmp_path / "flight.csv", said)
    result, _ = replay(log, *units(said), *QUICK, "-o", tmp_path / "out", code=None)
    gyroscope = next(each for each in result["errors"] if each["sensor"] == "gyroscope")
    assert gyroscope["directions"] == 1
    sigma = np.array(gyroscope["matrix_sigma"], dtype=float)
    assert np.isnan(sigma[:, :2]).all()
    assert np.isfinite(sigma[:, 2]).all()


def test_a_unit_with_single_axes_is_calibrated_in_those_it_has(tmp_path):
    said = record([PRIMARY, BIASED], 46, MOVED)
    single = said["imu2"]
    columns = [CHANNELS.index(name) for name in ("ax", "ay", "gz")]
    rows = np.column_stack([single.time, single.readings[:, columns]]).tolist()
    path = tmp_path / "single.csv"
    path.write_text("\n".join(["time,ax,ay,gz", *(",".join(map(repr, row)) for row in rows)]) + "\n")
    result, events = replay(
        *units([said["imu1"].write(tmp_path / "imu1.csv"), path]),
        *QUICK,
        *("--for", "single:columns=az=ax,gx=gz,gy=gz", "--for", "single:accelerometer-unit=m/s^2"),
        *("--for", "single:gyroscope-unit=rad/s", "--set", "units.single.axes=[ax, ay, gz]"),
        *("-o", tmp_path / "out"),
        code=None,
    )
    assert faults(events, "single") == []
    found = {each["sensor"]: each for each in result["errors"]}
    assert found["gyroscope"]["bias"][2] == pytest.approx(BIASED.gyroscope_bias[2], abs=5e-4)
    np.testing.assert_allclose(found["accelerometer"]["bias"][:2], BIASED.accelerometer_bias[:2], atol=0.02)
    assert all(span["unit"] == "imu1" for span in result["selected"])


def test_a_source_that_deviates_at_a_later_rest_is_named(tmp_path):
    """Evaluations to calibrate are ten minutes apart; what a rest shows of the source is known."""
    said = record([PRIMARY, SOUND], 43, motion(rest=6.0, moving=8.0, after=6.0))
    primary, other = said.values()
    primary.readings[primary.between(9.0, np.inf), 3] += 0.1
    # Nothing else shows it: the secondary has no gyroscope.
    paths = [primary.write(tmp_path / "imu1.csv"), tmp_path / "other.csv"]
    table = np.column_stack([other.time, other.readings[:, :3]])
    np.savetxt(paths[1], table, delimiter=",", header="time,ax,ay,az", comments="", fmt="%.6f")
    _, events = replay(*units(paths), "-o", tmp_path / "out", code=3)
    shown = [
        event["figures"]["exceeded"]
        for event in of(events, "imu1", "evaluated")
        if event["time"] > 14.0 and event["figures"]["sensor"] == "gyroscope"
    ]
    assert shown == [True]
