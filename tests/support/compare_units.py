"""Calibrations of units whose truth is known, drawn or found, to be held against each other."""

from __future__ import annotations

import numpy as np

from exchange_units import rotation
from tumble.calibration.document import Calibration

UNITS = (("accelerometer", "m/s^2", 0.3), ("gyroscope", "rad/s", 0.03))


def truth(generator):
    """M and b of both triads of one unit."""
    found = {}
    for triad, _, size in UNITS:
        lower = np.eye(3) + np.tril(0.02 * generator.normal(size=(3, 3)), -1)
        matrix = np.diag(1.0 + 0.02 * generator.normal(size=3)) @ lower @ rotation(generator, 0.05)
        found[triad] = np.concatenate([matrix.ravel(), size * generator.normal(size=3)])
    return found


def covariance(generator, size=1e-3):
    """A full covariance of twelve numbers, each with a sigma of that size or less."""
    factor = generator.normal(size=(12, 12)) / np.sqrt(12.0)
    return size**2 * (0.2 * np.eye(12) + factor @ factor.T)


def drawn(generator, unit, size=1e-3, *, serial="7", date="", **changes):
    """A calibration of that unit, with errors drawn from its covariance; `changes` are added to triads."""
    content = {"name": "unit", "serial": serial, "date": date}
    for triad, unit_of, _ in UNITS:
        spread = covariance(generator, size)
        found = generator.multivariate_normal(unit[triad] + changes.get(triad, 0.0), spread)
        content[triad] = {
            "unit": unit_of,
            "M": found[:9].reshape(3, 3),
            "b": found[9:],
            "covariance": spread,
            "estimated": ("bias", "matrix"),
        }
    return Calibration.model_validate(content)
