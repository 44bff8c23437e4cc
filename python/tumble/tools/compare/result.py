"""Differences of calibrations, as plain data that reports show."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tumble.foundation.provenance import Provenance, provenance_now
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Collection, Row, Tabular, Verdict
from tumble.foundation.units import CalibratedTriad
from tumble.foundation.words import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVEL = 0.05
"""Chance at which two calibrations of one truth are taken to differ."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One parameter in both calibrations; differences are the second minus the first."""

    name: str
    """`accelerometer bias x`."""
    unit: str
    """`m/s^2`, `rad/s`, `uT`, `1`, `deg`, `rad/s per m/s^2`, `uT per A`."""
    first: float
    """NaN where that calibration does not contain it."""
    second: float
    value: float
    """Second less first; of a mounting the turn from one to the other."""
    sigma: float
    """1-sigma of the difference; NaN where either is not observable, 0 where both were stated without any."""
    reason: str = ""
    """Reason why it is not compared; empty where it is."""

    @property
    def group(self) -> str:
        """`accelerometer bias` of `accelerometer bias x`."""
        return self.name.rpartition(" ")[0]

    @property
    def compared(self) -> bool:
        """Returns whether it counts in the test."""
        return not self.reason

    @property
    def sigmas(self) -> float:
        """Difference over its sigma, eq. 6; NaN where it is not compared."""
        return self.value / self.sigma if self.compared else nan

    def row(self) -> Row:
        """Returns it as columns of a table."""
        return {
            "parameter": self.name,
            "first": self.first,
            "second": self.second,
            "difference": self.value,
            "sigma": self.sigma,
            "sigmas": self.sigmas,
            "unit": self.unit,
            "reason": self.reason,
        }


@dataclass(frozen=True, slots=True)
class JointTest:
    """Test of whether some parameters together differ by more than they are uncertain."""

    name: str
    """Name of the parameters: `accelerometer bias`, `all of M and b`."""
    statistic: float
    """Chi-square, eq. 7; of what temperature does the largest difference in sigmas, squared."""
    degrees_of_freedom: int
    """Degrees of freedom of the statistic; for temperature drift, the number of differences compared."""
    probability: float
    """Chance of a larger one, were the truth the same."""


@dataclass(frozen=True, slots=True)
class MotionError:
    """Error of one calibration if the other is the truth, over all of a stated motion."""

    triad: CalibratedTriad
    unit: str
    motion: str
    """Motion in words: `rests in all orientations at 9.807 m/s^2`."""
    rms: float
    """Root mean square of the length of the error, eq. 9 and 10."""
    expected: float
    """Error expected from the uncertainties alone, eq. 11; NaN where one is not known."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two calibrations."""

    first: str
    second: str
    differences: tuple[Difference, ...]
    groups: tuple[JointTest, ...]
    """Tests by kind of parameter."""
    joint: JointTest | None
    """All that could be compared; None where that is nothing."""
    temperature: JointTest | None
    """Test of temperature drift, where both state it; else None."""
    motion: tuple[MotionError, ...]
    notes: tuple[str, ...] = ()
    """Notes on the validity of the comparison."""

    @property
    def name(self) -> str:
        """Name of both."""
        return f"{self.first} and {self.second}"

    @property
    def identical(self) -> bool:
        """Returns whether all numbers in both calibrations are equal to the last digit."""
        return bool(self.differences) and all(each.first == each.second for each in self.differences)

    @property
    def probability(self) -> float:
        """Chance of being as far apart or farther, were the truth the same, eq. 8; NaN where unknown."""
        tests = [test.probability for test in (self.joint, self.temperature) if test is not None]
        return min(1.0, len(tests) * min(tests)) if tests else nan

    @property
    def verdict(self) -> Verdict:
        """`same` within what is known, `differ`, or `cannot be told`."""
        if self.identical:
            return "same"
        if not isfinite(self.probability):
            return "cannot be told"
        return "differ" if self.probability < LEVEL else "same"

    @property
    def farthest(self) -> Difference | None:
        """The parameter that differs by most sigmas."""
        compared = [each for each in self.differences if each.compared]
        return max(compared, key=lambda each: abs(each.sigmas), default=None)


@dataclass(frozen=True, slots=True)
class History:
    """One parameter over the dates of several calibrations of a unit, and a straight line through it."""

    name: str
    unit: str
    years: FloatArray
    """(n,) since the first of all calibrations."""
    values: FloatArray
    """(n,)"""
    sigmas: FloatArray
    """(n,) 1-sigma; zero where values were stated without any."""
    rate: float
    """Slope of the line, unit a year, eq. 12."""
    rate_sigma: float
    """Its 1-sigma, widened where the values scatter about the line by more than theirs."""
    middle: float
    """Year at which the line has the value `level`, and errors of slope and level are independent."""
    level: float
    level_sigma: float
    widening: float
    """Factor by which both sigmas were widened; 1 where the values do not exceed theirs."""
    reach: float
    """Sigmas to either end of a 95 % interval: more where the sigma was found from few values."""

    def line(self, years: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n,) value of the line at those years, and its 1-sigma."""
        from_middle = years - self.middle
        return self.level + self.rate * from_middle, np.hypot(self.level_sigma, self.rate_sigma * from_middle)

    @property
    def drifts(self) -> bool:
        """Returns whether a 95 % interval of the slope excludes zero."""
        return abs(self.rate) > self.reach * self.rate_sigma

    def row(self) -> Row:
        """Returns the line as columns of a table."""
        return {
            "parameter": self.name,
            "rate": self.rate,
            "sigma": self.rate_sigma,
            "unit": f"{self.unit} per year",
            "calibrations": len(self.years),
            "widening": self.widening,
        }


@dataclass(frozen=True, slots=True)
class CompareResult(Tabular, Collection[Pair]):
    """The first calibration against each of the others, and all of them over time."""

    names: tuple[str, ...]
    """Names of all calibrations, each once."""
    files: tuple[str, ...]
    serials: tuple[str, ...]
    dates: tuple[str, ...]
    """UTC, ISO 8601; empty where a file does not state it."""
    pairs: tuple[Pair, ...]
    history: tuple[History, ...]
    """Empty unless three calibrations or more are of one unit and of different dates."""
    notes: tuple[str, ...]
    """Notes that apply to all pairs."""
    warnings: tuple[str, ...] = ()
    """Calibrations that are known to be wrong."""
    options: dict[str, object] = field(default_factory=dict)
    software: str = ""
    provenance: Provenance = field(default_factory=provenance_now, compare=False)
    """Time and author of the result."""

    def _items(self) -> Sequence[Pair]:
        return self.pairs

    @property
    def verdict(self) -> Verdict:
        """`differ` if one does, else `cannot be told` if of one nothing shows it, else `same`."""
        found = {pair.verdict for pair in self.pairs}
        worst: tuple[Verdict, ...] = ("differ", "cannot be told")
        return next((verdict for verdict in worst if verdict in found), "same")

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter of each pair."""
        for pair in self.pairs:
            for each in pair.differences:
                yield {"calibrations": pair.name} | each.row()

    def plot(self, figure: str | None = None) -> Figure:
        """Draws the figures of the page with matplotlib: all below one another, or the one of that name.

        Raises `TumbleError` where matplotlib is not installed, or the page has no such figure.
        """
        from tumble.tools.compare.report.page import COMPARE_REPORT

        return COMPARE_REPORT.plot(self, figure)

    def save(self, folder: Path | str) -> dict[str, Path]:
        """Write what `tumble compare` writes, a page; give its path by what it is.

        Raises `OutputError` where it cannot be written; what stood there before is untouched.
        """
        from tumble.foundation.file_names import COMPARE_PAGE
        from tumble.foundation.files import PAGE, check_output, prepare_folder
        from tumble.tools.compare.report.page import COMPARE_REPORT

        page = prepare_folder(folder) / COMPARE_PAGE
        check_output(page, PAGE)
        COMPARE_REPORT.write(self, page)
        return {"report": page}

    def __repr__(self) -> str:
        from tumble.tools.compare.report.text import verdict_sentence

        return "\n  ".join(["CompareResult", *map(verdict_sentence, self.pairs)])

    def _repr_html_(self) -> str:
        from tumble.tools.compare.report.notebook import compare_html

        return printable(compare_html(self))
