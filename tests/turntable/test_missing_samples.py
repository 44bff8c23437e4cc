"""Logs that lack samples: honest sigmas, and a count of what is missing."""

import json

import numpy as np
import pytest
from tests.support.repetitions import repetitions
from tests.support.turntable_sessions import PARAMETERS, calibrated, errors, simulate, typed, write

import tumble
from tumble.foundation.recording import Recording

SHARE = 0.1
ONE_TURN_IN_FOUR_SECONDS = {
    "grades": ("industrial",),
    "rest_seconds": 6.0,
    "turn_rate_dps": 45.0,
    "turn_acceleration_dps2": 90.0,
}


def without(unit, share, random):
    """The recording of a unit less samples lost one by one."""
    samples = unit.samples
    left = random.random(len(samples)) >= share
    left[[0, -1]] = True
    recording = Recording.from_arrays(
        unit.name, samples.time[left], samples.accelerometer[left], samples.gyroscope[left], clock="turntable"
    )
    return recording, int((~left).sum())


def normalised(unit, found, triad):
    """(12,) errors over their sigmas."""
    result = getattr(found, triad)
    return errors(unit, found, triad) / np.sqrt(np.diag(result.covariance))


@pytest.mark.parametrize("where", ["target", "reference", "both"])
def test_sigmas_hold_where_samples_are_missing(where):
    found = []
    for seed in range(4100, 4100 + repetitions(24)):
        session = simulate(seed, **ONE_TURN_IN_FOUR_SECONDS)
        random = np.random.default_rng(seed)
        unit = session.target_units[0]
        recordings = [
            without(each, SHARE if where in (name, "both") else 0.0, random)[0]
            for name, each in (("reference", session.reference_unit), ("target", unit))
        ]
        target = tumble.turntable(recordings[0], recordings[1:]).targets[0]
        found.append(normalised(unit, target, "gyroscope"))
    spread = np.sqrt(np.mean(np.square(found)))
    # Twelve parameters a session: so many deviate from one by a standard error each.
    slack = 4.0 / np.sqrt(2.0 * PARAMETERS * len(found))
    assert abs(spread - 1.0) < slack, spread
    assert np.abs(found).max() < 5.0


def test_the_command_says_how_many_samples_each_log_lacks(tmp_path):
    session = simulate(4200, **ONE_TURN_IN_FOUR_SECONDS)
    reference, target = write(session, tmp_path)
    random = np.random.default_rng(4200)
    head, *rows = target.read_text().splitlines(keepends=True)
    left = [row for k, row in enumerate(rows) if k in (0, len(rows) - 1) or random.random() >= SHARE]
    target.write_text(head + "".join(left))
    done = calibrated(reference, target, "-o", tmp_path / "out", "--json")
    content = json.loads(done.out)
    (found,) = content["targets"]
    lost = len(rows) - len(left)
    assert abs(found["missing_samples"] - lost) <= 0.1 * lost
    assert content["reference"]["missing_samples"] == 0
    assert any("samples missing" in warning for warning in found["warnings"])
    assert "samples missing" in typed("turntable", reference, target, "-o", tmp_path / "out").text


def test_turn_with_gaps_is_still_matched_with_the_reference():
    for seed in range(4300, 4300 + repetitions(12)):
        session = simulate(seed, **ONE_TURN_IN_FOUR_SECONDS)
        random = np.random.default_rng(seed)
        recordings = []
        for unit in session.units:
            left = np.ones(len(unit.samples), dtype=bool)
            for start in np.flatnonzero(random.random(len(left)) < 0.01):
                left[start : start + random.integers(2, 9)] = False
            left[[0, -1]] = True
            samples = unit.samples
            recordings.append(
                Recording.from_arrays(
                    unit.name, samples.time[left], samples.accelerometer[left], samples.gyroscope[left]
                )
            )
        target = tumble.turntable(recordings[0], recordings[1:]).targets[0]
        assert not target.failure, target.failure
        for triad in ("accelerometer", "gyroscope"):
            off = normalised(session.target_units[0], target, triad)
            assert np.nanmax(np.abs(off)) < 5.0
