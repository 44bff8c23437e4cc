"""Rests in the hand: tremor put into simulated rests changes sigmas, not what is found."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.hands import session, sigmas_off, trembling

import tumble


def played(seed):
    print(f"seed {seed}")
    return session(seed)


def test_sigmas_hold_whatever_part_of_the_rests_trembles():
    off = []
    for seed in range(3):
        hand, rests = played(seed)
        draws = np.random.default_rng(seed)
        for share in (2, 1):
            amplitude, frequency = np.radians(draws.choice([0.02, 0.05, 0.08])), draws.uniform(6.0, 11.0)
            recording = trembling(hand, rests[::share], amplitude=amplitude, frequency=frequency, seed=seed)
            found = tumble.multipose(recording)
            assert len(found.poses) == len(rests)
            off.extend(sigmas_off(found, hand))
    values = np.concatenate(off)
    assert 0.75 < np.sqrt(np.mean(values**2)) < 1.25
    assert np.mean(np.abs(values) < 1.96) > 0.9


def test_omission_has_its_time_and_its_reason():
    hand, rests = played(5)
    shaken = [rests[4], rests[9]]
    found = tumble.multipose(trembling(hand, shaken, amplitude=3e-4, frequency=6.3))
    seen = {(rest.start, rest.end): rest for rest in found.rests}
    assert len(seen) == len(rests)
    named = [rest for rest in seen.values() if rest.remark]
    assert len(named) == 2
    for rest, (start, end) in zip(sorted(named, key=lambda rest: rest.start), shaken, strict=True):
        assert start < rest.end
        assert rest.start < end
        assert "mrad/s at 6.3 Hz" in rest.remark
        if not rest.used:
            assert any("is not used: trembles" in line for line in found.warnings)
    assert found.trembling + len(found.left_out) == 2


def test_quiet_sessions_are_calibrated_as_before():
    hand, _ = played(3)
    found = tumble.multipose(hand.recording)
    assert found.trembling == 0
    assert found.left_out == ()


@pytest.mark.parametrize("stated", [50, 130])
def test_a_wrong_sample_rate_is_named_with_the_probable_one(stated):
    hand, _ = played(2)
    samples = hand.unit.samples
    rate = (len(samples.time) - 1) / (samples.time[-1] - samples.time[0])
    stretched = tumble.Recording.from_arrays(
        "wrong", (samples.time - samples.time[0]) * rate / stated, samples.accelerometer, samples.gyroscope
    )
    found = tumble.multipose(stretched)
    assert found.verdict == "model not met"
    [line] = [line for line in found.warnings if "sample rate is probably" in line]
    probable = float(line.split("probably ")[1].split()[0])
    assert probable == pytest.approx(rate, rel=0.02)
    assert f"not {stated}" in line
