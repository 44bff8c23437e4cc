"""Drawn calibrations for files of other programs."""

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.firmware.rotations import rotation as numbered
from tumble.tools.exchange.registry import TARGETS

SAMPLES = 50
SETTINGS = {
    "accelerometer-id": "1310988",
    "gyroscope-id": "2490378",
    "magnetometer-id": "396809",
    "rate": "200",
    "identity": "81985529216486895",
}
READABLE = [word for word, target in TARGETS.items() if target.read is not None]


def needed(word):
    """The settings without which a format is not written."""
    return {each.name: SETTINGS[each.name] for each in TARGETS[word].settings if each.default is None}


def rotation(generator, angle):
    axis = generator.normal(size=3)
    a = angle * axis / np.linalg.norm(axis)
    skew = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + np.sin(angle) / angle * skew + (1 - np.cos(angle)) / angle**2 * skew @ skew


def drift(generator, unit):
    return {
        "reference": 30.0,
        "range": np.array([-10.0, 60.0]),
        "bias": tuple(unit * generator.normal(size=3) / 20.0**k for k in (1, 2, 3)),
    }


def calibration(
    seed, *, parts=("non-orthogonality", "mounting", "scale", "response"), over_temperature=False
):
    """A drawn IMU of these errors, biases always."""
    print(f"seed {seed}")
    generator = np.random.default_rng(seed)
    content = {"name": "unit"}
    for triad, unit, size in (("accelerometer", "m/s^2", 0.3), ("gyroscope", "rad/s", 0.03)):
        scale = np.diag(1.0 + 0.03 * generator.normal(size=3) * ("scale" in parts))
        lower = np.eye(3) + np.tril(0.02 * generator.normal(size=(3, 3)), -1) * ("non-orthogonality" in parts)
        lower /= np.linalg.norm(lower, axis=1)[:, np.newaxis]
        turned = rotation(generator, 0.05) if "mounting" in parts else np.eye(3)
        section = {"unit": unit, "M": scale @ lower @ turned, "b": size * generator.normal(size=3)}
        section |= {"noise_density": np.full(3, 2e-3), "random_walk": np.full(3, 1e-4)}
        if over_temperature:
            section["temperature_drift"] = drift(generator, 0.1 * size)
        content[triad] = section
    if "response" in parts:
        content["gyroscope"]["g_sensitivity"] = 1e-4 * generator.normal(size=(3, 3))
    return Calibration.model_validate(content)


def magnetometer(seed, number=0, tilt=0.0, **extra):
    """A drawn magnetometer, turned by a rotation of that number and a tilt, rad."""
    print(f"seed {seed}")
    generator = np.random.default_rng(seed)
    soft = np.eye(3) + 0.1 * generator.normal(size=(3, 3))
    correction = numbered(number) @ (0.5 * (soft + soft.T))
    if tilt:
        correction = rotation(generator, tilt) @ correction
    section = {"M": np.linalg.inv(correction), "b": 40.0 * generator.normal(size=3), **extra}
    return Calibration.model_validate({"name": "compass", "magnetometer": section})


def with_current(seed, current_unit, number=0):
    return magnetometer(seed, number, current=np.array([0.4, -1.1, 0.2]), current_unit=current_unit)


def samples(seed):
    generator = np.random.default_rng(1000 + seed)
    return 9.8 * generator.normal(size=(SAMPLES, 3)), generator.normal(size=(SAMPLES, 3))
