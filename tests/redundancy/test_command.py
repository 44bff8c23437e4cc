"""`tumble redundancy` as it is typed: a set that rests, moves, and loses its primary."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import tumble
from redundancy_sets import (
    BIASED,
    FACING_DOWN,
    PRIMARY,
    QUICK,
    SOUND,
    Imu,
    motion,
    of,
    record,
    replay,
    typed,
    units,
    write_table,
)
from tumble.calibration.document import Calibration
from turntable_sessions import contents, one_line

MOVED = motion()


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A log of three units, replayed: folder, readings, result, events."""
    folder = tmp_path_factory.mktemp("flown")
    said = record([PRIMARY, BIASED, SOUND], 11, MOVED)
    log = write_table(folder / "flight.csv", said)
    result, events = replay(log, *units(said), *QUICK, "-o", folder / "out")
    return folder, said, result, events


def error_of(result, unit, sensor):
    return next(each for each in result["errors"] if (each["unit"], each["sensor"]) == (unit, sensor))


def test_deviating_secondary_is_calibrated_and_a_sound_one_is_not(flown):
    _, _, result, events = flown
    assert {event["figures"]["sensors"] for event in of(events, "imu2", "triggered")} == {"both"}
    assert of(events, "imu3", "triggered") == []
    assert {error["unit"] for error in result["errors"]} == {"imu2"}
    order = [event["event"] for event in events if event["unit"] == "imu2"]
    assert order.index("triggered") < order.index("motion began") < order.index("adopted")


def test_the_error_found_is_the_true_one(flown):
    _, _, result, _ = flown
    accelerometer = error_of(result, "imu2", "accelerometer")
    gyroscope = error_of(result, "imu2", "gyroscope")
    # Largest over seeds 100 to 109: bias 0.0036 m/s^2 and 0.00012 rad/s, M 0.00052 and 0.00023.
    np.testing.assert_allclose(accelerometer["bias"], BIASED.accelerometer_bias, atol=0.006)
    np.testing.assert_allclose(gyroscope["bias"], BIASED.gyroscope_bias, atol=2.5e-4)
    np.testing.assert_allclose(accelerometer["matrix"], 1.01 * np.eye(3), atol=8e-4)
    np.testing.assert_allclose(gyroscope["matrix"], 0.99 * np.eye(3), atol=4e-4)


def test_the_residual_on_pairs_kept_from_the_fit_falls_to_the_noise(flown):
    _, _, result, _ = flown
    for sensor in ("accelerometer", "gyroscope"):
        error = error_of(result, "imu2", sensor)
        assert error["residual"] < 0.1 * error["residual_before"]


def test_after_calibration_the_secondary_no_longer_deviates_at_rest(flown):
    _, _, _, events = flown
    evaluated = of(events, "imu2", "evaluated")
    assert any(event["figures"]["exceeded"] for event in evaluated if event["time"] < 5.0)
    after = [event for event in evaluated if event["time"] > 35.0]
    assert after
    assert not any(event["figures"]["exceeded"] for event in after)


def test_the_calibration_file_corrects_the_log_of_the_secondary(flown):
    folder, said, result, _ = flown
    done = typed("apply", result["files"]["imu2"], f"{folder / 'flight.csv'}:imu2", "-o", folder / "good.csv")
    assert done.code == 0, done.err
    chunk = next(iter(tumble.open_recording(folder / "good.csv").chunks()))
    corrected = np.hstack([chunk.accelerometer, chunk.gyroscope])
    before = np.abs((said["imu2"].readings - said["imu1"].readings).mean(axis=0))
    after = np.abs((corrected - said["imu1"].readings).mean(axis=0))
    assert (after[:3] < 0.005).all()
    assert (after[3:] < 3e-4).all()
    assert (after < 0.1 * before).all()


def test_events_are_one_json_object_a_line_in_order_of_time(flown):
    _, _, result, events = flown
    assert all(set(event) == {"time", "unit", "event", "figures"} for event in events)
    times = [event["time"] for event in events]
    assert times == sorted(times)
    counted = {name: sum(event["event"] == name for event in events) for name in result["events"]}
    assert counted == result["events"]


def test_summary_names_the_calibrated_units_and_the_sources(flown, tmp_path):
    folder, said, _, _ = flown
    done = typed("redundancy", folder / "flight.csv", *units(said), *QUICK, "-o", tmp_path)
    assert done.code == 0
    assert "imu2 accelerometer" in done.text
    assert "affine" in done.text
    assert "imu1 (start)" in done.text
    assert f"Events: {tmp_path / 'events.jsonl'}" in done.out


def test_the_same_log_gives_the_same_events_from_python(flown):
    folder, _, _, events = flown
    settings = {"collect": 20.0, "collect_timeout": 60.0, "evaluate_every": 5.0}
    result = tumble.redundancy("imu1", ["imu2", "imu3"], log=folder / "flight.csv", settings=settings)
    assert [(e.time, e.unit, e.event) for e in result.events] == [
        (e["time"], e["unit"], e["event"]) for e in events
    ]
    assert result.traces[1].name == "imu2"
    assert len(result.traces[1].specific_force) == len(result.window_time)
    assert (np.diff(result.window_time) > 0.0).all()


def test_a_replay_in_blocks_is_the_replay_of_the_whole(flown):
    _, said, _, _ = flown
    settings = {"collect": 20.0, "collect_timeout": 60.0, "evaluate_every": 5.0}

    def chopped(samples):
        recordings = [_in_pieces(name, said[name], samples[name]) for name in said]
        return tumble.redundancy(recordings[0], recordings[1:], settings=settings)

    whole = chopped({"imu1": 10**6, "imu2": 10**6, "imu3": 10**6})
    parts = chopped({"imu1": 137, "imu2": 512, "imu3": 61})
    assert parts.events == whole.events
    np.testing.assert_array_equal(parts.window_time, whole.window_time)
    for one, other in zip(parts.traces, whole.traces, strict=True):
        np.testing.assert_array_equal(one.specific_force_compensated, other.specific_force_compensated)


def _in_pieces(name, unit, samples):
    """A recording in memory whose chunks hold so many samples."""
    whole = tumble.Recording.from_arrays(
        name, unit.time, unit.readings[:, :3], unit.readings[:, 3:], clock="one"
    )
    chunk = next(iter(whole.chunks()))
    parts = [
        tumble.Chunk(
            *(values[cut : cut + samples] for values in (chunk.time, chunk.accelerometer, chunk.gyroscope))
        )
        for cut in range(0, len(chunk), samples)
    ]
    return tumble.Recording(whole.metadata, lambda: iter(parts))


def test_calibrated_secondary_takes_over_from_a_silent_primary(tmp_path):
    said = record([PRIMARY, BIASED, SOUND], 12, MOVED)
    paths = {name: unit.part(end=38.0 if name == "imu1" else np.inf) for name, unit in said.items()}
    for name, unit in paths.items():
        unit.write(tmp_path / f"{name}.csv")
    names = [tmp_path / f"{name}.csv" for name in said]
    result, events = replay(*units(names), *QUICK, "-o", tmp_path / "out")
    assert [span["unit"] for span in result["selected"]] == ["imu1", "imu2"]
    assert result["selected"][1]["reason"] == "primary failed"
    assert 38.0 < result["selected"][1]["start"] < 38.2
    assert of(events, "imu1", "unhealthy")[0]["figures"]["reason"] == "late"


def test_units_of_different_rates_places_and_mountings_are_calibrated(tmp_path):
    fast = Imu("fast", rate_hz=250.0, accelerometer_noise=0.01, gyroscope_noise=0.001)
    slow = Imu(
        "slow",
        rate_hz=80.0,
        accelerometer_bias=(0.2, 0.3, -0.25),
        gyroscope_bias=(0.02, 0.03, -0.02),
        mounting=FACING_DOWN,
        lever_arm=(0.05, -0.04, 0.03),
        clock=12.5,
    )
    said = record([fast, slow], 13, MOVED)
    names = [said[name].write(tmp_path / f"{name}.csv") for name in said]
    result, _ = replay(
        *units(names),
        *QUICK,
        "--set",
        "units.slow.time_offset=-12.5",
        "--set",
        f"units.slow.sensor_from_primary={FACING_DOWN.tolist()}",
        "--set",
        "excitation_lever_arm=0.5",
        "-o",
        tmp_path / "out",
    )
    found = error_of(result, "slow", "accelerometer")
    assert found["fit_model"] == "affine and lever arm"
    np.testing.assert_allclose(found["lever_arm"], slow.lever_arm, atol=0.005)
    np.testing.assert_allclose(found["matrix"], FACING_DOWN, atol=0.003)
    np.testing.assert_allclose(found["bias"], slow.accelerometer_bias, atol=0.02)
    assert result["start"] == 0.0


def test_a_device_with_short_floats_decides_alike(flown, tmp_path):
    folder, said, _, events = flown
    _, short = replay(
        folder / "flight.csv", *units(said), *QUICK, "--precision", "f32", "-o", tmp_path / "out"
    )
    assert [(e["unit"], e["event"]) for e in short] == [(e["unit"], e["event"]) for e in events]


def test_the_command_evaluate_evaluates_a_rest_that_would_not_be(flown, tmp_path):
    folder, said, _, _ = flown
    log = folder / "flight.csv"
    never = ("--set", "evaluate_every=none", "--set", "evaluate_after_start=false")
    _, without = replay(log, *units(said), *never, "-o", tmp_path / "a", code=3)
    assert of(without, "imu2", "evaluated") == []
    _, events = replay(log, *units(said), *never, "--command", "37:evaluate", "-o", tmp_path / "b", code=3)
    assert min(event["time"] for event in of(events, "imu2", "evaluated")) >= 37.0
    assert of(events, "imu2", "triggered")


def test_the_command_return_makes_the_primary_the_source_again(tmp_path):
    said = record([PRIMARY, BIASED, SOUND], 14, MOVED)
    said["imu1"].readings[said["imu1"].between(20.0, 21.0)] = np.nan
    paths = [said[name].write(tmp_path / f"{name}.csv") for name in said]
    lasting, _ = replay(*units(paths), *QUICK, "-o", tmp_path / "a", code=3)
    assert lasting["selected"][0]["unit"] == "imu1"
    assert lasting["selected"][-1]["unit"] != "imu1"
    back, _ = replay(*units(paths), *QUICK, "--command", "30:return", "-o", tmp_path / "b", code=3)
    assert (back["selected"][-1]["unit"], back["selected"][-1]["reason"]) == ("imu1", "command")
    assert back["selected"][-1]["start"] == pytest.approx(30.0, abs=0.02)


def test_triggered_secondary_that_never_moved_ends_with_code_3(tmp_path):
    said = record([PRIMARY, BIASED], 15, motion(moving=5.0, swing=(0.0, 0.0, 0.0), push=0.0))
    log = write_table(tmp_path / "still.csv", said)
    timeout = ("--set", "motion_timeout=5")
    result, events = replay(log, *units(said), *timeout, "-o", tmp_path / "out", code=3)
    assert of(events, "imu2", "abandoned")[0]["figures"]["reason"] == "no motion"
    assert result["errors"] == []
    assert not (tmp_path / "out" / "imu2.redundancy.yaml").exists()


def test_a_calibration_left_by_an_earlier_run_is_pointed_at(flown, tmp_path):
    said = record([PRIMARY, BIASED], 15, motion(moving=5.0, swing=(0.0, 0.0, 0.0), push=0.0))
    log = write_table(tmp_path / "still.csv", said)
    folder = tmp_path / "out"
    folder.mkdir()
    stale = folder / "imu2.redundancy.yaml"
    stale.write_text("of an earlier run")
    done = typed("redundancy", log, *units(said), "-o", folder)
    assert f"tumble: warning: {stale} is of an earlier run" in done.err
    assert stale.read_text() == "of an earlier run"


def test_the_calibration_of_the_primary_leads_on_to_the_truth(flown, tmp_path):
    worse = Imu("imu1", accelerometer_bias=(0.05, 0.04, -0.05), accelerometer_scale=1.004)
    said = record([worse, BIASED], 16, MOVED)
    log = write_table(tmp_path / "flight.csv", said)
    own = Calibration.model_validate(
        {
            "name": "imu1",
            "accelerometer": {"M": 1.004 * np.eye(3), "b": np.array(worse.accelerometer_bias)},
        }
    )
    own.save(tmp_path / "own.yaml")
    result, _ = replay(
        log, *units(said), *QUICK, "--calibration", tmp_path / "own.yaml", "-o", tmp_path / "out"
    )
    found = Calibration.load(result["files"]["imu2"])
    np.testing.assert_allclose(found.accelerometer.b, BIASED.accelerometer_bias, atol=0.02)
    np.testing.assert_allclose(found.accelerometer.M, 1.01 * np.eye(3), atol=0.004)
    assert found.reference.calibration_hash == own.hash()
    assert json.loads(json.dumps(result["calibration_hash"])) == own.hash()


def test_running_twice_writes_the_same_files(flown, tmp_path):
    folder, said, _, _ = flown
    first, second = tmp_path / "a", tmp_path / "b"
    for out in (first, second, second):
        replay(folder / "flight.csv", *units(said), *QUICK, "-o", out)
    a, b = contents(first), contents(second)
    assert set(a) == set(b)
    assert all(a[name] == b[name] for name in a if not name.endswith(".html"))


@pytest.fixture(scope="module")
def twice(flown, tmp_path_factory):
    """Every file of two replays of one log that found different errors."""
    folder, said, _, _ = flown
    out = tmp_path_factory.mktemp("twice")
    words = [folder / "flight.csv", *units(said), *QUICK]
    assert typed("redundancy", *words, "--set", "largest_fit_model=offset", "-o", out / "old").code in (0, 3)
    assert typed("redundancy", *words, "-o", out / "new").code == 0
    old, new = contents(out / "old"), contents(out / "new")
    assert all(new[name] != text for name, text in old.items())
    return words, old, new


@pytest.mark.parametrize("fails_at", range(1, 8))
def test_a_disk_that_fills_up_leaves_every_file_whole_old_or_new(twice, tmp_path, monkeypatch, fails_at):
    words, old, new = twice
    for name, text in old.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(text)
    replace, calls = Path.replace, []

    def until_full(path, target):
        calls.append(target)
        if len(calls) == fails_at:
            raise OSError(28, "No space left on device")
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", until_full)
    done = typed("redundancy", *words, "-o", tmp_path)
    assert done.code == 2
    assert "No space left on device" in one_line(done.err)
    found = contents(tmp_path)
    assert set(found) == set(old)
    # The page shows how fast the replay was, which differs from run to run.
    assert found["redundancy.html"].endswith(b"</html>")
    assert all(text in (old[name], new[name]) for name, text in found.items() if name != "redundancy.html")
