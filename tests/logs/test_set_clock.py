"""A clock that is set while a log is written: from counting since the start to the date."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from log_fixtures import join, made_up, write_text
from tumble.foundation.arrival import ArrivalWatch
from tumble.foundation.recording import Chunk
from tumble.logs import open_recording
from tumble.logs.set_clock import PAUSE_INTERVALS, SetClock
from tumble.tools.simulate import simulate_multipose

EPOCH = 1.7e9


def leapt(chunk, at, by=EPOCH):
    """The chunk with a clock that is set ahead by s before a sample."""
    return Chunk(chunk.time + by * (np.arange(len(chunk)) >= at), chunk.accelerometer, chunk.gyroscope)


@pytest.mark.parametrize("per_chunk", [1, 7, 1000])
@pytest.mark.parametrize("by", [EPOCH, 5e7])
def test_times_after_the_set_follow_on_those_before(per_chunk, by):
    time = np.arange(1000) / 100.0
    given = time + by * (np.arange(1000) >= 300) + by * (np.arange(1000) >= 600)
    clock = SetClock()
    pieces = [given[k : k + per_chunk] for k in range(0, 1000, per_chunk)]
    found = np.concatenate([clock.follow(piece)[0] for piece in pieces])
    steps = np.diff(found)
    assert len(clock.times) == 2
    if per_chunk > 1:
        assert np.allclose(np.delete(steps, [299, 599]), 0.01, rtol=0.0, atol=1e-6)
        assert np.allclose(steps[[299, 599]], 0.01 * PAUSE_INTERVALS, rtol=0.0, atol=1e-6)


def test_delays_of_samples_stay_as_they_are():
    time = np.arange(3000) / 100.0
    late = 0.003 + 0.001 * np.random.default_rng(1).random(3000)
    clock, watch = SetClock(), ArrivalWatch()
    for rows in np.array_split(np.arange(3000), 9):
        watch.push(*clock.follow(time[rows] + EPOCH * (rows >= 1700), EPOCH + time[rows] + late[rows]))
    found = watch.conclude()
    assert found is None or not found.drifts


def test_a_set_clock_is_no_gap_of_the_log(tmp_path):
    chunk = made_up(2000, rate=100.0, temperature=False)
    stream = open_recording(write_text(tmp_path / "log.csv", leapt(chunk, 700))).chunks()
    found = join(list(stream))
    assert found.time[-1] - found.time[0] < 20.2
    (said,) = (notice for notice in stream.counts.notices() if "clock was set" in notice)
    assert "at 7.1 s" in said


def test_a_pause_of_days_stays_one(tmp_path):
    chunk = made_up(2000, rate=100.0, temperature=False)
    found = join(list(open_recording(write_text(tmp_path / "log.csv", leapt(chunk, 700, 7e5))).chunks()))
    assert found.time[-1] > 7e5


def test_a_session_whose_clock_was_set_in_a_turn_loses_that_turn(tmp_path):
    hand = simulate_multipose(seed=11, bias_instability=False, g_sensitivity=False, latitude_deg=None)
    before, after = hand.session.rests[7:9]
    at = int(np.searchsorted(hand.unit.samples.time, (before.end + after.start) / 2))
    header = "time_s,ax_m/s^2,ay_m/s^2,az_m/s^2,gx_rad/s,gy_rad/s,gz_rad/s"
    found = tumble.multipose(write_text(tmp_path / "log.csv", leapt(hand.unit.samples, at), header))
    assert (len(found.rests), len(found.turns)) == (18, 16)
    assert found.verdict == "calibrated"
    said = [each for each in found.warnings if "missing" in each or "too slow" in each]
    assert not said, said
    assert sum("its clock was set" in each for each in found.warnings) == 1
