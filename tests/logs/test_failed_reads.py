"""Readings of zero that a driver gave where it could read none are no readings, in whatever motion."""

import numpy as np
import pytest

from tumble import open_recording
from tumble.foundation.errors import TumbleError

RATE = 100.0
STEP = {"accelerometer": 0.0006, "gyroscope": 0.0011}
"""SI: resolution."""


def motion(seed, count=4000):
    """Returns times (count,) and readings (count, 3) of each triad in rests and turns, SI."""
    generator = np.random.default_rng(seed)
    print(f"seed {seed}")
    time = np.arange(count) / RATE
    turning = np.where(time % 10.0 > 6.0, np.sin(np.pi * (time % 10.0 - 6.0) / 4.0), 0.0)
    angle = np.cumsum(turning) / RATE
    force = 9.8 * np.column_stack([np.sin(angle), np.zeros(count), np.cos(angle)])
    rate = np.column_stack([0.0 * angle, turning, 0.0 * angle])
    readings = {
        "accelerometer": force + generator.normal(0.0, 0.02, force.shape),
        "gyroscope": rate + np.array([0.05, -0.03, 0.04]) + generator.normal(0.0, 0.002, rate.shape),
    }
    return time, {triad: STEP[triad] * np.rint(values / STEP[triad]) for triad, values in readings.items()}


def logged(folder, time, readings):
    path = folder / "unit.csv"
    rows = np.column_stack([time, readings["accelerometer"], readings["gyroscope"]])
    head = "time [s],ax [m/s^2],ay [m/s^2],az [m/s^2],gx [rad/s],gy [rad/s],gz [rad/s]"
    np.savetxt(path, rows, "%.9g", ",", header=head, comments="")
    return open_recording(path)


@pytest.mark.parametrize("run", [1, 3])
@pytest.mark.parametrize("code", [0.0, -1.0], ids=["zero", "minus one"])
@pytest.mark.parametrize(
    "triads", [("accelerometer",), ("gyroscope",), ("accelerometer", "gyroscope")], ids="+".join
)
@pytest.mark.parametrize("seed", range(3))
def test_failed_reads_are_left_out_and_counted(tmp_path, triads, code, run, seed):
    time, readings = motion(seed)
    # Within a turn, a rate may change by a quarter from before several failed reads to behind them.
    places = np.arange(10, len(time) - 10, 10)
    places = places[time[places] % 10.0 < 5.5] if run > 1 else places
    first = np.random.default_rng(seed).choice(places, 36 // run, replace=False)
    failed = np.ravel(first[:, None] + np.arange(run))
    for triad in triads:
        readings[triad][failed] = code * STEP[triad]
    recording = logged(tmp_path, time, readings)
    stream = recording.chunks()
    kept = np.concatenate([chunk.time for chunk in stream])
    assert np.allclose(kept, np.delete(time, failed))
    (notice,) = stream.counts.notices()
    assert notice.startswith(f"left out {len(failed)} samples that no sensor reads: {triads[0]}")


def test_a_log_of_which_many_reads_failed_is_refused_in_one_line(tmp_path):
    time, readings = motion(1)
    readings["accelerometer"][50::50] = 0.0
    with pytest.raises(TumbleError, match="79 of 4000 samples are what no sensor reads") as refusal:
        list(logged(tmp_path, time, readings).chunks())
    assert "\n" not in str(refusal.value)


MOTIONS = {
    "a fall": lambda time: ("accelerometer", (time > 20.0) & (time < 20.4), 0.0),
    "a turn through zero": lambda time: ("gyroscope", time > 20.0, np.sin(40.0 * time)),
    "a vibration": lambda time: ("accelerometer", time > 20.0, 12.0 * np.sin(2.0 * np.pi * 24.9 * time)),
}


@pytest.mark.parametrize("case", MOTIONS.values(), ids=MOTIONS)
@pytest.mark.parametrize("seed", range(3))
def test_readings_that_pass_through_zero_are_kept(tmp_path, case, seed):
    time, readings = motion(seed)
    triad, when, value = case(time)
    noise = np.random.default_rng(seed).normal(0.0, 3.0 * STEP[triad], (len(time), 3))
    moved = STEP[triad] * np.rint((np.asarray(value)[..., None] + noise) / STEP[triad])
    readings[triad] = np.where(when[:, None], moved, readings[triad])
    assert sum(len(chunk) for chunk in logged(tmp_path, time, readings).chunks()) == len(time)


@pytest.mark.parametrize("step", [0.01, 0.05, 0.2])
def test_a_gyroscope_that_shows_rest_as_zero_loses_nothing(tmp_path, step):
    time, readings = motion(1)
    readings["gyroscope"] = step * np.rint(readings["gyroscope"] / step)
    assert sum(len(chunk) for chunk in logged(tmp_path, time, readings).chunks()) == len(time)
