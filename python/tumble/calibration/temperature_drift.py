"""Temperature drift of bias and scale of one triad, as stored in a calibration file.

`y = (1 + s(t)) M u + b + d(t)`, axis by axis, with `t = T - reference` and T held within `range`; `s` and
`d` are polynomials without a constant term, so that M and b are those at the reference
(docs/theory/thermal.md, eq. 1 and 2).
"""

from __future__ import annotations

from typing import Annotated, TypeAlias

import numpy as np
from pydantic import Field, model_validator

from tumble.foundation.documents import ArrayField, Document, Vector, VectorWithGaps
from tumble.foundation.recording import FloatArray

HIGHEST_ORDER = 3
"""Highest power of temperature, as in the core."""
ABSOLUTE_ZERO = -273.15
"""degC."""

_NEGLIGIBLE = 1e-12
"""Share of the largest term at the edge of the range."""

Range: TypeAlias = Annotated[FloatArray, ArrayField((2,))]
Coefficients: TypeAlias = Annotated[tuple[Vector, ...], Field(max_length=HIGHEST_ORDER, strict=False)]
Sigmas: TypeAlias = Annotated[tuple[VectorWithGaps, ...], Field(max_length=HIGHEST_ORDER, strict=False)]
CovarianceRows: TypeAlias = Annotated[
    tuple[Annotated[tuple[float | None, ...], Field(strict=False)], ...], Field(strict=False)
]


class TemperatureDrift(Document):
    """Polynomials in T less `reference`, degC: a row of three axes for each power, the first power first."""

    reference: float
    """Temperature at which M and b hold, degC."""
    range: Range
    """Lowest and highest temperature that was seen, degC; beyond, the value at the edge is held."""
    bias: Coefficients = ()
    """d: unit/K, unit/K^2, unit/K^3."""
    scale: Coefficients = ()
    """s: 1/K, 1/K^2, 1/K^3."""
    bias_sigma: Sigmas | None = None
    """1-sigma of `bias`; null where the data did not show it."""
    scale_sigma: Sigmas | None = None
    """1-sigma of `scale`; null where the data did not show it."""
    covariance: CovarianceRows | None = None
    """Covariance of [M row by row, b, `bias` row by row, `scale` row by row], without the inherited part,
    where M and b were found together with the drift; null for what the data did not show."""
    hysteresis: VectorWithGaps | None = None
    """Bias while warming minus that while cooling at one temperature, where it differs most, unit of the
    triad; null where either was not seen."""
    hysteresis_sigma: VectorWithGaps | None = None
    """1-sigma of it."""

    @model_validator(mode="after")
    def _makes_sense(self) -> TemperatureDrift:
        low, high = self.range
        if not ABSOLUTE_ZERO < low < high:
            raise ValueError(f"range needs to be [lowest, highest] degC, found [{low:g}, {high:g}]")
        if not low <= self.reference <= high:
            raise ValueError(f"reference {self.reference:g} degC is not within range [{low:g}, {high:g}]")
        for name, values, sigmas in (
            ("bias_sigma", self.bias, self.bias_sigma),
            ("scale_sigma", self.scale, self.scale_sigma),
        ):
            if sigmas is not None and len(sigmas) != len(values):
                raise ValueError(f"{name} needs as many rows as {name.removesuffix('_sigma')}, {len(values)}")
        if self.covariance is not None:
            size = 12 + 3 * (len(self.bias) + len(self.scale))
            if {len(self.covariance), *map(len, self.covariance)} != {size}:
                raise ValueError(f"covariance needs {size}x{size} numbers or null: M, b and the powers")
        smallest = 1.0 + self._extremes(self.scale).min()
        if not smallest > 0.0:
            raise ValueError(f"scale falls to {smallest:.3g} of itself within range; check its powers")
        return self

    @property
    def largest_bias(self) -> float:
        """Largest change of the bias of an axis within the range, in the unit of the triad."""
        return float(np.abs(self._extremes(self.bias)).max())

    @property
    def largest_scale(self) -> float:
        """Largest relative change of the scale of an axis within the range."""
        return float(np.abs(self._extremes(self.scale)).max())

    def at_reference(self, readings: FloatArray, b: FloatArray, temperature: FloatArray) -> FloatArray:
        """Returns what readings (n, 3) of a triad of bias b, at (n,) degC, would be at the reference.

        A temperature that is NaN counts as the reference.
        """
        from tumble import _core  # reading and writing files works without the native module

        return _core.at_reference(
            readings,
            b,
            temperature,
            {
                "reference": self.reference,
                "range": self.range.tolist(),
                "bias": [power.tolist() for power in self.bias],
                "scale": [power.tolist() for power in self.scale],
            },
        )

    def _extremes(self, coefficients: tuple[FloatArray, ...]) -> FloatArray:
        """Extremes of the axes within the range: at its edges, or where a slope is zero."""
        low, high = self.range - self.reference
        widest = max(-low, high)
        powers = widest ** np.arange(HIGHEST_ORDER + 1)
        extremes = [0.0]
        for axis in np.array([np.zeros(3), *coefficients]).T:
            terms = axis * powers[: len(axis)]
            # Terms that change nothing would make roots of any size.
            terms = np.polynomial.polynomial.polytrim(terms, _NEGLIGIBLE * np.abs(terms).max())
            polynomial = np.polynomial.Polynomial(terms)
            roots = polynomial.deriv().roots()
            level = roots.real[np.isreal(roots) & (low < roots.real * widest) & (roots.real * widest < high)]
            extremes += polynomial(np.array([low / widest, high / widest, *level])).tolist()
        return np.array(extremes)
