"""Results of the turntable procedure, as plain data that reports show and calibration files keep."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from dataclasses import field as made
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from tumble.foundation.gravity import GRAVITY
from tumble.foundation.provenance import NO_LOG, UNKNOWN, LogFacts, Provenance
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import (
    Collection,
    LimitCheck,
    Parameter,
    Rest,
    Row,
    Tabular,
    Trace,
    TriadName,
    TriadResult,
    Verdict,
    only,
)
from tumble.foundation.units import TRIADS, CalibratedTriad
from tumble.foundation.words import join, printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tumble.calibration.budget import Budget
    from tumble.calibration.decision import Decision
    from tumble.calibration.document import Calibration, CertificateOfReference

GOOD = ("pass", "conditional pass", "calibrated")
"""Verdicts that nobody has to look at."""
WORST_FIRST: tuple[Verdict, ...] = (
    "not calibrated",
    "model not met",
    "fail",
    "conditional fail",
    "conditional pass",
    "calibrated",
    "pass",
)
"""Verdicts of targets, the worst first."""

TruthSource = Literal["reference", "rotate-truth", "rotate-measurement", "ideal", "table"]


@dataclass(frozen=True, slots=True)
class PoseResult:
    """A pose of the list, as the reference saw it."""

    name: str
    up_table: FloatArray
    """(3,) unit vector of `up` in the table frame."""
    rests: tuple[int, ...]
    """Indices of the reference rests at this pose; several if the pose was repeated."""
    table_error: FloatArray
    """(3,) residual of the mounting fit, m/s^2, reference case frame."""
    table_error_angle: float
    """deg: angle between where the table should have pointed and where the reference measured it to point."""
    table_error_sigma: float
    """deg."""


@dataclass(frozen=True, slots=True)
class MountingResult:
    """Mounting-angle error of the reference: `m = R_e m_ref + b_a`."""

    rotation_vector: FloatArray
    """(3,) deg, case_from_table."""
    sigma: FloatArray
    """(3,) deg, 1-sigma."""
    R_e: FloatArray
    """(3, 3) rotation, case_from_table."""

    def in_table_frame(self, readings: FloatArray) -> FloatArray:
        """Compensates readings (k, 3) of the case frame for the mounting angle: R_e^-1 m, row by row."""
        return readings @ self.R_e


@dataclass(frozen=True, slots=True)
class ClockFit:
    """Clock of the target: t_target = t_reference + offset + skew (t_reference - start)."""

    shared: bool
    """True if both recordings are stamped by one clock, which fixes offset and skew at zero."""
    offset: float
    """s."""
    offset_sigma: float
    skew: float
    """parts per million."""
    skew_sigma: float
    turns: int
    """Turns that the estimate rests on."""


@dataclass(frozen=True, slots=True)
class AxisReading:
    """The source's figure for one axis: its readings at the poses, with and without mounting compensation."""

    axis: Literal["X", "Y"]
    labels: tuple[str, ...]
    """(k,) pose of each rest."""
    ideal: FloatArray
    """(k,) m/s^2, what a perfect, squarely mounted accelerometer reads."""
    uncompensated: FloatArray
    """(k,) m/s^2, what this one read."""
    compensated: FloatArray
    """(k,) m/s^2, the reading after R_e^-1."""
    sigma: FloatArray
    """(k,) 1-sigma of the reading."""


@dataclass(frozen=True, slots=True)
class OffDiagonal:
    """One element of M of the accelerometer, as the angle by which its axis leans, in three ways, deg."""

    element: str
    """`xz`: the sensing axis x, towards axis z."""
    ignored: Parameter
    """Against the poses of the list as they stand: in the frame of the table, mounting included."""
    published: Parameter
    """The same with readings turned back by the mounting angle, as published."""
    found: Parameter
    """Against what the reference measured: in the frame of the structure."""


@dataclass(frozen=True, slots=True)
class RateLevelResult:
    """A sensing axis at one constant rate."""

    rate: float
    """deg/s, true, along the sensing axis."""
    turns: int
    """Constant rates that went into it."""
    scale: float
    """Reading less bias over true rate."""
    scale_sigma: float
    deviation: float
    """ppm of full scale, from the straight line through all rates."""
    deviation_sigma: float


@dataclass(frozen=True, slots=True)
class ResponseResult:
    """A sensing axis of a gyroscope at constant rates, as IEEE Std 952 and 1431 define its figures."""

    axis: str
    full_scale: float
    """deg/s: the largest rate that was shown."""
    scale: float
    """Slope of the straight line by least squares."""
    scale_sigma: float
    linearity: float
    """ppm of full scale: largest deviation from the straight line, without sign."""
    linearity_sigma: float
    asymmetry: float | None
    """ppm: slope at positive less slope at negative rates over the slope; None where not observable."""
    asymmetry_sigma: float | None
    levels: tuple[RateLevelResult, ...]
    """The rates, from the most negative up."""

    def figures(self) -> Iterator[tuple[str, float, float]]:
        """Returns name, value and sigma of linearity and asymmetry, ppm."""
        yield f"linearity {self.axis}", self.linearity, self.linearity_sigma
        if self.asymmetry is not None and self.asymmetry_sigma is not None:
            yield f"asymmetry {self.axis}", self.asymmetry, self.asymmetry_sigma


@dataclass(frozen=True, slots=True)
class FieldAtRest:
    """Magnetic field at a rest, as the magnetometer of the reference measured it."""

    label: str
    field: FloatArray
    """(3,) uT, case frame of the reference."""
    deviation: float
    """Its strength less that of all rests, uT."""
    sigma: float
    """1-sigma of it from noise, uT."""
    disturbance: str
    """Reason why the rest is not used for magnetometers; empty where it is."""


@dataclass(frozen=True, slots=True)
class SharedField:
    """Magnetic field that the magnetometers of reference and target measured."""

    strength: float
    """uT."""
    strength_sigma: float
    calibrated_reference: bool
    """Indicates whether the magnetometer of the reference has a calibration."""
    uncertainty: str
    """Source of its uncertainty: `calibration`, or `not stated`."""
    reference_bias: FloatArray
    """(3,) uT: hard iron at the reference, by the strength of the field in all orientations."""
    reference_bias_sigma: FloatArray
    difference: FloatArray | None
    """(3,) uT: field at the target less that at the reference, across the field: upwards, to magnetic north
    and west; None where residuals do not show it."""
    mounting: tuple[Parameter, ...]
    """Angles of the magnetometer's axes against those of the accelerometer; empty where either lacks."""
    rests: tuple[FieldAtRest, ...]


@dataclass(frozen=True, slots=True)
class TargetResult(Tabular):
    """One target: its calibration, or why it has none."""

    name: str
    source: str
    """File of the log, without the folders it is in, and the IMU where one was named."""
    serial: str
    accelerometer: TriadResult | None
    gyroscope: TriadResult | None
    rests: tuple[Rest, ...]
    trace: Trace
    clock: ClockFit | None
    axis_readings: tuple[AxisReading, ...]
    """X and Y; empty where the mounting angle was not estimated."""
    temperature: tuple[float, float, float] | None
    """Lowest, mean and highest at rest, degC."""
    magnetometer: TriadResult | None = None
    """None where reference or target have none, or the rests do not show it."""
    field: SharedField | None = None
    """Field that the magnetometer was calibrated in."""
    missing_samples: int = 0
    """Samples that the log lacks, as the pauses between the others show."""
    log: LogFacts = NO_LOG
    provenance: Provenance = UNKNOWN
    off_diagonals: tuple[OffDiagonal, ...] = ()
    """Effect of mounting on M of the accelerometer; empty where the mounting angle was not estimated."""
    responses: tuple[ResponseResult, ...] = ()
    """The gyroscope at constant rates; empty where there were none."""
    checks: tuple[LimitCheck, ...] = ()
    budgets: Mapping[TriadName, tuple[Budget, ...]] = made(default_factory=dict)
    """Uncertainty of each parameter, source by source; empty without a certificate of the reference."""
    decision: Decision | None = None
    """Verdicts by the decision rule of the limits; None where they state none."""
    warnings: tuple[str, ...] = ()
    failure: str = ""
    """Reason why the target could not be calibrated, with its name; empty if it could."""
    failure_reason: str = ""
    """The same without its name, and without the folders of this machine: for files."""

    def __repr__(self) -> str:
        shown = [
            f"{triad.triad} {each.name} = {each.value:.6g} +- {each.sigma:.2g} {each.unit}"
            for triad in self.triads
            for each in triad.parameters
            if each.observable
        ]
        return "\n  ".join([f"TargetResult({self.name}: {self.failure or self.verdict})", *shown])

    def _repr_html_(self) -> str:
        from tumble.procedures.turntable.report.notebook import target_html

        return printable(target_html(self))

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter; one without a parameter where the target was not calibrated."""
        about = {"serial": self.serial, "verdict": self.verdict}
        triads = () if self.failure else self.triads
        for triad in triads:
            for parameter in triad.parameters:
                yield {"target": self.name, "sensor": triad.triad} | parameter.row() | about
        if not triads:
            nothing = Parameter("", "", math.nan, math.inf, math.nan, math.nan, False, self.failure_reason)
            yield {"target": self.name, "sensor": ""} | nothing.row() | about

    @property
    def triads(self) -> tuple[TriadResult, ...]:
        """Triads that were calibrated."""
        triads = (self.accelerometer, self.gyroscope, self.magnetometer)
        return tuple(triad for triad in triads if triad is not None)

    @property
    def misfits(self) -> tuple[TriadResult, ...]:
        """Triads whose residuals the model does not explain.

        A field that is not the same at reference and target makes no IMU doubtful: it widens the sigmas of
        its magnetometer.
        """
        return tuple(triad for triad in self.triads if triad.triad != "magnetometer" and not triad.model_met)

    @property
    def verdict(self) -> Verdict:
        """Passes or fail against the limits, `calibrated` where there are none; the model comes first."""
        if self.failure:
            return "not calibrated"
        if self.misfits:
            return "model not met"
        if self.decision is not None:
            return self.decision.verdict
        if not self.checks:
            return "calibrated"
        return "pass" if all(check.passed for check in self.checks) else "fail"


def worst_of(verdicts: Iterable[str]) -> Verdict:
    """Returns the worst of the verdicts of targets; `pass` of none."""
    found = set(verdicts)
    return next((each for each in WORST_FIRST if each in found), "pass")


NOT_STATED = "not stated"


@dataclass(frozen=True, slots=True)
class CommandedRates:
    """Rates that the table was commanded, where they are the truth of gyroscopes."""

    rates: tuple[float, ...]
    """deg/s: magnitudes."""
    accuracy: float
    """ppm, 1-sigma, of the error that all of them have in common."""
    assumed: bool
    """Indicates whether the accuracy is an assumption."""

    def for_core(self) -> tuple[list[float], float]:
        """Returns them in rad/s, and their accuracy without unit."""
        return [math.radians(rate) for rate in self.rates], 1e-6 * self.accuracy

    def options(self) -> dict[str, object]:
        """Returns them as options that results and calibration files keep."""
        return {
            "rates (deg/s)": list(self.rates),
            "rate accuracy (ppm)": self.accuracy,
            "rate accuracy from": "assumed" if self.assumed else "given",
        }


@dataclass(frozen=True, slots=True)
class UncertaintySources:
    """Source of the uncertainty of the reference: `calibration`, `grade tactical`, or `not stated`."""

    accelerometer: str = NOT_STATED
    gyroscope: str = NOT_STATED

    @property
    def relative(self) -> tuple[TriadName, ...]:
        """Triads of which nobody states it: scale and non-orthogonality are relative to the reference."""
        return tuple(name for name in TRIADS if getattr(self, name) == NOT_STATED)


@dataclass(frozen=True, slots=True)
class ReferenceResult:
    """Results of the reference."""

    name: str
    source: str
    """File of the log, without the folders it is in, and the IMU where one was named."""
    serial: str
    calibration_hash: str
    """sha256 of the calibration applied to the reference; empty if there was none."""
    bias: FloatArray
    """(3,) m/s^2, from |r - b| = g."""
    bias_sigma: FloatArray
    norm_residual: float
    """m/s^2 rms of |r_k - b| - g over the rests."""
    gyroscope_bias: FloatArray
    """(3,) rad/s."""
    gyroscope_bias_sigma: FloatArray
    rests: tuple[Rest, ...]
    trace: Trace
    mounting: MountingResult | None
    mounting_reason: str
    """Reason why the mounting angle was not estimated; empty if it was."""
    temperature: tuple[float, float, float] | None = None
    missing_samples: int = 0
    """Samples that the log lacks, as the pauses between the others show."""
    log: LogFacts = NO_LOG
    uncertainty: UncertaintySources = UncertaintySources()
    certificate: CertificateOfReference | None = None
    """Certificate to which results are traceable."""


@dataclass(frozen=True, slots=True)
class TurntableResult(Tabular, Collection[TargetResult]):
    """A batch: one reference, the poses, and any number of targets."""

    reference: ReferenceResult
    poses: tuple[PoseResult, ...]
    targets: tuple[TargetResult, ...]
    truth: TruthSource
    gravity: float
    """m/s^2."""
    gravity_source: str
    """`standard`, `given`, `WGS 84 at 48.1 deg, 520 m`."""
    gravity_sigma: float | None = None
    """m/s^2; None where nobody states it, and scale is relative to gravity."""
    options: dict[str, object] = made(default_factory=dict)
    """Method options as the calibration file keeps them."""
    limits: dict[str, object] = made(default_factory=dict)
    """Content of the limits file; empty where there were no limits."""
    warnings: tuple[str, ...] = ()
    software: str = ""
    """`tumble 0.1.0`."""
    commanded: CommandedRates | None = None
    """Commanded rates, where truth is `table`."""

    def inherited_from(self, triad: CalibratedTriad) -> str:
        """Returns the source of the inherited part: `calibration`, `table`, `calibration and gravity`."""
        stated = str(getattr(self.reference.uncertainty, triad))
        by_table = triad == "gyroscope" and self.commanded is not None
        others = {
            "": stated != NOT_STATED,
            "table": by_table,
            GRAVITY: triad == "accelerometer" and bool(self.gravity_sigma),
        }
        return join([name or stated for name, states in others.items() if states])

    def __repr__(self) -> str:
        verdicts = ", ".join(f"{target.name}: {target.verdict}" for target in self.targets)
        return f"TurntableResult(reference {self.reference.name}; {verdicts})"

    def _repr_html_(self) -> str:
        from tumble.procedures.turntable.report.notebook import batch_html

        return printable(batch_html(self))

    @property
    def verdict(self) -> Verdict:
        """That of the worst target."""
        return worst_of(target.verdict for target in self.targets)

    def _items(self) -> Sequence[TargetResult]:
        return self.targets

    def calibration_of(self, target: TargetResult | str) -> Calibration:
        """Creates the calibration file of a target of this batch, given by itself or by its name.

        Raises `ProcedureError` where the target could not be calibrated.
        """
        from tumble.procedures.turntable.calibration import calibration_of

        return calibration_of(self, self[target] if isinstance(target, str) else target)

    @property
    def calibration(self) -> Calibration:
        """Calibration file of the only target; `calibrations` has those of several.

        Raises `ProcedureError` where there are several, or it could not be calibrated.
        """
        return self.calibration_of(self.targets[only(self.targets)])

    @property
    def calibrations(self) -> dict[str, Calibration]:
        """Calibration files of all targets that could be calibrated, by name."""
        return {each.name: self.calibration_of(each) for each in self.targets if not each.failure}

    def plot(self, figure: str | None = None, *, target: str | None = None) -> Figure:
        """Draws the figures of the batch's page, or of a target's, with matplotlib.

        All are drawn below one another, or the one of the name `figure`. Raises `TumbleError` where
        matplotlib is not installed or the page has no such figure, `KeyError` where no target has that name.
        """
        from tumble.procedures.turntable.report.pages import plot_batch, plot_target

        return plot_batch(self, figure) if target is None else plot_target(self, self[target], figure)

    def save(self, folder: Path | str) -> dict[str, Path]:
        """Writes what `tumble turntable` writes; returns the path of each file by what it is.

        The folder is a batch: targets of earlier runs stay in it. Raises `ProcedureError` where it holds
        another unit of the same name, `OutputError` where a file cannot be written.
        """
        from tumble.procedures.turntable.production import save

        return save(self, folder)

    def rows(self) -> Iterator[Row]:
        """Returns the lines of all targets, one after the other."""
        for target in self.targets:
            yield from target.rows()
