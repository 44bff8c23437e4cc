"""Result of the calibration of a magnetometer, as plain data that reports show and calibration files keep."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tumble.foundation.magnetic import LoadUnit
from tumble.foundation.provenance import NO_LOG, LogFacts, Provenance, provenance_now
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL, Parameter, Row, Tabular, TriadResult, Verdict
from tumble.foundation.words import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tumble.calibration.document import Calibration

WORTH_ADDING = 0.9
"""Share of the largest sigma that must be left at most, for one more orientation to be advised."""


@dataclass(frozen=True, slots=True)
class FieldPoint:
    """A rest, or a stretch of a log that was turned, and what the calibration makes of it."""

    start: float
    end: float
    """s of the clock of the log."""
    field: FloatArray
    """(3,) uT, calibrated, case frame."""
    before: float
    """|y| raw minus the strength of the field, uT."""
    after: float
    """|u| calibrated minus the strength, uT."""
    sigma: float
    """1-sigma of the latter from noise, uT."""
    dip: float
    """Dip minus that of all, deg; NaN where nothing shows up."""
    dip_sigma: float
    """1-sigma of it from noise, deg."""
    weight: float
    """Weight in the robust loss; 1 where nothing stands out, 0 where it is left out."""
    chance: float
    """Chance that noise makes any of all disagree as much."""
    disturbed: bool
    """Indicates whether it disagrees with the others beyond chance."""
    direction: int
    """Points of one number meet the field from one direction."""
    leverage: float
    influence: float
    """Largest change of a parameter without it, in units of its sigma."""
    held_out: float
    """|u| minus the strength by a fit without this direction, uT; NaN where the others do not carry one."""


@dataclass(frozen=True, slots=True)
class NextField:
    """The orientation that would lower the largest sigma most."""

    field: FloatArray
    """(3,) unit vector, case frame: the direction that the field points to there."""
    up: FloatArray | None
    """(3,) unit vector, case frame, up there; None where nothing shows up."""
    parameter: str
    """The one that is known least."""
    before: float
    """Its sigma as it is, as a share of scale, or of the field."""
    after: float
    """The largest sigma with that orientation added."""


@dataclass(frozen=True, slots=True)
class MagnetometerResult(Tabular):
    """A magnetometer, calibrated by the Earth's field: y = M u + b + c I."""

    name: str
    source: str
    serial: str
    magnetometer: TriadResult
    """In the case frame of the accelerometer; where nothing shows up, in that of its own axes."""
    current: tuple[Parameter, ...]
    """Response to current or throttle of each axis; empty where it was not asked for."""
    current_unit: LoadUnit
    strength: Parameter
    """`field strength`, uT: as known, or as the sensor's mean scale has it."""
    strength_source: str
    """`free`, `given`, `WMM-2025 at 48.1, 11.6 deg on 2026-11-26`."""
    dip: Parameter
    """deg, positive where the field points down."""
    expected_dip: float | None
    """deg, by the World Magnetic Model; None where the place is not known."""
    points: tuple[FieldPoint, ...]
    """Rests, or stretches of a log that was turned."""
    next_field: NextField | None
    coverage: float
    """Share of all directions that the field was met from, within 30 deg."""
    at_rest: bool
    """True where rests were used, False where it was turned."""
    scatter: float | None = None
    """Scatter of |u| of a sample, uT, where it was turned."""
    correlated: float | None = None
    """Samples that are worth one independent reading, where it was turned."""
    log: LogFacts = NO_LOG
    provenance: Provenance = field(default_factory=provenance_now)
    start_hash: str = ""
    """sha256 of the calibration that it was started from; empty if there was none."""
    start: Mapping[str, object] = field(default_factory=dict, repr=False)
    """Content of that calibration; empty if there was none."""
    options: dict[str, object] = field(default_factory=dict)
    """Method options as the calibration file keeps them."""
    warnings: tuple[str, ...] = ()
    software: str = ""

    @property
    def triads(self) -> tuple[TriadResult, ...]:
        """The one that was calibrated."""
        return (self.magnetometer,)

    @property
    def aligned(self) -> bool:
        """True where the mounting in the frame of the accelerometer was found."""
        return self.dip.observable

    @property
    def disturbed(self) -> tuple[FieldPoint, ...]:
        """Points that disagree with the others beyond chance."""
        return tuple(point for point in self.points if point.disturbed)

    @property
    def directions(self) -> int:
        """Directions that differ from which the field was met."""
        return len({point.direction for point in self.points if not point.disturbed})

    @property
    def norm_before(self) -> float:
        """Root mean square of |y| raw minus the strength, uT."""
        return _rms([point.before for point in self._used])

    @property
    def norm_after(self) -> float:
        """Root mean square of |u| calibrated minus the strength, uT."""
        return _rms([point.after for point in self._used])

    @property
    def norm_held_out(self) -> float:
        """The same by fits that had not seen that direction; NaN where there are too few."""
        return _rms([point.held_out for point in self._used])

    @property
    def dip_scatter(self) -> float:
        """Root mean square of the dip minus that of all, deg; NaN where nothing shows up."""
        return _rms([point.dip for point in self._used])

    @property
    def _used(self) -> list[FieldPoint]:
        return [point for point in self.points if not point.disturbed]

    @property
    def verdict(self) -> Verdict:
        """`calibrated` with its mounting, `partly calibrated` without, `model not met` by large residuals."""
        if not self.magnetometer.model_met:
            return "model not met"
        return "calibrated" if self.aligned else "partly calibrated"

    @property
    def advised(self) -> NextField | None:
        """Orientation to add; None where none would help by enough to be worth it."""
        found = self.next_field
        return found if found is not None and found.after < WORTH_ADDING * found.before else None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All that was estimated: those of the triad, the response to current, and the field."""
        return (*self.magnetometer.parameters, *self.current, self.strength, self.dip)

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter."""
        for parameter in self.parameters:
            yield {"sensor": "magnetometer"} | parameter.row()

    @property
    def calibration(self) -> Calibration:
        """Calibration file of the unit, on top of the one the procedure was started from."""
        from tumble.procedures.magnetometer.calibration import calibration_of

        return calibration_of(self)

    def plot(self, figure: str | None = None) -> Figure:
        """Draws the figures of the page with matplotlib: all below one another, or the one of that name.

        Raises `TumbleError` where matplotlib is not installed, or the page has no such figure.
        """
        from tumble.procedures.magnetometer.report.page import MAGNETOMETER_REPORT

        return MAGNETOMETER_REPORT.plot(self, figure)

    def save(self, folder: Path | str) -> dict[str, Path]:
        """Writes what `tumble magnetometer` writes; returns the path of each file by what it is.

        Raises `OutputError` where a file cannot be written; what stood there before is untouched.
        """
        from tumble.calibration.unit_files import write_unit_files
        from tumble.procedures.magnetometer.report.page import MAGNETOMETER_REPORT

        return write_unit_files(self, MAGNETOMETER_REPORT.write, folder, "magnetometer")

    def save_page(self, folder: Path | str) -> Path:
        """Writes the page alone; returns its path. Raises `OutputError` where it cannot be written."""
        from tumble.calibration.unit_files import prepare_unit_files
        from tumble.procedures.magnetometer.report.page import MAGNETOMETER_REPORT

        page, _ = prepare_unit_files(folder, self.name, "magnetometer")
        MAGNETOMETER_REPORT.write(self, page)
        return page

    def __repr__(self) -> str:
        shown = [
            f"{each.name} = {each.value:.6g} +- {each.sigma:.2g} {each.unit}"
            for each in self.parameters
            if each.observable
        ]
        return "\n  ".join([f"MagnetometerResult({self.name}: {self.verdict})", *shown])

    def _repr_html_(self) -> str:
        from tumble.procedures.magnetometer.report.notebook import magnetometer_html

        return printable(magnetometer_html(self))


def estimated(name: str, unit: str, value: float, sigma: float) -> Parameter:
    """Returns an estimate with its 95 % interval."""
    return Parameter(name, unit, value, sigma, value - INTERVAL * sigma, value + INTERVAL * sigma)


def unknown(name: str, unit: str, reason: str) -> Parameter:
    """Returns a parameter that the log does not show."""
    return Parameter(name, unit, math.nan, math.inf, -math.inf, math.inf, False, reason)


def _rms(values: list[float]) -> float:
    known = np.array([value for value in values if math.isfinite(value)])
    return float(np.sqrt(np.mean(known**2))) if len(known) else math.nan
