"""A calibration over temperature, as plain data that reports show and files keep."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tumble.foundation.provenance import Provenance, provenance_now
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL, LARGEST_WIDENING, Collection, Row, Tabular, Verdict
from tumble.foundation.units import CALIBRATED_UNITS, CalibratedTriad

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tumble.calibration.document import Calibration

LEVEL = 0.01
"""Chance at which angles that are constant are taken to change."""
CLEAR = 4.0
"""Sigmas beyond which hysteresis is no chance; a bias that wanders looks like a little of it."""
BESIDE = 12
"""Elements of [M row by row, b], before the terms of temperature."""


@dataclass(frozen=True, slots=True)
class PolynomialScore:
    """Error with which a polynomial predicts plateaus that were left out."""

    order: int
    left: float
    """Root mean square of the prediction error, unit of the parameter."""
    chosen: bool


@dataclass(frozen=True, slots=True)
class Constancy:
    """Test of angles that the result holds constant over all plateaus."""

    group: str
    """`non-orthogonality` or `mounting`."""
    change: FloatArray
    """(3,) change over the whole range by a straight line, deg."""
    sigma: FloatArray
    """(3,) its 1-sigma."""
    chi_square: float
    """Chi-square of the values about their mean."""
    degrees_of_freedom: int
    probability: float
    """Chance of a larger one, were the angles constant."""

    @property
    def changes(self) -> bool:
        """Returns whether the angles change beyond chance."""
        return self.probability < LEVEL

    @property
    def described(self) -> str:
        """Describes by how much the angles change: `changes by 0.012 ± 0.001 deg over the range`."""
        most = int(np.abs(self.change).argmax())
        return f"changes by {abs(self.change[most]):.2g} ± {self.sigma[most]:.1g} deg over the range"


@dataclass(frozen=True, slots=True)
class Prediction:
    """Error with which a plateau is predicted from all others."""

    temperature: float
    """degC."""
    outside: bool
    """Indicates whether the plateau is at an end of the range, so that it is predicted beyond the others."""
    bias: FloatArray
    """(3,) measured minus predicted, unit of the triad."""
    bias_sigma: FloatArray
    scale: FloatArray
    """(3,) the same of the scale factors, relative."""
    scale_sigma: FloatArray


@dataclass(frozen=True, slots=True)
class TriadOverTemperature:
    """`y = (1 + s(t)) M u + b + d(t)` of one triad, t from the reference in K."""

    triad: CalibratedTriad
    reference: float
    """degC at which M and b hold."""
    range: tuple[float, float]
    """Lowest and highest plateau, degC."""
    M: FloatArray
    """(3, 3) sensor from case."""
    b: FloatArray
    """(3,) unit of the triad."""
    bias: FloatArray
    """(p, 3) coefficients of d, a row for each power: unit/K, unit/K^2, unit/K^3."""
    scale: FloatArray
    """(q, 3) coefficients of s: 1/K, 1/K^2, 1/K^3."""
    covariance: FloatArray
    """(12 + 3 p + 3 q, same) of [M row by row, b, bias row by row, scale row by row], without the inherited
    part; zero for a coefficient that was not fitted, NaN for what no plateau showed."""
    hysteresis: FloatArray
    """(3,) bias while warming minus that while cooling, unit of the triad; NaN where only one was seen."""
    hysteresis_sigma: FloatArray
    chi_square: float
    degrees_of_freedom: int
    widening: Mapping[str, float]
    """Factors on the sigmas of `bias`, `scale`, `non-orthogonality` and `mounting`, where sessions scatter by
    more than their own sigmas."""
    orders: Mapping[str, tuple[PolynomialScore, ...]]
    """Scores by parameter: `bias x`, `scale z`."""
    constancies: tuple[Constancy, ...]
    predictions: tuple[Prediction, ...]
    temperatures: FloatArray
    """(n,) of the plateaus, degC."""
    legs: FloatArray
    """(n,) 1 after warming, -1 after cooling, 0 where unknown."""
    measured: FloatArray
    """(n, 12) [M row by row, b] of each plateau."""
    measured_sigma: FloatArray
    """(n, 12) 1-sigma."""

    @property
    def unit(self) -> str:
        """Unit of the readings."""
        return CALIBRATED_UNITS[self.triad]

    def difference(self, temperature: FloatArray) -> FloatArray:
        """Returns t (n,), K, of temperatures (n,), degC: held at the edge beyond the range."""
        return np.asarray(np.clip(temperature, *self.range) - self.reference)

    def at(self, temperature: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Scale and bias (n, 6) at temperatures (n,), degC, and their 1-sigma.

        Scale is that of the sensing axes over the scale at the reference; half of a hysteresis that is beyond
        chance is in the sigma of the bias.
        """
        t = self.difference(temperature)
        change = np.column_stack([_polynomial(self.scale, t), self.b + _polynomial(self.bias, t)])
        variance = np.array([self._variances(each) for each in t])
        variance[:, 3:] += (0.5 * self.clear_hysteresis) ** 2
        return change, np.sqrt(variance)

    @property
    def clear_hysteresis(self) -> FloatArray:
        """(3,) hysteresis of the bias where it is beyond chance, else zero."""
        with np.errstate(invalid="ignore"):
            is_clear = np.abs(self.hysteresis) > CLEAR * self.hysteresis_sigma
        return np.where(is_clear, np.nan_to_num(self.hysteresis), 0.0)

    def _variances(self, t: float) -> FloatArray:
        """(6,) variances of the change of scale from the reference, and of the bias, t K from it."""
        return self._propagated(self._jacobian(t))

    def _propagated(self, jacobian: FloatArray) -> FloatArray:
        known = np.nan_to_num(self.covariance)
        return np.asarray(np.einsum("ij,jk,ik->i", jacobian, known, jacobian))

    def _jacobian(self, t: float) -> FloatArray:
        """(6, 12 + 3 p + 3 q) derivatives of change of scale and of bias by what `covariance` is of."""
        p, q = len(self.bias), len(self.scale)
        jacobian = np.zeros((6, len(self.covariance)))
        for axis in range(3):
            jacobian[3 + axis, 9 + axis] = 1.0
            for k in range(p):
                jacobian[3 + axis, BESIDE + 3 * k + axis] = t ** (k + 1)
            for k in range(q):
                jacobian[axis, BESIDE + 3 * p + 3 * k + axis] = t ** (k + 1)
        return jacobian

    @property
    def change(self) -> tuple[FloatArray, FloatArray]:
        """(6,) scale and bias at the hottest plateau minus those at the coldest, and the 1-sigma of it."""
        ends, _ = self.at(np.array(self.range))
        low, high = self.difference(np.array(self.range))
        return ends[1] - ends[0], np.sqrt(self._propagated(self._jacobian(high) - self._jacobian(low)))

    @property
    def swing(self) -> tuple[FloatArray, FloatArray]:
        """(3,) largest less smallest bias, and scale, within the range."""
        grid = np.linspace(*self.range, 200)
        found, _ = self.at(grid)
        return np.ptp(found[:, 3:], axis=0), np.ptp(found[:, :3], axis=0)

    def parameters(self) -> Iterator[Row]:
        """Returns every coefficient, and b, with its 95 % interval."""
        sigma = np.sqrt(np.diag(self.covariance))
        rows = [("bias", self.unit, self.b, sigma[9:12])]
        place = BESIDE
        for name, powers, unit in (("bias", self.bias, self.unit), ("scale", self.scale, "1")):
            for k, values in enumerate(powers, start=1):
                kelvin = "K" if k == 1 else f"K^{k}"
                rows.append((f"{name} per {kelvin}", f"{unit}/{kelvin}", values, sigma[place : place + 3]))
                place += 3
        rows.append(("hysteresis of bias", self.unit, self.hysteresis, self.hysteresis_sigma))
        for name, unit, values, sigmas in rows:
            for axis, value, spread in zip("xyz", values, sigmas, strict=True):
                yield {
                    "triad": self.triad,
                    "parameter": f"{name} {axis}",
                    "value": float(value),
                    "sigma": float(spread),
                    "low": float(value - INTERVAL * spread),
                    "high": float(value + INTERVAL * spread),
                    "unit": unit,
                }

    @property
    def name(self) -> str:
        """Name of the triad."""
        return self.triad


def _polynomial(rows: FloatArray, t: FloatArray) -> FloatArray:
    """(n, 3) polynomial without a constant term, at t (n,)."""
    powers = t[:, None] ** np.arange(1, len(rows) + 1)
    return np.asarray(powers @ rows.reshape(-1, 3))


@dataclass(frozen=True, slots=True)
class PlateauFacts:
    """One of the calibrations."""

    name: str
    file: str
    hash: str
    """sha256 of its content."""
    temperature: float
    """Mean, degC."""
    spread: float
    """Highest less lowest temperature within the session, K; 0 where it was given by hand."""


@dataclass(frozen=True, slots=True)
class PlateausResult(Tabular, Collection[TriadOverTemperature]):
    """Calibration of one unit over temperature."""

    name: str
    serial: str
    reference: float
    """degC at which M and b hold."""
    range: tuple[float, float]
    """Lowest and highest plateau, degC; beyond, the value at the edge is held."""
    plateaus: tuple[PlateauFacts, ...]
    triads: tuple[TriadOverTemperature, ...]
    base: Mapping[str, Any] = field(repr=False)
    """Contents of the calibration file that all sessions share."""
    warnings: tuple[str, ...] = ()
    options: Mapping[str, object] = field(default_factory=dict)
    software: str = ""
    provenance: Provenance = field(default_factory=provenance_now, compare=False)
    """Time and author of the result."""

    def _items(self) -> Sequence[TriadOverTemperature]:
        return self.triads

    @property
    def verdict(self) -> Verdict:
        """`measured`, `partly measured` without hysteresis, or `model not met`.

        The model is not met where sessions scatter by ten times their sigmas or more.
        """
        if any(max(triad.widening.values()) > LARGEST_WIDENING for triad in self.triads):
            return "model not met"
        both = all(np.isfinite(triad.hysteresis).all() for triad in self.triads)
        return "measured" if both else "partly measured"

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter of each triad."""
        for triad in self.triads:
            yield from triad.parameters()

    @property
    def calibration(self) -> Calibration:
        """Calibration file of the unit."""
        from tumble.tools.plateaus.calibration import calibration_of

        return calibration_of(self)

    def plot(self, figure: str | None = None) -> Figure:
        """Draws the figures of the page with matplotlib: all below one another, or the one of that name.

        Raises `TumbleError` where matplotlib is not installed, or the page has no such figure.
        """
        from tumble.tools.plateaus.report.page import PLATEAUS_REPORT

        return PLATEAUS_REPORT.plot(self, figure)

    def save(self, folder: Path | str) -> dict[str, Path]:
        """Writes what `tumble plateaus` writes; returns the path of each file by what it is.

        Raises `OutputError` where a file cannot be written; what stood there before is untouched.
        """
        from tumble.calibration.unit_files import write_unit_files
        from tumble.tools.plateaus.report.page import PLATEAUS_REPORT

        return write_unit_files(self, PLATEAUS_REPORT.write, folder, "plateaus")

    def __repr__(self) -> str:
        low, high = self.range
        lines = [
            f"{row['triad']} {row['parameter']} = {row['value']:.4g} +- {row['sigma']:.2g}"
            for row in self.rows()
        ]
        return "\n  ".join([f"PlateausResult({self.name}: {low:.1f} to {high:.1f} degC)", *lines])
