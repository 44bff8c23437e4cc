"""Stretches: gaps, motion and chunks part what is read, and lose nothing else."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import allantools
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tumble
from log_fixtures import of_one_unit
from tumble import _core
from tumble.foundation.errors import TumbleError
from tumble.foundation.recording import Chunk, Recording
from tumble.procedures.noise.range_ends import RangeEnds
from tumble.tools.simulate import simulate_static

RATE = 100.0


def record(seed=3, duration=120.0, **changes):
    return simulate_static(seed=seed, duration=duration, rate_hz=RATE, **changes).recording


def in_chunks(recording, lengths):
    """The same samples in other chunks."""
    (whole,) = [next(iter([chunk])) for chunk in recording.chunks()]
    ends = [0, *sorted({min(length, len(whole)) for length in lengths}), len(whole)]

    def opened():
        for start, end in pairwise(ends):
            if end > start:
                yield Chunk(whole.time[start:end], whole.accelerometer[start:end], whole.gyroscope[start:end])

    return Recording(replace(recording.metadata), opened)


@given(lengths=st.lists(st.integers(1, 11_999), max_size=5), gap=st.floats(5.0, 110.0))
@settings(max_examples=5)
def test_chunking_of_samples_changes_nothing(lengths, gap):
    recording = record(gaps=((gap, gap + 0.5),))
    whole, pieces = tumble.noise(recording), tumble.noise(in_chunks(recording, lengths))
    assert pieces.still.used == whole.still.used
    assert pieces.still.stretches == whole.still.stretches
    assert pieces.rate == pytest.approx(whole.rate)
    for one, other in zip(whole.channels, pieces.channels, strict=True):
        np.testing.assert_allclose(other.allan.deviation, one.allan.deviation, rtol=1e-9)


def test_gap_divides_the_record_and_is_reported():
    result = tumble.noise(record(gaps=((40.0, 45.0), (80.0, 80.5))))
    assert result.still.gaps == 2
    assert result.still.stretches == 3
    assert result.still.longest == pytest.approx(40.0, abs=1.5)
    assert any(line.startswith("2 gaps") for line in result.warnings)


def test_a_step_at_a_gap_is_no_noise():
    recording = record(gaps=((40.0, 45.0),))
    (chunk,) = recording.chunks()
    stepped = chunk.gyroscope + np.where(chunk.time < 42.0, 0.0, 0.01)[:, None]
    other = Recording.from_arrays("stepped", chunk.time, chunk.accelerometer, stepped)
    one, two = tumble.noise(recording), tumble.noise(other)
    np.testing.assert_allclose(
        two["gyroscope x"].allan.deviation, one["gyroscope x"].allan.deviation, rtol=1e-6
    )


def test_several_logs_are_records_of_one_sensor():
    logs = of_one_unit([record(seed) for seed in (1, 2)])
    joined = tumble.noise(logs)
    alone = [tumble.noise(log) for log in logs]
    assert joined.still.logs == 2
    assert joined.still.used == sum(each.still.used for each in alone)
    curves = [each["gyroscope y"].allan for each in (joined, *alone)]
    counts = [0.5, 0.5]
    mean = sum(share * curve.deviation[0] ** 2 for share, curve in zip(counts, curves[1:], strict=True))
    assert curves[0].deviation[0] ** 2 == pytest.approx(mean, rel=1e-3)
    assert curves[0].freedom[20] == pytest.approx(curves[1].freedom[20] + curves[2].freedom[20], rel=0.02)


def test_motion_is_left_out_and_reported():
    recording = record()
    (chunk,) = recording.chunks()
    turning = np.where((chunk.time > 50.0) & (chunk.time < 60.0), 1.0, 0.0)[:, None]
    moved = Recording.from_arrays("moved", chunk.time, chunk.accelerometer, chunk.gyroscope + turning)
    result = tumble.noise(moved)
    assert result.still.duration < 111.0
    assert any("did not stand still" in line for line in result.warnings)
    still = tumble.noise(recording)
    assert result["gyroscope z"].allan.deviation[0] == pytest.approx(
        still["gyroscope z"].allan.deviation[0], rel=0.03
    )


def test_the_rate_is_that_of_the_clock_of_the_log():
    (chunk,) = record().chunks()
    slow = Recording.from_arrays("slow", 1.001 * chunk.time, chunk.accelerometer, chunk.gyroscope)
    assert tumble.noise(slow).rate == pytest.approx(RATE / 1.001)


def test_samples_that_are_rare_at_rest_alone_are_refused():
    """Each of their steps is longer than a gap of the log before."""
    (chunk,) = record().chunks()
    rare = slice(6000, None, 10)
    turning = np.where(chunk.time < 60.0, np.sin(chunk.time), 0.0)[:, None]
    rows = np.r_[np.arange(6000), np.arange(len(chunk))[rare]]
    slow = Recording.from_arrays(
        "slow", chunk.time[rows], chunk.accelerometer[rows], (chunk.gyroscope + turning)[rows]
    )
    with pytest.raises(TumbleError, match="its rate changes; split the log where it does"):
        tumble.noise(slow)


def test_a_record_with_one_triad_shows_that_triad():
    (chunk,) = record().chunks()
    result = tumble.noise(Recording.from_arrays("gyroscope", chunk.time, None, chunk.gyroscope))
    assert [channel.name for channel in result] == ["gyroscope x", "gyroscope y", "gyroscope z"]


def test_deviations_are_those_of_allantools():
    rng = np.random.default_rng(8)
    print("seed 8")
    y = np.cumsum(rng.normal(size=(20_000, 1)), axis=0) * 0.01 + rng.normal(size=(20_000, 1))
    record = _core.NoiseRecord(1)
    record.push(y)
    record.end_stretch()
    (found,) = record.conclude(1.0 / RATE)
    for name, peer in (
        ("allan", allantools.oadev),
        ("modified", allantools.mdev),
        ("hadamard", allantools.ohdev),
    ):
        curve = found[name][found[name][:, 0] < 32.0 / RATE]
        _, deviation, _, _ = peer(y[:, 0], rate=RATE, data_type="freq", taus=curve[:, 0])
        np.testing.assert_allclose(curve[:, 1], deviation, rtol=1e-9)


@pytest.mark.parametrize(
    ("second", "changes"), [(1.0, False), (1.03, False), (1.3, True), (2.0, True), (0.7, True)]
)
def test_logs_of_unlike_noise_are_named(second, changes):
    """Two logs of 1 and 2 mm/s^2/sqrt(Hz) had 1.58 without a word, as noise did not grow along a line."""
    logs = [still_log(f"log {k}", 1e-3 * factor, seed=40 + k) for k, factor in enumerate((1.0, second))]
    warnings = " ".join(tumble.noise(logs).warnings)
    assert ("white noise changes by a factor of" in warnings) == changes


def test_noise_in_bursts_is_named():
    still = still_log("bursts", 1e-3, seed=50)
    chunk = next(iter(still.chunks()))
    force = chunk.accelerometer.copy()
    force[20_000:26_000, 0] += np.random.default_rng(51).normal(0.0, 0.02, 6_000)
    warnings = tumble.noise(Recording.from_arrays("bursts", chunk.time, force, chunk.gyroscope)).warnings
    assert "accelerometer x: white noise changes by a factor of" in " ".join(warnings)


def still_log(name, density, seed, samples=60_000, rate=100.0):
    print(f"seed {seed}")
    values = _core.StillNoise(seed, np.array([[0.0, density, 0.0, 0.0, 0.0]] * 6), rate, samples).draw(
        samples
    )
    time = np.arange(samples) / rate
    return Recording.from_arrays(name, time, values[:, :3] + [0.0, 0.0, 9.8], values[:, 3:])


def clipped(recording, channel, at, steps=None):
    """The same samples, one channel rounded to `steps` of sigma, and cut off `at` so many from its mean."""
    (chunk,) = recording.chunks()
    values = np.hstack([chunk.accelerometer, chunk.gyroscope])
    sigma = values[:, channel].std()
    if steps is not None:
        values[:, channel] = np.round(values[:, channel] / (steps * sigma)) * steps * sigma
    end = values[:, channel].mean() + at * sigma
    cut = np.minimum if at > 0.0 else np.maximum
    values[:, channel] = cut(values[:, channel], end)
    return Recording.from_arrays(recording.metadata.name, chunk.time, values[:, :3], values[:, 3:])


@pytest.mark.parametrize("at", [-2.0, -0.5, 0.0, 1.0, 2.5])
@pytest.mark.parametrize("steps", [None, 0.1])
def test_noise_that_the_end_of_a_range_cuts_off_is_not_stated(at, steps):
    """A rail at the mean took 40 % off N, and moved the mean by 0.4 sigma, without a word."""
    result = tumble.noise(clipped(still_log("rail", 1e-3, seed=60), 2, at, steps))
    cut = {channel.name for channel in result if not channel.term("white noise").observable}
    assert cut == {"accelerometer z"}
    assert "choose a larger range" in list(result)[2].term("white noise").reason


@pytest.mark.parametrize("steps", [None, 0.1, 0.5, 1.0, 1.5, 3.0])
@pytest.mark.parametrize("drift", [0.0, 20.0])
def test_noise_within_its_range_is_not_taken_for_cut_off(steps, drift):
    recording = still_log("whole", 1e-3, seed=61)
    (chunk,) = recording.chunks()
    values = np.hstack([chunk.accelerometer, chunk.gyroscope])
    values += drift * values.std(axis=0) * np.sin(chunk.time / 100.0)[:, None]
    if steps is not None:
        step = steps * np.diff(values, axis=0).std(axis=0) / np.sqrt(2.0)
        values = np.round(values / step) * step
    ends = RangeEnds(6)
    for block in np.array_split(values, 7):
        ends.push(block)
    assert ends.reached() == []
