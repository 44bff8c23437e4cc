"""Bias and scale over temperature, as plain data that reports show and files keep."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.foundation.results import (
    INTERVAL,
    NOT_SHOWN,
    Addition,
    AxisEstimates,
    Collection,
    Parameter,
    Row,
    Tabular,
    Verdict,
    axis_estimates,
)
from tumble.foundation.units import UNITS, Triad
from tumble.foundation.words import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tumble.calibration.document import Calibration

LARGEST_HYSTERESIS = 0.25
"""Half of it over the drift within the range, from which on one curve for both legs is not the model."""
_GRID = 200
"""Temperatures at which a curve is looked at for its largest and smallest value."""


@dataclass(frozen=True, slots=True)
class OrderScore:
    """A set of terms that was fitted, and its weight in the uncertainty of the coefficients."""

    bias: int
    """Highest power of temperature in the bias."""
    scale: int
    """The same in the scale factor."""
    weight: float
    """Akaike weight: those of all sets add up to one."""
    chosen: bool
    """Indicates the set whose coefficients are stated."""


@dataclass(frozen=True, slots=True)
class AxisDrift(Tabular):
    """Temperature drift of one axis: `y = (1 + s(t)) M u + b + d(t)`, t from the reference in K."""

    name: str
    """`accelerometer x`."""
    triad: Triad
    reference: float
    """degC."""
    range: tuple[float, float]
    """degC."""
    bias: FloatArray
    """(p,) coefficients of t, t^2 ... of d, unit/K^k; none where the bias shows no drift."""
    scale: FloatArray
    """(q,) the same of s, 1/K^k."""
    covariance: FloatArray
    """Covariance of [bias, scale, hysteresis], the last where it is observable, one for each row of
    `loop`."""
    hysteresis: Parameter
    """Largest difference, with its sign, of the bias while warming minus that while cooling at one
    temperature, unit of the axis."""
    mean_hysteresis: Parameter
    """The same, its mean over temperature."""
    loop: FloatArray
    """(k, 3) temperature, degC, difference and its 1-sigma; one row where the difference is a constant."""
    has_hysteresis: bool
    """Returns whether the difference is beyond chance."""
    slope: Parameter
    """First power of the bias, unit/K, whether or not it is among the terms."""
    scale_change: Parameter
    """Change of the scale factor, 1/K, whether or not it is among the terms."""
    constants: FloatArray
    """(poses,) what the axis reads at the reference in each pose, unit of the axis."""
    noise_density: float
    """White noise N of what the fit leaves, unit / sqrt(Hz)."""
    bias_instability: float
    """Flicker noise B of what the fit leaves, unit of the axis; zero where a random walk is likelier."""
    random_walk: float
    """Random walk K of what the fit leaves, unit / sqrt(s); zero where flicker noise is likelier."""
    scores: tuple[OrderScore, ...]
    change: FloatArray
    """(blocks,) change of each block from the reference, minus that of scale, unit of the axis."""

    @property
    def unit(self) -> str:
        """Unit of the axis."""
        return UNITS[self.triad]

    def difference(self, temperature: FloatArray) -> FloatArray:
        """Returns t (n,), K, of temperatures (n,), degC: held at the edge beyond the range."""
        return np.asarray(np.clip(temperature, *self.range) - self.reference)  # thermal.md, eq. 2

    def bias_at(self, temperature: FloatArray) -> FloatArray:
        """Returns the change of the bias (n,), unit of the axis, at temperatures (n,), degC."""
        return np.asarray(
            _powers(self.difference(temperature), len(self.bias)) @ self.bias
        )  # thermal.md, eq. 1

    def bias_sigma_at(self, temperature: FloatArray) -> FloatArray:
        """Its 1-sigma (n,): of the coefficients, and half the largest hysteresis where it is clear."""
        count = len(self.bias)
        powers = _powers(self.difference(temperature), count)
        variance = np.einsum("nk,kl,nl->n", powers, self.covariance[:count, :count], powers)
        return np.asarray(np.sqrt(variance + (0.5 * self.clear_hysteresis) ** 2))  # thermal.md, eq. 15

    @property
    def clear_hysteresis(self) -> float:
        """Largest hysteresis where it is beyond chance, else zero; unit of the axis."""
        return self.hysteresis.value if self.has_hysteresis else 0.0

    @property
    def swing(self) -> Parameter:
        """Largest less smallest bias within the range, unit of the axis; zero where no drift was taken up."""
        low, high = self.range
        if not len(self.bias):
            return estimated("drift", self.unit, 0.0, self.slope.sigma * (high - low))
        grid = np.linspace(low, high, _GRID)
        curve = self.bias_at(grid)
        ends = grid[[int(curve.argmax()), int(curve.argmin())]]
        count = len(self.bias)
        apart = -np.diff(_powers(self.difference(ends), count), axis=0)[0]
        sigma = np.sqrt(apart @ self.covariance[:count, :count] @ apart)
        return estimated("drift", self.unit, float(np.ptp(curve)), float(sigma))

    @property
    def is_one_curve(self) -> bool:
        """Returns whether one curve describes both warming and cooling."""
        return 0.5 * abs(self.clear_hysteresis) <= LARGEST_HYSTERESIS * self.swing.value

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter."""
        return (parameter.row() for parameter in self.parameters())

    def parameters(self) -> Iterator[Parameter]:
        """Returns every coefficient, the change of scale and the hysteresis, with intervals."""
        sigmas = np.sqrt(np.diag(self.covariance))
        if not len(self.bias):
            yield self.slope
        for k, value in enumerate(self.bias, start=1):
            kelvin = "K" if k == 1 else f"K^{k}"
            yield estimated(f"bias per {kelvin}", f"{self.unit}/{kelvin}", value, sigmas[k - 1])
        yield self.scale_change
        yield self.hysteresis
        yield self.mean_hysteresis


def _powers(t: FloatArray, count: int) -> FloatArray:
    return t[:, None] ** np.arange(1, count + 1)


def estimated(name: str, unit: str, value: float, sigma: float) -> Parameter:
    """Creates a parameter of an estimate and its 1-sigma."""
    value, sigma = float(value), float(sigma)
    return Parameter(name, unit, value, sigma, value - INTERVAL * sigma, value + INTERVAL * sigma)


def unknown(name: str, unit: str, reason: str) -> Parameter:
    """Creates a parameter of what the data do not show."""
    return Parameter(name, unit, math.nan, math.inf, math.nan, math.nan, False, reason)


@dataclass(frozen=True, slots=True)
class ThermalBlocks:
    """Data of the fit: means over successive stretches at rest."""

    time: FloatArray
    """(n, 2) first and last sample, s of the clock of its log."""
    session: FloatArray
    """(n,) which log."""
    pose: FloatArray
    """(n,) in which pose the unit was held, over all logs."""
    temperature: FloatArray
    """(n,) of the sensor, degC: smoothed, and moved by the lag where there is one."""
    leg: FloatArray
    """(n,) 1 where the unit warmed, -1 where it cooled, 0 where it did neither; between where it turned."""
    still: float
    """s at rest."""
    moved: float
    """s that were left out because the unit moved."""

    def __len__(self) -> int:
        return len(self.time)

    @property
    def poses(self) -> int:
        """Poses held."""
        return len(np.unique(self.pose))


@dataclass(frozen=True, slots=True)
class ThermalResult(Addition, Tabular, Collection[AxisDrift]):
    """Temperature drift of each axis of a unit."""

    reference: float
    """Temperature at which M and b hold, degC."""
    range: tuple[float, float]
    """Lowest and highest at rest, degC; beyond, the value at the edge is held."""
    step: float
    """Resolution of the thermometer, K."""
    lag: Parameter
    """Time constant by which the thermometer is behind the sensor, s."""
    axes: tuple[AxisDrift, ...]
    blocks: ThermalBlocks

    def _items(self) -> Sequence[AxisDrift]:
        return self.axes

    @property
    def triads(self) -> tuple[Triad, ...]:
        """Those that were recorded."""
        return tuple(dict.fromkeys(axis.triad for axis in self.axes))

    def of_triad(self, triad: Triad) -> tuple[AxisDrift, ...]:
        """Returns the three axes of a triad."""
        return tuple(axis for axis in self.axes if axis.triad == triad)

    @property
    def verdict(self) -> Verdict:
        """`measured`; `partly measured` without both legs or a unit, `model not met` if legs differ much."""
        if not all(axis.is_one_curve for axis in self.axes):
            return "model not met"
        both = all(axis.hysteresis.observable for axis in self.axes)
        return "measured" if both and self.states_si_units else "partly measured"

    def estimates(self, triad: Triad, name: str) -> AxisEstimates:
        """Returns values and sigmas of a parameter of each axis, (3,) each, such as `hysteresis`.

        An axis whose drift has no such term counts as not observable.
        """
        found = [
            next(
                (each for each in axis.parameters() if each.name == name), unknown(name, axis.unit, NOT_SHOWN)
            )
            for axis in self.of_triad(triad)
        ]
        return axis_estimates(found)

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter of each axis."""
        for axis in self.axes:
            for parameter in axis.parameters():
                yield {"channel": axis.name} | parameter.row()

    @property
    def calibration(self) -> Calibration:
        """Calibration file of the unit, on top of the one the procedure was started from."""
        from tumble.procedures.thermal.calibration import calibration_of

        return calibration_of(self)

    def plot(self, figure: str | None = None) -> Figure:
        """Draws the figures of the page with matplotlib: all below one another, or the one of that name.

        Raises `TumbleError` where matplotlib is not installed, or the page has no such figure.
        """
        from tumble.procedures.thermal.report.page import THERMAL_REPORT

        return THERMAL_REPORT.plot(self, figure)

    def save(self, folder: Path | str) -> dict[str, Path]:
        """Writes what `tumble thermal` writes; returns the path of each file by what it is.

        Raises `OutputError` where a file cannot be written; what stood there before is untouched.
        """
        from tumble.calibration.unit_files import write_unit_files
        from tumble.procedures.thermal.report.page import THERMAL_REPORT

        return write_unit_files(self, THERMAL_REPORT.write, folder, "thermal")

    def __repr__(self) -> str:
        shown = [
            f"{axis.name} {each.name} = {each.value:.4g} +- {each.sigma:.2g} {each.unit}"
            for axis in self.axes
            for each in axis.parameters()
            if each.observable
        ]
        low, high = self.range
        return "\n  ".join([f"ThermalResult({self.name}: {low:.1f} to {high:.1f} degC)", *shown])

    def _repr_html_(self) -> str:
        from tumble.procedures.thermal.report.notebook import thermal_html

        return printable(thermal_html(self))
