"""Noise of a sensor, as plain data that reports show and files keep."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tumble.foundation.noise_terms import BIAS_INSTABILITY, RANDOM_WALK, WHITE
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import (
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

ASKED_FOR = (WHITE, BIAS_INSTABILITY, RANDOM_WALK)
"""Terms that a record is made for; the others are reported where they show."""
LARGEST_MISFIT = 0.25
"""Share of the deviations that they scatter by about the sum of the terms, above which these are no model."""
STEP, RAMP_OF_LEVEL, KNOCK = "step", "ramp", "knock"
"""The core's words for disturbances."""


@dataclass(frozen=True, slots=True)
class DeviationCurve:
    """Deviations over averaging times; unit of the channel, 95 % intervals."""

    tau: FloatArray
    """(n,) s, a quarter octave apart."""
    deviation: FloatArray
    low: FloatArray
    high: FloatArray
    freedom: FloatArray
    """Equivalent degrees of freedom."""


@dataclass(frozen=True, slots=True)
class ChannelNoise(Tabular):
    """Noise of one channel."""

    name: str
    """`accelerometer x`."""
    triad: Triad
    allan: DeviationCurve
    modified: DeviationCurve
    hadamard: DeviationCurve
    terms: tuple[Parameter, ...]
    """Q, N, B, K and R by the core's words; where one is not identifiable, `high` is a bound on it."""
    model: FloatArray
    """(5,) Q, N, B, K and R that fit best, units of the terms; NaN where nothing could be fitted."""
    chi_square: float
    degrees_of_freedom: int = 0
    misfit: float = 0.0
    """Scatter of the deviations about the sum of the terms beyond chance, as a share of them."""
    filter: float = 0.0
    """Time constant, s, of the sensor's own filter, where the shortest averages show one; else 0."""
    is_rounded: bool = False
    """Indicates whether the steps of the readings, or a dead band, are coarser than the noise (rounding.md,
    eq. 1), or the end of the range cuts it off (noise.md, eq. 34c): the deviations are those of the readings,
    and may lie below those of the sensor."""

    @property
    def unit(self) -> str:
        """Unit of the deviations."""
        return UNITS[self.triad]

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter."""
        return (parameter.row() for parameter in self.terms)

    def term(self, name: str) -> Parameter:
        """Returns one term by its word; raises `KeyError` where there is none of that name."""
        for each in self.terms:
            if each.name == name:
                return each
        raise KeyError(f"{name}: is none of {', '.join(each.name for each in self.terms)}")

    @property
    def density_at_one_second(self) -> float:
        """White noise that alone would give the Allan deviation at 1 s, or at the time nearest to it."""
        curve = self.allan
        known = curve.deviation > 0.0
        if not known.any():
            return float("nan")
        tau = float(np.clip(1.0, curve.tau[known][0], curve.tau[known][-1]))
        logarithm = np.interp(np.log(tau), np.log(curve.tau[known]), np.log(curve.deviation[known]))
        return float(np.exp(logarithm) * np.sqrt(tau))


@dataclass(frozen=True, slots=True)
class Disturbance:
    """A step, ramp or knock of one channel, which its noise does not explain."""

    channel: str
    """`accelerometer x`."""
    unit: str
    kind: str
    log: int
    """Place of the log among those that were read."""
    start: float
    """First and last instant that it may have touched, s of the clock of the log."""
    end: float
    size: float
    """Change of level, or largest excursion from it, unit of the channel."""
    sigma: float
    """1-sigma of a change of level; of a knock, scatter of a sample."""
    left_out: bool
    """Indicates whether the deviations exclude it; a channel with too many disturbances keeps them as
    noise."""


@dataclass(frozen=True, slots=True)
class StillPart:
    """Part of the logs that was used."""

    logs: int
    samples: int
    """All that were read."""
    used: int
    """Samples that stood still."""
    duration: float
    """s that the used ones last."""
    interval: float
    """s between samples, by the clock of the logs."""
    stretches: int
    """Parts without a gap, each by itself."""
    longest: float
    """s, longest stretch."""
    gaps: int
    """Gaps in the time of the logs."""


@dataclass(frozen=True, slots=True)
class NoiseResult(Addition, Tabular, Collection[ChannelNoise]):
    """Noise of all channels of one sensor."""

    still: StillPart
    channels: tuple[ChannelNoise, ...]
    disturbances: tuple[Disturbance, ...] = ()
    """Steps, ramps and knocks, in order of time."""
    temperature: tuple[float, float, float] | None = None
    """Lowest, mean and highest, degC."""

    def _items(self) -> Sequence[ChannelNoise]:
        return self.channels

    @property
    def triads(self) -> tuple[Triad, ...]:
        """Those that were recorded."""
        return tuple(dict.fromkeys(channel.triad for channel in self.channels))

    @property
    def rate(self) -> float:
        """Hz, by the clock of the logs."""
        return 1.0 / self.still.interval

    @property
    def verdict(self) -> Verdict:
        """`measured` where N, B and K were found in known units, `model not met` far from the curve."""
        if any(channel.misfit > LARGEST_MISFIT for channel in self.channels):
            return "model not met"
        asked = (channel.term(name) for channel in self.channels for name in ASKED_FOR)
        is_shown = self.states_si_units and all(term.observable for term in asked)
        return "measured" if is_shown else "partly measured"

    def term(self, triad: Triad, name: str) -> FloatArray:
        """(3,) a term of x, y and z; NaN where the record does not show it."""
        found = [channel.term(name) for channel in self.channels if channel.triad == triad]
        return np.array([each.value if each.observable else np.nan for each in found])

    def estimates(self, triad: Triad, name: str) -> AxisEstimates:
        """Returns values and sigmas of a term, (3,) each: `N`, `B` and the core's other words."""
        found = [channel.term(name) for channel in self.channels if channel.triad == triad]
        return axis_estimates(found)

    def rows(self) -> Iterator[Row]:
        """Returns a line for each term of each channel."""
        for channel in self.channels:
            for term in channel.terms:
                yield {"channel": channel.name} | term.row()

    @property
    def calibration(self) -> Calibration:
        """Calibration file of the unit, on top of the one the procedure was started from."""
        from tumble.procedures.noise.calibration import calibration_of

        return calibration_of(self)

    def plot(self, figure: str | None = None) -> Figure:
        """Draws the figures of the page with matplotlib: all below one another, or the one of that name.

        Raises `TumbleError` where matplotlib is not installed, or the page has no such figure.
        """
        from tumble.procedures.noise.report.page import NOISE_REPORT

        return NOISE_REPORT.plot(self, figure)

    def save(self, folder: Path | str) -> dict[str, Path]:
        """Writes what `tumble noise` writes; returns the path of each file by what it is.

        Raises `OutputError` where a file cannot be written; what stood there before is untouched.
        """
        from tumble.procedures.noise.command_files import save

        return save(self, folder)

    def __repr__(self) -> str:
        lines = [
            f"{channel.name} {term.name} = {term.value:.4g}, {term.low:.4g} to {term.high:.4g} {term.unit}"
            for channel in self.channels
            for term in channel.terms
            if term.observable
        ]
        return "\n  ".join([f"NoiseResult({self.name}: {self.still.duration:.6g} s)", *lines])

    def _repr_html_(self) -> str:
        from tumble.procedures.noise.report.notebook import noise_html

        return printable(noise_html(self))
