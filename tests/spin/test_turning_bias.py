"""A gyroscope that reads otherwise while it turns than at rest: its bias is not that of the rests."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from repetitions import few
from spin_sessions import record, still, turn

BIAS = np.array([0.02, -0.01, 0.015])
"""rad/s, of the robot that `spin_sessions` has."""
ONE_WAY = (still(), turn(3), still())
BOTH_WAYS = (still(), turn(3), still(), turn(-3), still())
SESSIONS = [(seed, moves) for seed in range(1, 9) for moves in (ONE_WAY, BOTH_WAYS)]


def found(session, gyroscope):
    return tumble.spin(tumble.Recording.from_arrays("robot", session.time, session.accelerometer, gyroscope))


def zeroed(session, moves, delay):
    """Returns readings (n, 3) without the bias in each rest, from `delay` s after it began."""
    rates, start = session.gyroscope.copy(), 0.0
    for move in moves:
        if not move.turns:
            rates[(session.time >= start + delay) & (session.time < start + move.seconds)] -= BIAS
        start += move.seconds
    return rates


@pytest.mark.parametrize("delay", [0.0, 0.5, 1.0])
@pytest.mark.parametrize(("seed", "moves"), few(SESSIONS, 4))
def test_a_gyroscope_that_zeroes_itself_at_rest_is_named(seed, moves, delay):
    session = record(moves, seed)
    result = found(session, zeroed(session, moves, delay))
    assert result.verdict == "model not met"
    (objection,) = result.spins[0].objections
    assert "reads otherwise while it turns than at rest" in objection
    assert objection in result.spins[0].warnings


@pytest.mark.parametrize("angle", [0.0, 0.005])
@pytest.mark.parametrize("moves", [ONE_WAY, BOTH_WAYS], ids=["one way", "both ways"])
def test_sound_gyroscopes_have_one_bias(moves, angle):
    """Neither noise nor axes that are askew by `angle`, rad, make another bias."""
    for seed in range(1, 9):
        session = record(moves, seed)
        askew = np.eye(3) + angle * np.random.default_rng(seed).normal(size=(3, 3))
        result = found(session, session.gyroscope @ askew.T)
        assert result.verdict == "calibrated"
        assert not result.spins[0].objections


def test_a_bias_that_drifts_is_no_second_one():
    session = record(BOTH_WAYS, 49)
    drifting = session.gyroscope + np.outer(3e-5 * session.time, [1.0, 0.0, 0.0])
    assert not found(session, drifting).spins[0].objections
