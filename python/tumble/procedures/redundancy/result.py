"""Actions and results of the redundancy monitor, as plain data that reports show and files keep."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.log_reading import LogReading
from tumble.foundation.log_time import LogTime
from tumble.foundation.provenance import Provenance, provenance_now
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import (
    INTERVAL,
    NOT_SHOWN,
    AxisEstimates,
    Collection,
    Parameter,
    Row,
    Tabular,
    Verdict,
    estimates_of,
    only,
)
from tumble.foundation.units import UNITS
from tumble.foundation.words import printable
from tumble.procedures.redundancy.known_faults import OF_THE_SET, KnownFault, known_faults

if TYPE_CHECKING:
    import matplotlib.figure

    from tumble.calibration.document import Calibration

Sensor = Literal["accelerometer", "gyroscope"]
FitModel = Literal["offset", "gain", "affine", "affine and lever arm"]
Figure = float | int | str | bool | tuple[str, ...]
NONE_FIT = "none fit"
"""Reason of `selected` where nobody is the source any more."""


@dataclass(frozen=True, slots=True)
class RedundancyEvent:
    """One thing the monitor did or found; docs/how-to/redundancy.md lists them all with their figures."""

    time: float
    """s of the recordings' common clock."""
    unit: str
    """Whom it concerns."""
    event: str
    """Such as `rest began`, `evaluated`, `triggered`, `adopted`, `selected`."""
    figures: Mapping[str, Figure]
    """Its figures and reasons in words, SI units; several units by their names."""


@dataclass(frozen=True, slots=True)
class SecondaryError(Tabular):
    """Error of one sensor of a secondary against the primary: `y_secondary = M y_primary + b`, both raw.

    Frames: M leads from the primary's case frame to the axes of the secondary, mounting included.
    """

    unit: str
    sensor: Sensor
    matrix: FloatArray
    """(3, 3) M."""
    bias: FloatArray
    """(3,) b, m/s^2 or rad/s."""
    matrix_sigma: FloatArray
    """(3, 3) 1-sigma; infinite where the motion did not show it."""
    bias_sigma: FloatArray
    """(3,) 1-sigma; infinite where it was not shown."""
    lever_arm: FloatArray | None
    """(3,) m, from primary to secondary, primary's case frame; `None` for gyroscopes, and where unknown."""
    lever_arm_sigma: FloatArray | None
    """(3,) 1-sigma, 0 where it was given; infinite where the motion did not show it."""
    fit_model: FitModel
    directions: int
    """Directions of motion, 0 to 3, along which M was found; along the others it is unchanged."""
    residual: float
    """Root mean square a channel on held-out pairs, m/s^2 or rad/s; NaN if never measured."""
    residual_before: float
    """The same with the error stored before."""
    pairs: int
    sequence: int
    """Counts the calibrations of this sensor; 0 for the one given from outside."""
    followed: FloatArray
    """(3,) how far they have followed the primary without proof, m/s^2 or rad/s, axes of the secondary."""
    adopted: float | None
    """s of the recordings' clock; `None` for one loaded from storage."""

    @property
    def name(self) -> str:
        """`imu2 gyroscope`."""
        return f"{self.unit} {self.sensor}"

    @property
    def shown_bias(self) -> FloatArray:
        """(3,) bias, NaN on axes of which none was found, as those that the unit or the primary lacks."""
        return np.where(np.isfinite(self.bias_sigma), self.bias, np.nan)

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter."""
        return (parameter.row() for parameter in self.parameters())

    def estimates(self, name: str) -> AxisEstimates:
        """Returns values and sigmas of `bias`, `lever arm` (3,), or `M` (9,), row by row."""
        return estimates_of(self.parameters(), name)

    def parameters(self) -> Iterator[Parameter]:
        """Returns every number of it: bias, matrix, and the lever arm where there is one."""
        unit = UNITS[self.sensor]
        yield from _parameters("bias {}", "xyz", unit, self.bias, self.bias_sigma)
        pairs = [one + other for one in "xyz" for other in "xyz"]
        yield from _parameters("M {}", pairs, "1", self.matrix.ravel(), self.matrix_sigma.ravel())
        if self.lever_arm is not None and self.lever_arm_sigma is not None:
            yield from _parameters("lever arm {}", "xyz", "m", self.lever_arm, self.lever_arm_sigma)


def _parameters(
    name: str, axes: Sequence[str], unit: str, values: FloatArray, sigmas: FloatArray
) -> Iterator[Parameter]:
    for axis, value, sigma in zip(axes, map(float, values), map(float, sigmas), strict=True):
        seen, half = math.isfinite(sigma), INTERVAL * sigma
        why = "" if seen else NOT_SHOWN
        yield Parameter(name.format(axis), unit, value, sigma, value - half, value + half, seen, why)


RECORDED = tuple(each.name for each in fields(SecondaryError) if each.name not in ("unit", "adopted"))
"""Fields of it that the core's record and the file of a stored error hold."""
UNKNOWN: Mapping[str, Any] = {
    "lever_arm": None,
    "lever_arm_sigma": None,
    "residual": math.nan,
    "residual_before": math.nan,
    "pairs": 0,
    "sequence": 0,
    "followed": np.zeros(3),
    "adopted": None,
}
"""Values of fields while they are not known."""


@dataclass(frozen=True, slots=True)
class UnitTrace:
    """Means of one unit over successive windows; NaN where the unit has no usable reading."""

    name: str
    specific_force: FloatArray
    """(n, 3) m/s^2, raw, turned by the nominal mounting into the primary's case frame."""
    angular_rate: FloatArray
    """(n, 3) rad/s, the same."""
    specific_force_compensated: FloatArray
    """(n, 3) m/s^2, compensated with the error that was stored at the time, at the primary's place."""
    angular_rate_compensated: FloatArray
    """(n, 3) rad/s."""


@dataclass(frozen=True, slots=True)
class Selected:
    """A span of time in which one unit was the source of the output."""

    start: float
    end: float
    unit: str
    """Empty where no unit was usable."""
    reason: str


FLAGS = {"degraded": 1}
"""Bits of the flags of an output: its source is wrong, or contradicted, or lacks an axis of the primary."""


@dataclass(frozen=True, slots=True, eq=False)
class SetOutput:
    """Output that the platform would have used: the compensated readings of the present source.

    At the primary's place, in its case frame, with its own calibration applied last (redundancy.md, eq. 14).
    """

    units: tuple[str, ...]
    """Primary first."""
    time: FloatArray
    """(n,) s of the recordings' common clock."""
    source: NDArray[np.int64]
    """(n,) index in `units` of the unit that was the source."""
    specific_force: FloatArray
    """(n, 3) m/s^2; NaN along axes that the source does not measure."""
    angular_rate: FloatArray
    """(n, 3) rad/s; NaN about axes that the source does not measure."""
    flags: NDArray[np.int64]
    """(n,) 0, or the sum of `FLAGS`."""

    def __len__(self) -> int:
        return len(self.time)

    def save(self, path: Path | str) -> Path:
        """Writes CSV or Parquet, by the extension: time, ax ay az, gx gy gz, source, flags.

        Raises `OutputError` where it cannot be written; what stood there before is untouched.
        """
        from tumble.procedures.redundancy.command_files import write_output

        return write_output(self, path)


@dataclass(frozen=True, slots=True)
class Identified:
    """A unit by its name, by the number stored errors know it by, and by its serial, empty if unknown."""

    name: str
    identity: int
    serial: str = ""
    identity_by_name: int | None = None
    """Value of `identity` without a serial; `None`: the same."""

    def is_known_as(self, name: str, identity: int, serial: str | None) -> bool:
        """Returns whether a stored error of that name, identity and serial is of this unit."""
        if bool(serial) == bool(self.serial):
            return identity == self.identity
        if self.serial:
            return identity in (self.identity, self.identity_by_name)
        return name == self.name


@dataclass(frozen=True, slots=True)
class RedundancyResult(Tabular, Collection[SecondaryError]):
    """A log replayed through the monitor."""

    primary: str
    secondaries: tuple[str, ...]
    start: float
    end: float
    """s of the recordings' common clock."""
    settings: Mapping[str, object]
    """Every setting by name, as used."""
    events: tuple[RedundancyEvent, ...]
    errors: tuple[SecondaryError, ...]
    """Stored error of every sensor of every secondary at the end; none for a sensor never calibrated."""
    window_time: FloatArray
    """(n,) s, middle of each window."""
    traces: tuple[UnitTrace, ...]
    """Primary first."""
    selected: tuple[Selected, ...]
    replay_rate: float
    """Seconds of the log replayed in a second; NaN where the set was watched live."""
    warnings: tuple[str, ...] = ()
    """Warnings on the logs, the calibration and the store, for the user."""
    calibration_hash: str = ""
    """Hash of the primary's own calibration; empty if it had none."""
    software: str = ""
    provenance: Provenance = field(default_factory=provenance_now, compare=False)
    """When and by whom it was found."""
    serials: Mapping[str, str] = field(default_factory=dict)
    """Serial numbers of the units whose logs state them, by name."""
    readings: Mapping[str, LogReading] = field(default_factory=dict, repr=False)
    """Options that changed the readings of logs, by the names of units; empty where they are not known."""
    defaults: Mapping[str, object] = field(default_factory=dict)
    """Default settings, by name; empty if unknown."""
    identities: tuple[Identified, ...] = ()
    """Identities by which stored errors know the units, primary first."""
    applied: Mapping[str, object] = field(default_factory=dict, repr=False)
    """Content of the primary's own calibration; empty if it had none."""
    store: Path | None = None
    """Folder in which adopted errors were stored already; None if in none."""
    output: SetOutput | None = field(default=None, repr=False)
    """Output that the platform would have used; None where it was not kept."""
    degraded: float = 0.0
    """Share of the samples of the output, 0 to 1, whose source was known to be wrong, or contradicted."""
    preset: str = ""
    """`as published` where settings began from those of the literature."""

    def _items(self) -> Sequence[SecondaryError]:
        return self.errors

    @property
    def time(self) -> LogTime:
        """Clock that the recordings share, which all times are of."""
        return LogTime(self.start)

    def from_start(self) -> RedundancyResult:
        """Returns the result with all times from the start of the recordings, as people read them.

        The output keeps its own: it is a file, not a page.
        """
        since = self.time.since
        return replace(
            self,
            start=since(self.start),
            end=since(self.end),
            events=tuple(replace(event, time=since(event.time)) for event in self.events),
            errors=tuple(
                error if error.adopted is None else replace(error, adopted=since(error.adopted))
                for error in self.errors
            ),
            window_time=self.window_time - self.time.zero,
            selected=tuple(
                replace(span, start=since(span.start), end=since(span.end)) for span in self.selected
            ),
        )

    def calibration_of(self, secondary: str) -> Calibration:
        """Creates the calibration file of a secondary, into the case frame of the primary.

        Raises `ProcedureError` where it has no stored error.
        """
        from tumble.procedures.redundancy.calibration import calibration_of

        return calibration_of(self, secondary)

    @property
    def calibration(self) -> Calibration:
        """Calibration file of the only secondary; `calibrations` has those of several.

        Raises `ProcedureError` where there are several, or it has no stored error.
        """
        names = self._calibrated()
        return self.calibration_of(names[only(names)])

    @property
    def calibrations(self) -> dict[str, Calibration]:
        """Calibration files of all secondaries with a stored error, by name."""
        return {name: self.calibration_of(name) for name in self._calibrated()}

    def _calibrated(self) -> list[str]:
        """Returns the names of the secondaries with a stored error."""
        return list(dict.fromkeys(error.unit for error in self.errors))

    def plot(self, figure: str | None = None) -> matplotlib.figure.Figure:
        """Draws the figures of the page with matplotlib: all below one another, or the one of that name.

        Raises `TumbleError` where matplotlib is not installed, or the page has no such figure.
        """
        from tumble.procedures.redundancy.report.page import REDUNDANCY_REPORT

        return REDUNDANCY_REPORT.plot(self, figure)

    def save(self, folder: Path | str) -> dict[str, Path]:
        """Writes what `tumble redundancy` writes; returns the path of each file by what it is.

        Adopted errors go to the folder `store` in it, unless they were stored in the course of the replay.

        Raises `OutputError` where a file cannot be written; what stood there before is untouched.
        """
        from tumble.procedures.redundancy.command_files import save

        return save(self, folder)

    def rows(self) -> Iterator[Row]:
        """Returns a line for each number of each stored error."""
        for error in self.errors:
            for parameter in error.parameters():
                yield {"secondary": error.unit, "sensor": error.sensor} | parameter.row()

    @property
    def known_faults(self) -> tuple[KnownFault, ...]:
        """Known faults that remained, the worst first."""
        return tuple(known_faults(self))

    @property
    def all_well(self) -> bool:
        """Returns whether no known fault remained; a failover that worked is well."""
        return not self.known_faults

    @property
    def verdict(self) -> Verdict:
        """`fail` where what the platform would have used is known to be wrong, or may be.

        `not calibrated` where a secondary is not, `pass` where all were evaluated and none had to be.
        """
        kinds = {fault.kind for fault in self.known_faults}
        if kinds & set(OF_THE_SET):
            return "fail"
        if kinds:
            return "not calibrated"
        return "calibrated" if self._units("adopted") else "pass"

    def _units(self, event: str) -> set[str]:
        return {each.unit for each in self.events if each.event == event}

    def _repr_html_(self) -> str:
        from tumble.procedures.redundancy.report.notebook import redundancy_html

        return printable(redundancy_html(self))
