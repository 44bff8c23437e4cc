"""Calibrations of a unit at several temperatures, whose truth is known."""

from __future__ import annotations

import numpy as np

from compare_units import UNITS, covariance, truth
from tumble.calibration.document import Calibration

REFERENCE = 25.0
UP_AND_BACK = (-20.0, 0.0, 25.0, 50.0, 70.0, 25.0)


class PlateauUnit:
    """A unit whose bias and scale are polynomials of temperature, with one covariance for all sessions."""

    def __init__(self, generator, *, bias=(), scale=(), turn=None, triads=UNITS):
        self.generator = generator
        self.truth = truth(generator)
        self.bias, self.scale, self.turn, self.triads = bias, scale, turn, triads
        self.covariance = {triad: covariance(generator, 1e-4) for triad, _, _ in triads}

    def at(self, triad, temperature):
        """(12,) [M row by row, b] at a temperature."""
        t = temperature - REFERENCE
        values = self.truth[triad].copy()
        values[:9] *= 1.0 + sum(value * t**k for k, value in enumerate(self.scale, start=1))
        values[9:] += sum(value * t**k for k, value in enumerate(self.bias, start=1))
        if self.turn is not None:
            rotation = np.eye(3) + t * np.array([[0, -self.turn, 0], [self.turn, 0, 0], [0, 0, 0]])
            values[:9] = (values[:9].reshape(3, 3) @ rotation).ravel()
        return values

    def calibration(self, temperature, *, shift=0.0, **changes):
        """One session; `shift` is added to its biases, `changes` are keys of the file."""
        content = {
            "name": "unit",
            "serial": "7",
            "method": {"procedure": "turntable"},
            "temperature": {"low": temperature - 0.5, "mean": temperature, "high": temperature + 0.5},
            **changes,
        }
        for triad, unit, _ in self.triads:
            spread = self.covariance[triad]
            values = self.generator.multivariate_normal(self.at(triad, temperature), spread)
            content[triad] = {
                "unit": unit,
                "M": values[:9].reshape(3, 3),
                "b": values[9:] + shift,
                "covariance": spread,
                "estimated": ("bias", "matrix"),
            }
        return Calibration.model_validate(content)

    def sessions(self, temperatures=UP_AND_BACK):
        """One session at each of the temperatures."""
        return [self.calibration(temperature) for temperature in temperatures]
