"""Clocks whose pace is uncertain, and stamps that are undecided, widen what is integrated over time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tumble
from repetitions import repetitions
from spin_sessions import record, still, turn
from tumble.acquisition.stamps import with_sample_times
from tumble.foundation.recording import Recording
from tumble.foundation.results import INTERVAL
from tumble.tools.simulate import simulate_multipose

SEED = 8_100
PACE_SIGMA = 2e-3
QUIET = {"bias_instability": False, "g_sensitivity": False, "latitude_deg": None}
SCALES = [0, 4, 8]
"""Where M row by row has them."""


def known_to(recording, pace_sigma):
    """A recording whose pace is known to that sigma."""
    return replace(recording, metadata=replace(recording.metadata, pace_sigma=pace_sigma))


def robot(seed, pace=0.0, **changes):
    """A recording of a robot whose clock runs fast by that share."""
    session = record((still(), turn(3), still()), seed, **changes)
    time = session.time * (1.0 + pace)
    return session, Recording.from_arrays("robot", time, session.accelerometer, session.gyroscope)


def parameter(result, name):
    return next(each for each in result.spins[0].parameters if each.name == name)


def test_the_pace_of_a_clock_is_in_the_scale_and_lever_arm_of_a_spin():
    session, recording = robot(SEED)
    exact, uncertain = (
        tumble.spin(known_to(recording, sigma), true_turns="+3") for sigma in (0.0, PACE_SIGMA)
    )
    for name, share in (
        ("gyroscope scale about the axis", 1.0),
        ("gyroscope scale counter-clockwise", 1.0),
        ("lever arm x", 2.0 * abs(session.robot.lever_arm[0])),
    ):
        before, after = (parameter(found, name).sigma for found in (exact, uncertain))
        assert np.sqrt(after**2 - before**2) == pytest.approx(share * PACE_SIGMA, rel=0.02)
    assert np.array_equal(exact.covariance, uncertain.covariance)


def test_scales_of_spins_hold_whatever_the_pace_of_the_clock():
    off = []
    for seed in range(SEED, SEED + repetitions(80)):
        pace = PACE_SIGMA * np.random.default_rng(seed).standard_normal()
        _, recording = robot(seed, pace)
        found = tumble.spin(known_to(recording, PACE_SIGMA), true_turns="+3")
        scale = parameter(found, "gyroscope scale about the axis")
        off.append((scale.value - 1.0) / scale.sigma)
    assert np.abs(off).max() < 4.0
    assert 0.6 < np.std(off) < 1.5


def hand(seed):
    return simulate_multipose(seed=seed, orientations=14, **QUIET)


def test_the_pace_of_a_clock_is_in_the_gyroscope_scale_of_multipose():
    session = hand(SEED)
    (chunk,) = session.recording.chunks()
    pace = 1.5 * PACE_SIGMA
    fast = Recording.from_arrays("hand", chunk.time * (1.0 + pace), chunk.accelerometer, chunk.gyroscope)
    exact, uncertain = (tumble.multipose(known_to(fast, sigma)) for sigma in (0.0, PACE_SIGMA))
    for found, holds in ((exact, False), (uncertain, True)):
        error = (found.gyroscope.M - session.rate_matrix).ravel()[SCALES]
        off = np.abs(error) / np.sqrt(np.diagonal(found.gyroscope.covariance)[SCALES])
        assert (off < 4.0).all() == holds, off
    added = uncertain.gyroscope.covariance - exact.gyroscope.covariance
    m = np.append(exact.gyroscope.M.ravel(), np.zeros(3))
    assert np.allclose(added, PACE_SIGMA**2 * np.outer(m, m), atol=1e-12)


def undecided(samples, seed):
    """Samples of 1 kHz as 100 Hz: taken up to 2 ms late, and stamped as late again."""
    generator = np.random.default_rng(seed)
    rows = np.arange(0, len(samples) - 10, 10)
    late = generator.integers(0, 3, len(rows))
    taken = rows + late
    return Recording.from_arrays(
        "hand", (rows + 2 * late) * 1e-3, samples.accelerometer[taken], samples.gyroscope[taken]
    )


def test_undecided_stamps_widen_the_gyroscope_of_multipose():
    off = []
    for seed in range(SEED, SEED + repetitions(24)):
        session = simulate_multipose(seed=seed, orientations=14, rate_hz=1000.0, grade="tactical", **QUIET)
        (samples,) = session.recording.chunks()
        found = tumble.multipose(undecided(samples, seed))
        assert any("samples neither evenly" in line for line in found.warnings)
        error = np.append(
            (found.gyroscope.M - session.rate_matrix).ravel(), found.gyroscope.b - session.unit.gyroscope.b
        )
        off.append(np.abs(error) / np.sqrt(np.diagonal(found.gyroscope.covariance)))
    print(np.sqrt(np.mean(np.square(off), axis=0)))
    chance = 3.0 * np.sqrt(0.95 * 0.05 / np.size(off))
    assert (np.array(off) <= INTERVAL).mean() > 0.95 - chance
    assert np.max(off) < 5.0


def test_undecided_stamps_widen_the_scale_of_a_spin():
    _, recording = robot(SEED)
    stamped = replace(recording, metadata=replace(recording.metadata, stamp_sigma=1e-3))
    exact, uncertain = (tumble.spin(each, true_turns="+3") for each in (recording, stamped))
    name = "gyroscope scale about the axis"
    before, after = (parameter(found, name).sigma for found in (exact, uncertain))
    spin = exact.spins[0]
    angle = np.sqrt(2.0) * 1e-3 * spin.rate
    assert np.sqrt(after**2 - before**2) == pytest.approx(angle / (6.0 * np.pi), rel=0.02)


def test_lasting_lateness_widens_more_than_scatter():
    seconds = np.arange(24_000) * 0.01
    generator = np.random.default_rng(SEED)
    scattered = generator.uniform(0.0, 4e-3, len(seconds))
    lasting = np.repeat(generator.uniform(0.0, 4e-3, len(seconds) // 100), 100)
    sigmas = []
    for late in (scattered, scattered + lasting):
        rate = 1.5 * np.sin(2.0 * (seconds + 0.5 * late))[:, None] * [0.4, -0.3, 1.0]
        gyroscope = rate + generator.normal(0.0, 1e-3, rate.shape)
        recording = Recording.from_arrays("unit", seconds + late, np.zeros_like(rate), gyroscope)
        sigmas.append(with_sample_times(recording).metadata.stamp_sigma)
    few, many = sigmas
    assert few == pytest.approx(0.5 * np.std(scattered) / 5.0, rel=0.3)
    assert many > 3.0 * few
