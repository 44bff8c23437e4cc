"""Units that low-pass on board: a still one is at rest, one that turns slowly is not."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter

import tumble
from tumble.acquisition.acquire import acquire
from tumble.foundation.recording import Recording

SECONDS, SETTLED = 60.0, 2000
DENSITY = np.array([1.5e-3] * 3 + [1e-4] * 3)
"""m/s^2/sqrt(Hz) and rad/s/sqrt(Hz)."""


def recorded(rate, cut_off, order, seed, turning=0.0, seconds=SECONDS):
    """A unit that stands still, or turns about a level axis at a rate, rad/s, behind a low-pass."""
    print(f"seed {seed}")
    samples = round(seconds * rate)
    white = np.random.default_rng(seed).normal(size=(samples + SETTLED, 6)) * DENSITY * np.sqrt(rate)
    noise = lfilter(*butter(order, 2.0 * cut_off / rate), white, axis=0)[SETTLED:]
    time = np.arange(samples) / rate
    angle = turning * time
    force = 9.81 * np.column_stack([np.sin(angle), np.zeros(samples), np.cos(angle)])
    rates = np.array([0.01, turning, -0.02])
    return Recording.from_arrays("unit", time, force + noise[:, :3], rates + noise[:, 3:])


def resting(recording):
    """Share of a recording that is at rest, and the longest rest, s."""
    rests = np.array(acquire(recording).acquired.rest_times).reshape(-1, 2)
    lengths = np.diff(rests, axis=1)
    return lengths.sum() / SECONDS, lengths.max(initial=0.0)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("cut_off", [5.0, 10.0, 20.0, 40.0])
@pytest.mark.parametrize("rate", [100.0, 200.0])
def test_a_still_unit_behind_a_low_pass_is_at_rest(rate, cut_off, order):
    share, _ = resting(recorded(rate, cut_off, order, seed=71))
    assert share > 0.85


@pytest.mark.parametrize("cut_off", [5.0, 40.0])
def test_a_slow_turn_behind_a_low_pass_is_no_rest(cut_off):
    _, longest = resting(recorded(200.0, cut_off, 2, seed=72, turning=np.radians(1.0)))
    assert longest < 3.0


def test_noise_takes_a_low_passed_record_whole():
    result = tumble.noise(recorded(200.0, 10.0, 2, seed=73, seconds=600.0))
    assert not any("rest" in line for line in result.warnings), result.warnings
