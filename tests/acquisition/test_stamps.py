"""Stamps that come late: even times are fitted to them where the sensor samples evenly."""

import numpy as np
import pytest

import tumble
from tumble import _core
from tumble.acquisition.stamps import with_sample_times
from tumble.foundation.recording import Recording

PERIOD = 0.01


def lateness(kind, count, generator):
    """Returns s by which each of `count` stamps is late."""
    taken = np.arange(count) * PERIOD
    match kind:
        case "uniform":
            return generator.uniform(0.0, 4e-3, count)
        case "exponential":
            return generator.exponential(2e-3, count)
        case "Gaussian":
            return generator.normal(0.0, 1e-3, count)
        case "polled":
            asked = generator.uniform(0.0, 8e-3) + 8e-3 * np.arange(count * 2)
            return asked[np.searchsorted(asked, taken)] - taken
        case "drift":
            return generator.uniform(0.0, 4e-3, count) + wandering(count)
    raise AssertionError(kind)


KINDS = ("uniform", "exponential", "Gaussian", "polled")


def wandering(count):
    """Returns s by which a clock runs ahead whose rate walks by 3e-8 a root second."""
    generator = np.random.default_rng(1)
    return np.cumsum(np.cumsum(generator.normal(0.0, 3e-8 * np.sqrt(PERIOD), count))) * PERIOD


def fitted(stamps):
    times = _core.SampleTimes.fit(np.maximum.accumulate(stamps))
    assert times is not None
    return times, times.times(0, len(stamps))


def turning(taken, stamps, seed, *, when=None):
    """Returns a recording of rests and turns; the sensor samples at `when`, else at `taken`."""
    generator = np.random.default_rng(seed)
    print(f"seed {seed}")
    at = taken if when is None else when
    rate = np.where((at % 10.0 > 6.0)[:, None], np.sin(np.pi * (at[:, None] % 10.0 - 6.0) / 4.0) * 1.5, 0.0)
    gyroscope = rate * [0.4, -0.3, 1.0] + generator.normal(0.0, 1e-3, (len(at), 3))
    accelerometer = np.array([0.0, 0.0, 9.8]) + generator.normal(0.0, 0.01, (len(at), 3))
    return Recording.from_arrays("unit", stamps, accelerometer, gyroscope)


def times_of(recording):
    return np.concatenate([chunk.time for chunk in recording.chunks()])


@pytest.mark.parametrize("kind", KINDS)
def test_errors_of_fitted_spans_are_what_their_sigma_says(kind):
    errors, sigmas = [], []
    for seed in range(20):
        generator = np.random.default_rng(seed)
        taken = np.arange(12_000) * PERIOD
        times, found = fitted(taken + lateness(kind, len(taken), generator))
        errors.append((found[-1] - found[0]) / (taken[-1] - taken[0]) - 1.0)
        sigmas.append(times.rate_sigma)
    print(kind, "rms", np.std(errors), "sigma", np.mean(sigmas))
    # The rate at an end of a recording is known less well than its mean.
    assert np.sqrt(np.mean(np.square(np.array(errors) / sigmas))) < 1.3
    assert np.abs(errors).max() < 1e-5


@pytest.mark.parametrize("kind", [*KINDS, "drift"])
def test_fitted_times_are_even_within_a_twentieth_of_the_scatter(kind):
    generator = np.random.default_rng(5)
    taken = np.arange(30_000) * PERIOD
    late = lateness(kind, len(taken), generator)
    slow = wandering(len(taken)) if kind == "drift" else 0.0
    off = fitted(taken + late)[1] - taken - slow
    assert np.std(off) < 0.05 * np.std(late - slow)


def test_lost_samples_stay_lost():
    generator = np.random.default_rng(3)
    taken = np.delete(np.arange(20_000) * PERIOD, [4000, 9000, 9001, 9002, *range(15_000, 15_200)])
    times, found = fitted(taken + lateness("uniform", len(taken), generator))
    assert times.lost == 204
    off = found - taken
    assert np.ptp(off) < 2e-3
    assert np.array_equal(np.rint(np.diff(found) / PERIOD), np.rint(np.diff(taken) / PERIOD))


def test_a_reader_that_stalls_for_two_seconds_loses_nothing():
    generator = np.random.default_rng(4)
    taken = np.arange(20_000) * PERIOD
    stamps = taken + lateness("exponential", len(taken), generator)
    held = (taken > 77.0) & (taken < 79.0)
    stamps[held] = 79.0 + 1e-5 * np.arange(held.sum())
    times, found = fitted(np.maximum.accumulate(stamps))
    assert times.lost == 0
    assert np.ptp(found - taken) < 1e-4


def test_bursts_a_microsecond_apart_are_known_and_fitted():
    generator = np.random.default_rng(6)
    taken = np.arange(20_000) * PERIOD
    ends = taken[31::32] + generator.uniform(0.0, 3e-3, len(taken[31::32]))
    stamps = (ends[:, None] + 1e-6 * np.arange(32)).ravel()
    times, found = fitted(stamps)
    assert times.burst == pytest.approx(32.0, rel=0.01)
    assert np.std(found - taken[: len(found)]) < 1e-4


def bursts(numbers, size, full, generator):
    """Give stamps of samples read when `size` have come or, with `full`, when as many are due."""
    rows = np.arange(len(numbers))
    burst = numbers // size if full else rows // size
    last = np.array([numbers[burst == each][-1] for each in np.unique(burst)])
    due = ((np.unique(burst) + 1) * size if full else last + 1) * PERIOD
    ends = due + generator.uniform(0.0, 3e-3, len(due))
    place = np.searchsorted(np.unique(burst), burst)
    first = np.searchsorted(burst, np.unique(burst))
    return np.maximum.accumulate(ends[place] + 1e-6 * (rows - first[place]))


LOSSES = {
    "samples": lambda size, generator: generator.choice(12_000, 8, replace=False),
    "whole bursts": lambda size, generator: np.ravel(
        size * generator.choice(12_000 // size, (4, 1), replace=False) + np.arange(size)
    ),
    "parts of bursts": lambda size, generator: np.ravel(
        size * generator.choice(12_000 // size, (4, 1), replace=False) + np.arange(size // 3)
    ),
    "a long stretch": lambda size, generator: generator.integers(3000, 8000) + np.arange(150),
}


@pytest.mark.parametrize("full", [False, True], ids=["as they come", "as they are due"])
@pytest.mark.parametrize("size", [4, 16, 64])
@pytest.mark.parametrize("lost", LOSSES.values(), ids=LOSSES)
def test_bursts_with_losses_are_fitted_right_or_warned_of(lost, size, full):
    for seed in range(4):
        generator = np.random.default_rng(seed)
        numbers = np.delete(np.arange(12_000), lost(size, generator))
        taken = numbers * PERIOD
        found = with_sample_times(turning(taken, bursts(numbers, size, full, generator), seed))
        off = np.ptp(times_of(found) - taken)
        words = ("nothing shows where in a burst", "no even sampling that they could be fitted to")
        assert off < 2e-3 or any(word in line for line in found.metadata.remarks for word in words), off


def test_bursts_without_losses_are_not_warned_of():
    numbers = np.arange(12_000)
    found = with_sample_times(
        turning(numbers * PERIOD, bursts(numbers, 16, True, np.random.default_rng(1)), 1)
    )
    assert not any("lost" in line for line in found.metadata.remarks)


def test_a_log_of_bursts_is_read_without_a_word_on_time_unit(tmp_path):
    taken = np.arange(6400) * PERIOD
    stamps = (taken[31::32][:, None] + 1e-6 * np.arange(32)).ravel()
    rows = [f"{t:.6f},0,0,9.80665,0,0,0" for t in stamps]
    path = tmp_path / "bursts.csv"
    path.write_text(
        "time [s],ax [m/s^2],ay [m/s^2],az [m/s^2],gx [rad/s],gy [rad/s],gz [rad/s]\n" + "\n".join(rows)
    )
    recording = with_sample_times(tumble.open_recording(path))
    assert not any("--time-unit" in remark for remark in recording.metadata.remarks)
    assert any("bursts of 32 samples" in remark for remark in recording.metadata.remarks)
    assert np.allclose(np.diff(times_of(recording)), PERIOD, rtol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_stamps_at_which_the_sensor_samples_are_kept(seed):
    taken = np.arange(12_000) * PERIOD
    stamps = taken + np.random.default_rng(seed).uniform(0.0, 4e-3, len(taken))
    recording = turning(taken, stamps, seed, when=stamps)
    assert with_sample_times(recording) is recording


@pytest.mark.parametrize("seed", range(3))
def test_late_stamps_of_an_even_sensor_are_fitted_with_a_remark(seed):
    taken = np.arange(12_000) * PERIOD
    stamps = taken + np.random.default_rng(seed).uniform(0.0, 4e-3, len(taken))
    found = with_sample_times(turning(taken, stamps, seed))
    assert np.ptp(times_of(found) - taken) < 1e-4
    assert 0.0 < found.metadata.pace_sigma < 1e-5
    (remark,) = found.metadata.remarks
    assert remark.startswith("stamps are late by up to 4 ms; times were fitted, sampling period 10 ms")


def test_a_sensor_between_even_and_stamped_is_reported():
    taken = np.arange(24_000) * PERIOD
    late = np.random.default_rng(8).uniform(0.0, 4e-3, len(taken))
    recording = turning(taken, taken + late, 8, when=taken + 0.5 * late)
    found = with_sample_times(recording)
    assert np.array_equal(times_of(found), taken + late)
    assert "neither evenly" in found.metadata.remarks[0]


def test_exact_stamps_stay_bit_for_bit():
    taken = 3.0 + np.arange(12_000) * PERIOD
    recording = turning(taken, taken, 9)
    assert with_sample_times(recording) is recording


def test_stamps_of_which_motion_shows_nothing_keep_their_scatter():
    taken = np.arange(24_000) * PERIOD
    late = np.random.default_rng(9).uniform(0.0, 8e-3, len(taken))
    still = np.tile([0.0, 0.0, 9.8], (len(taken), 1)), np.zeros((len(taken), 3))
    noise = [np.random.default_rng(seed).normal(0.0, 1e-3, (len(taken), 3)) for seed in (10, 11)]
    recording = Recording.from_arrays("unit", taken + late, still[0] + noise[0], still[1] + noise[1])
    found = with_sample_times(recording)
    assert np.array_equal(times_of(found), taken + late)
    # clocks.md, eq. 15 with a share of zero: the scatter of means of 25 samples.
    assert found.metadata.stamp_sigma == pytest.approx(np.std(late) / np.sqrt(25.0), rel=0.1)
    assert not found.metadata.remarks


@pytest.mark.parametrize("every", [12, 50, 120, 1000])
@pytest.mark.parametrize("decimals", [6, 12])
def test_exact_stamps_with_regular_losses_are_kept(every, decimals):
    taken = np.delete(np.arange(9000) * PERIOD, np.arange(50, 9000, every))
    recording = turning(taken, np.round(taken, decimals), every)
    assert with_sample_times(recording) is recording
