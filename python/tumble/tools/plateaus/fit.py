"""One M and b, and polynomials of temperature, through all plateaus of a triad (docs/theory/plateaus.md).

`M(t) = (1 + s(t)) M`, `b(t) = b + d(t) + leg h / 2`, axis by axis, by generalised least squares with the
full covariance of each session.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.tools.plateaus.observation import BIAS, ELEMENTS, MATRIX, Observation

_ROUNDS = 4
"""Steps of Gauss and Newton: the model is linear but for products of small numbers."""
_SINGULAR = 1e-11
"""Share of the largest singular value below which the plateaus do not show a direction."""


@dataclass(frozen=True, slots=True)
class Terms:
    """Powers of temperature by axis, and how temperature is scaled."""

    bias: tuple[int, int, int]
    """Highest power in the bias of each axis."""
    scale: tuple[int, int, int]
    hysteresis: bool
    """Indicates whether warming and cooling have a bias each."""
    reference: float
    """degC at which M and b hold."""
    width: float
    """K by which temperature is divided while fitting."""

    def x(self, temperature: float) -> float:
        """Returns the scaled temperature."""
        return (temperature - self.reference) / self.width

    def places(self) -> Iterator[tuple[str, int, int]]:
        """Yields part, axis and power of every term beyond M and b, in order."""
        for part, orders in (("bias", self.bias), ("scale", self.scale)):
            for axis, order in enumerate(orders):
                for power in range(1, order + 1):
                    yield part, axis, power
        if self.hysteresis:
            for axis in range(3):
                yield "hysteresis", axis, 0

    def unit(self) -> FloatArray:
        """Factors from scaled terms to those in K."""
        powers = [self.width**-power for _, _, power in self.places()]
        return np.concatenate([np.ones(ELEMENTS), powers])


@dataclass(frozen=True, slots=True)
class Fit:
    """Solution of the fit, in K."""

    terms: Terms
    solution: FloatArray
    """(12 + terms,)"""
    covariance: FloatArray
    """Its covariance; zero for what no session showed."""
    chi_square: float
    degrees_of_freedom: int

    def at(self, temperature: float, leg: float = 0.0) -> tuple[FloatArray, FloatArray]:
        """(12,) [M row by row, b] at a temperature, degC, and its derivatives (12, 12 + terms)."""
        scaled = self.solution / self.terms.unit()
        values, derivatives = model(self.terms, scaled, temperature, leg)
        return values, derivatives / self.terms.unit()


def model(
    terms: Terms, solution: FloatArray, temperature: float, leg: float
) -> tuple[FloatArray, FloatArray]:
    """Value (12,) and derivatives (12, 12 + terms) of [M, b] at a temperature, eq. 1."""
    x = terms.x(temperature)
    matrix = solution[MATRIX].reshape(3, 3)
    gain = np.ones(3)
    bias = solution[BIAS].copy()
    derivatives = np.zeros((ELEMENTS, len(solution)))
    derivatives[BIAS, BIAS] = np.eye(3)
    for place, (part, axis, power) in enumerate(terms.places(), start=ELEMENTS):
        if part == "scale":
            gain[axis] += solution[place] * x**power
            derivatives[3 * axis : 3 * axis + 3, place] = x**power * matrix[axis]
        else:
            weight = 0.5 * leg if part == "hysteresis" else x**power
            bias[axis] += solution[place] * weight
            derivatives[BIAS.start + axis, place] = weight
    derivatives[MATRIX, MATRIX] = np.diag(np.repeat(gain, 3))
    return np.concatenate([(gain[:, None] * matrix).ravel(), bias]), derivatives


def fit(observations: Sequence[Observation], terms: Terms) -> Fit:
    """Fits the terms to all observations, eq. 3."""
    whitenings = [each.whitening() for each in observations]
    nearest = min(observations, key=lambda each: abs(each.temperature - terms.reference))
    solution = np.concatenate([nearest.values, np.zeros(sum(1 for _ in terms.places()))])
    inverse = np.zeros((len(solution), 0))
    residuals = np.zeros(0)
    rank = 0
    for _ in range(_ROUNDS):
        rows, left = [], []
        for whitening, each in zip(whitenings, observations, strict=True):
            values, derivatives = model(terms, solution, each.temperature, each.leg)
            rows.append(whitening @ derivatives)
            left.append(whitening @ (each.values - values))
        design, residuals = np.concatenate(rows), np.concatenate(left)
        inverse, rank = _pseudo_inverse(design)
        solution = solution + inverse @ residuals
    left = [
        whitening @ (each.values - model(terms, solution, each.temperature, each.leg)[0])
        for whitening, each in zip(whitenings, observations, strict=True)
    ]
    residuals = np.concatenate(left)
    unit = terms.unit()
    return Fit(
        terms=terms,
        solution=solution * unit,
        covariance=(inverse @ inverse.T) * np.outer(unit, unit),
        chi_square=float(residuals @ residuals),
        degrees_of_freedom=len(residuals) - rank,
    )


def _pseudo_inverse(design: FloatArray) -> tuple[FloatArray, int]:
    """Returns the pseudo-inverse and the rank, with columns brought to one length first."""
    lengths = np.linalg.norm(design, axis=0)
    lengths[lengths == 0.0] = 1.0
    left, sizes, right = np.linalg.svd(design / lengths, full_matrices=False)
    own = sizes > _SINGULAR * sizes[0]
    inverse = (right[own].T / sizes[own]) @ left[:, own].T
    return inverse / lengths[:, None], int(own.sum())
