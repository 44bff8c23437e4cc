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


def drifting(recording, drift):
    """The recording of a unit whose accelerometer biases change evenly by a vector, m/s^2."""
    (chunk,) = recording.chunks()
    course = np.linspace(-0.5, 0.5, len(chunk.time))[:, None]
    return Recording.from_arrays(
        recording.name, chunk.time, chunk.accelerometer + course * drift, chunk.gyroscope
    )


def trial(seed, angle, drift=0.0):
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
    logs[1] = drifting(logs[1], drift * random.normal(size=3))
    result = tumble.turntable(*logs, clock="shared")
    target = result.targets[0]
    reported = any("biases drifted over the session" in each for each in target.warnings)
    assert reported <= (drift > 0.0), target.warnings
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


@pytest.mark.parametrize("angle", [0.0, 0.05])
def test_a_drift_of_biases_is_within_sigma_bumped_or_not(angle):
    """At 4 mm/s^2 over the session bias instability, or widening, took the drift for random: rms of 1.3."""
    found = np.array([trial(seed, angle, 4e-3)[0] for seed in range(7400, 7400 + SESSIONS)])
    spread = np.sqrt(np.mean(np.square(found)))
    # A fit of three more unknowns has fewer degrees of freedom to be wide by.
    assert spread - 1.0 < 4.0 / np.sqrt(2.0 * PARAMETERS * SESSIONS), spread
