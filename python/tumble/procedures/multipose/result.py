"""Result of a multi-pose session, as plain data that reports show and calibration files keep."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tumble.foundation.provenance import NO_LOG, UNKNOWN, LogFacts, Provenance
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Rest, Row, Tabular, Trace, TriadResult, Verdict
from tumble.foundation.words import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tumble.calibration.document import Calibration
    from tumble.procedures.magnetometer.result import MagnetometerResult

WORTH_ADDING = 0.9
"""Share of the largest sigma that must be left at most, for one more orientation or turn to be advised."""


@dataclass(frozen=True, slots=True)
class PoseFit:
    """A rest, and what the calibration of the accelerometer makes of it."""

    up: FloatArray
    """(3,) unit vector, case frame."""
    before: float
    """|y| - g of raw readings, m/s^2."""
    after: float
    """|u| - g calibrated, m/s^2."""
    sigma: float
    """1-sigma of the latter from noise, m/s^2."""
    held_out: float
    """|u| - g by a fit without any pose in this direction, m/s^2; NaN where the others do not carry one."""
    weight: float
    """Weight in the robust loss; 1 where nothing stands out."""
    direction: int
    """Poses of one number show one direction."""
    leverage: float
    """Share of its own residual that the fit takes up: 1 where no other pose shows what this one does."""
    influence: float
    """Largest change of a parameter without this pose, in units of its sigma."""


@dataclass(frozen=True, slots=True)
class TurnFit:
    """A turn between two rests: gravity as the gyroscope turned it against gravity as it was found."""

    before: int
    after: int
    """Indices of the rests."""
    angle_before: float
    """Angle between the two, rad, with no more than the bias at rest known."""
    angle: float
    """The same, calibrated."""


@dataclass(frozen=True, slots=True)
class NextOrientation:
    """The orientation that would lower the largest sigma of the accelerometer most."""

    up: FloatArray
    """(3,) unit vector, case frame: hold the unit so that this direction points up."""
    parameter: str
    """The one that is known least."""
    before: float
    """Its sigma as it is, as a share of scale, or of g."""
    after: float
    """The largest sigma with that orientation added."""


@dataclass(frozen=True, slots=True)
class NextTurn:
    """The half turn that would lower the largest sigma of the gyroscope most."""

    axis: FloatArray
    """(3,) unit vector, case frame: turn about it."""
    up: FloatArray
    """(3,) unit vector, case frame, across the axis: what is to point up at the start."""
    parameter: str
    """Parameter that is least certain."""
    before: float
    """Its sigma as it is: of scale, of a bias of 0.1 rad/s, of a g-sensitivity of 0.01 rad/s per m/s^2."""
    after: float
    """The largest sigma with that turn added."""


@dataclass(frozen=True, slots=True)
class NominalScale:
    """Scale by which counts were converted."""

    accelerometer: float
    """Counts per m/s^2."""
    gyroscope: float | None
    """Counts per rad/s; None where the turns did not show it."""


@dataclass(frozen=True, slots=True)
class TimeBase:
    """Clock by which turns were integrated: an error of it is one of the gyroscope's scale."""

    rate: float | None
    """Hz; None where the log has stamps."""
    source: str
    """`given`, `stated in the log`, `stamps of the log`."""
    sigma: float
    """1-sigma of its pace, relative, within the sigmas of the gyroscope's scale; 0 where nobody states it."""


@dataclass(frozen=True, slots=True)
class FerrarisTriad:
    """A sensor by the formulas of Ferraris: y = K R u + b, in the unit of its readings."""

    K: FloatArray
    """(3, 3), diagonal."""
    R: FloatArray
    """(3, 3), rows are the sensing axes in the case."""
    b: FloatArray
    """(3,)."""
    values: FloatArray
    """(12,) the parameters of the sensor's `TriadResult`, in their order and units; empty without one."""
    differences: FloatArray
    """(12,) less those of the `TriadResult`, in sigmas of it; empty without one."""


@dataclass(frozen=True, slots=True)
class Faces:
    """Additional results of a session on six faces, in the case frame of the box."""

    tilt: float
    """Tilt of a face about either axis, rad, 1-sigma, as all faces together show it."""
    sections: tuple[tuple[str, int, int], ...]
    """Label, first sample, and the one after the last, of the samples that hold numbers."""
    accelerometer: FerrarisTriad
    gyroscope: FerrarisTriad | None
    """Result of the gyroscope; None where a full turn about one of the axes is missing."""
    K_ga: FloatArray
    """(3, 3) response of the gyroscope to specific force by the same formulas."""


@dataclass(frozen=True, slots=True)
class MultiposeResult(Tabular):
    """One unit, calibrated from rests in many orientations and the turns between them."""

    name: str
    source: str
    serial: str
    accelerometer: TriadResult
    """Its case frame is that of its own axes: x along the first, y in the plane of the first two."""
    gyroscope: TriadResult | None
    """Result in the case frame of the accelerometer: its mounting is that against the accelerometer."""
    gyroscope_reason: str
    """Reason why the gyroscope was not calibrated; empty if it was."""
    poses: tuple[PoseFit, ...]
    """One for each rest."""
    turns: tuple[TurnFit, ...]
    next_orientation: NextOrientation | None
    next_turn: NextTurn | None
    rests: tuple[Rest, ...]
    trace: Trace
    gravity: float
    """m/s^2."""
    gravity_source: str
    gravity_sigma: float | None
    """m/s^2; None where nobody states it, and scale is relative to gravity."""
    tolerance: float
    """Factor on the usual limits of stillness with which rests were found."""
    time_base: TimeBase | None = None
    """Clock that the gyroscope's scale is relative to; None without a gyroscope."""
    implausible_scale: float | None = None
    """Scale of the gyroscope, alike on all axes, where no sensor has that one: the sample rate is wrong."""
    faces: Faces | None = None
    """Results by the formulas of Ferraris, where the unit lay on six faces."""
    nominal_scale: NominalScale | None = None
    """Scale, where readings are counts of an unstated scale."""
    temperature: tuple[float, float, float] | None = None
    """Lowest, mean and highest, degC."""
    log: LogFacts = NO_LOG
    provenance: Provenance = UNKNOWN
    start_hash: str = ""
    """sha256 of the calibration that it was started from; empty if there was none."""
    start: Mapping[str, object] = field(default_factory=dict, repr=False)
    """Content of that calibration; empty if there was none."""
    options: dict[str, object] = field(default_factory=dict)
    """Method options as the calibration file keeps them."""
    warnings: tuple[str, ...] = ()
    software: str = ""
    magnetometer: MagnetometerResult | None = None
    """Result of the magnetometer at the same rests, where it was asked for."""
    magnetometer_reason: str = ""
    """Reason why the magnetometer was not calibrated although it was asked for; else empty."""

    @property
    def triads(self) -> tuple[TriadResult, ...]:
        """Those that were calibrated."""
        return tuple(triad for triad in (self.accelerometer, self.gyroscope) if triad is not None)

    @property
    def directions(self) -> int:
        """Orientations that differ."""
        return len({pose.direction for pose in self.poses})

    @property
    def left_out(self) -> tuple[Rest, ...]:
        """Stretches in which the unit was still, or held still, that are not used."""
        return tuple(rest for rest in self.rests if not rest.used)

    @property
    def trembling(self) -> int:
        """Rests that are used although the unit trembled."""
        return sum(bool(rest.remark) for rest in self.rests if rest.used)

    @property
    def norm_before(self) -> float:
        """Root mean square of |y| - g of raw readings, m/s^2."""
        return _rms([pose.before for pose in self.poses])

    @property
    def norm_after(self) -> float:
        """Root mean square of |u| - g calibrated, m/s^2."""
        return _rms([pose.after for pose in self.poses])

    @property
    def norm_held_out(self) -> float:
        """The same on poses that the fit had not seen; NaN where there are too few to keep any from it."""
        return _rms([pose.held_out for pose in self.poses])

    @property
    def angle_before(self) -> float:
        """Root mean square angle of gravity after a turn, rad, only the bias known; NaN without turns."""
        return _rms([turn.angle_before for turn in self.turns])

    @property
    def angle_after(self) -> float:
        """The same, calibrated."""
        return _rms([turn.angle for turn in self.turns])

    @property
    def verdict(self) -> Verdict:
        """`calibrated` where both triads are, `model not met` where residuals or time are wrong."""
        if self.implausible_scale or not all(triad.model_met for triad in self.triads):
            return "model not met"
        if self.magnetometer is not None and self.magnetometer.verdict == "model not met":
            return "model not met"
        whole = self.gyroscope is not None and not self.magnetometer_reason
        return "calibrated" if whole else "partly calibrated"

    @property
    def advised_orientation(self) -> NextOrientation | None:
        """Orientation to add; None where none would help by enough to be worth it."""
        return self.next_orientation if _is_worth_it(self.next_orientation) else None

    @property
    def advised_turn(self) -> NextTurn | None:
        """Turn to add; None where none would help by enough to be worth it."""
        return self.next_turn if _is_worth_it(self.next_turn) else None

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter of each triad."""
        for triad in self.triads:
            for parameter in triad.parameters:
                yield {"sensor": triad.triad} | parameter.row()
        if self.magnetometer is not None:
            yield from self.magnetometer.rows()

    @property
    def calibration(self) -> Calibration:
        """Calibration file of the unit, on top of the one the procedure was started from."""
        from tumble.procedures.multipose.calibration import calibration_of

        return calibration_of(self)

    def plot(self, figure: str | None = None) -> Figure:
        """Draws the figures of the page with matplotlib: all below one another, or the one of that name.

        Raises `TumbleError` where matplotlib is not installed, or the page has no such figure.
        """
        from tumble.procedures.multipose.report.page import MULTIPOSE_REPORT

        return MULTIPOSE_REPORT.plot(self, figure)

    def save(self, folder: Path | str) -> dict[str, Path]:
        """Writes what `tumble multipose` writes; returns the path of each file by what it is.

        Raises `OutputError` where a file cannot be written; what stood there before is untouched.
        """
        from tumble.calibration.unit_files import write_unit_files
        from tumble.procedures.multipose.report.page import MULTIPOSE_REPORT

        paths = write_unit_files(self, MULTIPOSE_REPORT.write, folder, "multipose")
        if self.magnetometer is not None:
            paths["magnetometer"] = self.magnetometer.save_page(folder)
        return paths

    def __repr__(self) -> str:
        shown = [
            f"{triad.triad} {each.name} = {each.value:.6g} +- {each.sigma:.2g} {each.unit}"
            for triad in self.triads
            for each in triad.parameters
            if each.observable
        ]
        return "\n  ".join([f"MultiposeResult({self.name}: {self.verdict})", *shown])

    def _repr_html_(self) -> str:
        from tumble.procedures.multipose.report.notebook import multipose_html

        return printable(multipose_html(self))


def _rms(values: list[float]) -> float:
    known = np.array([value for value in values if math.isfinite(value)])
    return float(np.sqrt(np.mean(known**2))) if len(known) else math.nan


def _is_worth_it(found: NextOrientation | NextTurn | None) -> bool:
    return found is not None and found.after < WORTH_ADDING * found.before
