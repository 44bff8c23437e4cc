"""Rests in which the structure was bumped: the reference sees it, a target of more noise does not."""

import numpy as np
import pytest
from benchmarks.rate_tables import Session, Unit, usual
from scipy.spatial.transform import Rotation
from tests.support.turntable_sessions import PARAMETERS

import tumble
from tumble.foundation.recording import Recording

BUMP_SECONDS = 0.2
SESSIONS = 12


def bumped(recording, begun, turn):
    """The recording of a unit that turned by a rotation vector, rad, within a rest."""
    (chunk,) = recording.chunks()
    x = np.clip((chunk.time - begun) / BUMP_SECONDS, 0.0, 1.0)
    back = Rotation.from_rotvec(-(x**2 * (3.0 - 2.0 * x))[:, None] * turn)
    extra = (6.0 * x * (1.0 - x) / BUMP_SECONDS)[:, None] * turn
    return Recording.from_arrays(
        recording.name, chunk.time, back.apply(chunk.accelerometer), back.apply(chunk.gyroscope) + extra
    )


def trial(seed, angle):
    """Errors of the accelerometer over their sigmas, and the pieces into which the bumped rest fell."""
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    session, unit = Session(rates=(), rest=10.0), usual(random)
    unit.M, unit.b, unit.force_M, unit.force_b = np.eye(3), np.zeros(3), np.eye(3), np.zeros(3)
    turn = random.normal(size=3)
    turn *= np.radians(angle) / np.linalg.norm(turn)
    begun = random.integers(6) * (21.0 + session.turn) + random.uniform(3.0, 17.0)
    logs = [
        bumped(session.recorded(name, each, random), begun, turn)
        for name, each in (("reference", Unit()), ("target", unit))
    ]
    result = tumble.turntable(*logs, clock="shared")
    target = result.targets[0]
    error = np.concatenate([(target.accelerometer.M - np.eye(3)).ravel(), target.accelerometer.b])
    return error / np.sqrt(np.diag(target.accelerometer.covariance)), (
        len(result.reference.rests),
        sum(rest.used for rest in target.rests),
    )


@pytest.mark.parametrize("angle", [0.01, 0.015])
def test_a_bump_that_the_reference_alone_sees_errs_by_noise(angle):
    found = [trial(seed, angle) for seed in range(7300, 7300 + SESSIONS)]
    assert any(rests == (7, 6) for _, rests in found), "the target did not rest on anywhere"
    spread = np.sqrt(np.mean(np.square([errors for errors, _ in found])))
    assert spread - 1.0 < 4.0 / np.sqrt(2.0 * PARAMETERS * SESSIONS), spread
