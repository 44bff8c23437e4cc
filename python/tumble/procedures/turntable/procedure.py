"""The turntable procedure: a reference and any number of targets, calibrated side by side."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import acquire, refuse_if_unfit
from tumble.acquisition.imu import Imu
from tumble.acquisition.stamps import open_sampled
from tumble.calibration.document import Calibration
from tumble.calibration.limits import Limits
from tumble.calibration.start import applied_first, calibration_of
from tumble.foundation.errors import LogError, ProcedureError, TargetsError, TumbleError
from tumble.foundation.gravity import local_gravity
from tumble.foundation.provenance import Provenance, date_now, log_digest
from tumble.foundation.recording import Recording, RecordingSource, sources_of
from tumble.logs import ReadOptions, options_for, parse_spec
from tumble.logs.session import procedure_of
from tumble.poses.pose_list import SIX_FACES, PoseList
from tumble.procedures.turntable.budget import BudgetSources
from tumble.procedures.turntable.certified import CertificateSource, CertifiedReference, day_of
from tumble.procedures.turntable.commanded import commanded_rates, rates_not_shown, refuse_without_gyroscope
from tumble.procedures.turntable.magnetometers import ReferenceMagnetometer, with_magnetometer_option
from tumble.procedures.turntable.matching import PoseMatch, match_poses, turned_between_rests
from tumble.procedures.turntable.messages import explain
from tumble.procedures.turntable.off_diagonals import TREATMENTS
from tumble.procedures.turntable.reference import pose_results, reference_result, reference_warnings
from tumble.procedures.turntable.reference_uncertainty import (
    KnownUncertainty,
    reference_uncertainty,
    refuse_unknown_grade,
)
from tumble.procedures.turntable.result import TargetResult, TruthSource, TurntableResult
from tumble.procedures.turntable.session_poses import poses_beside
from tumble.procedures.turntable.target import TargetProcedure

RecordingsRead: TypeAlias = Callable[[int, int], None]
"""Callback that receives the number of recordings read, and of all."""
Clocks: TypeAlias = Literal["auto", "shared", "apart"]

UnitRead: TypeAlias = Imu | TumbleError
"""Acquired samples of a recording, or the error that prevented their acquisition."""

SWAPPED = 2.0
"""A target better by this factor than the reference, in noise and in keeping |f| = g, is the reference."""


@dataclass(frozen=True, slots=True)
class TurntableSession:
    """A reference on a turntable, fitted, against which any number of targets are calibrated one by one."""

    batch: TurntableResult
    """Results that all targets share; without the targets."""
    provenance: Provenance
    _reference: Imu
    _procedure: TargetProcedure
    _source: RecordingSource

    def acquire(self, source: RecordingSource, read: ReadOptions | None = None) -> UnitRead:
        """Reads a target; what hinders that is returned."""
        if _same(source, self._source):
            return ProcedureError(
                "is the reference itself; leave it out of the targets", about=_name_of(source)
            )
        return _acquire(source, None, read, "target")

    def calibrate(self, name: str, unit: UnitRead, provenance: Provenance | None = None) -> TargetResult:
        """Calibrates a target that was read; what hinders that becomes its failure."""
        found = self._procedure.calibrate(name, unit)
        return replace(found, provenance=provenance or self.provenance)

    def note_gyroscopes(self, names: Sequence[str], units: Sequence[UnitRead]) -> None:
        """Stores the order of targets before they run in parallel, so that later duplicates are reported."""
        for name, unit in zip(names, units, strict=True):
            self._procedure.first_with_gyroscope(name, unit)

    def why_swapped(self, unit: UnitRead) -> str:
        """Describes why a target must be the reference, as the much better unit; empty where it is not."""
        reference, gravity = self._reference, self.batch.gravity
        residual = _core.sphere_residual(reference.acquired, gravity)
        if isinstance(unit, TumbleError) or residual is None or "accelerometer" not in unit.triads:
            return ""
        better = _core.sphere_residual(unit.acquired, gravity)
        if better is None or len(unit.acquired.rest_times) < len(reference.acquired.rest_times):
            return ""
        if SWAPPED * _noise(unit) < _noise(reference) and SWAPPED * better < residual:
            return (
                f"{unit.name} is quieter than the reference {reference.name}, and its |f| deviates "
                f"from g by {better:.2g} m/s^2, that of the reference by {residual:.2g}: "
                "reference and target are swapped; name the better unit first"
            )
        return ""


def open_session(
    reference: RecordingSource,
    *,
    poses: PoseList | str | Path | None = SIX_FACES,
    truth: TruthSource = "reference",
    rates: Sequence[float] | None = None,
    rate_accuracy: float | None = None,
    gravity: float | None = None,
    latitude: float | None = None,
    height: float | None = None,
    gravity_uncertainty: float | None = None,
    reference_calibration: Calibration | str | Path | None = None,
    reference_grade: str | None = None,
    reference_certificate: CertificateSource | None = None,
    reference_model: str = "",
    target_grade: str | None = None,
    clock: Clocks = "auto",
    g_sensitivity: bool | None = None,
    limits: Limits | str | Path | None = None,
    read: ReadOptions | None = None,
    operator: str = "",
    station: str = "",
) -> TurntableSession:
    """Reads and fits the reference; arguments are those of `turntable`, `read` is for the reference alone.

    Raises `TumbleError` where the reference is unfit.
    """
    _refuse_unknown(truth=(truth, TruthSource), clock=(clock, Clocks))
    pose_list = poses if poses is None or isinstance(poses, PoseList) else PoseList.load(poses)
    limit_list = limits if limits is None or isinstance(limits, Limits) else Limits.load(limits)
    applied = calibration_of(reference_calibration)
    refuse_unknown_grade("reference", reference_grade)
    refuse_unknown_grade("target", target_grade)
    certified = CertifiedReference.of(reference_certificate)
    if certified is not None:
        if applied is not None:
            raise ProcedureError(
                "the calibration of the reference and its certificate both state its errors; give one of them"
            )
        applied = certified.calibration
        certified.refuse_other_model(reference_model)
    commanded = commanded_rates(truth, pose_list, rates, rate_accuracy)
    place = local_gravity(gravity, latitude, height, gravity_uncertainty)
    strength, source = place.value, place.source
    north = None if latitude is None else math.radians(latitude)
    # The table does not measure specific force: there the reference stays the truth.
    of_force = "reference" if truth == "table" else truth
    settings = _core.TurntableSettings(
        strength,
        of_force,
        clock,
        north,
        g_sensitivity,
        commanded.for_core() if commanded else None,
        place.sigma or 0.0,
    )
    compared = {
        each: _core.TurntableSettings(strength, each, clock, north, g_sensitivity) for each in TREATMENTS
    }
    unit = _acquire(reference, applied, read, "reference")
    if isinstance(unit, TumbleError):
        raise unit
    if "accelerometer" not in unit.triads:
        raise ProcedureError(
            "the reference has no accelerometer, which shows how the table stood; name a unit that has one",
            about=unit.name,
        )
    if commanded:
        refuse_without_gyroscope(unit)
    if certified is not None:
        certified.refuse_unfit(unit)
    else:
        applied = applied_first(applied, unit.recording.metadata, "--reference-calibration")
    uncertainty = reference_uncertainty(
        applied,
        reference_grade,
        certified.certificate if certified else None,
        day_of(unit),
        unit.acquired.temperature,
        certified.walks if certified else None,
    )
    refuse_if_unfit(unit.name, unit, strength)
    match = match_poses(
        unit.recording,
        unit.acquired.rest_specific_force,
        unit.acquired.rest_parts,
        pose_list,
        turned_between_rests(unit),
    )
    fitted = _fitted_reference(unit, match, settings, of_force, uncertainty)
    asked = procedure_of(reference)
    magnetometer = ReferenceMagnetometer.of(unit, applied)
    batch = TurntableResult(
        reference=reference_result(
            unit, fitted, match, applied, uncertainty.sources, certified.facts if certified else None
        ),
        poses=pose_results(match, fitted),
        targets=(),
        truth=truth,
        gravity=strength,
        gravity_source=source,
        gravity_sigma=place.sigma,
        options=with_magnetometer_option(
            {
                "clock": clock,
                "g-sensitivity": "auto" if g_sensitivity is None else g_sensitivity,
                **({"reference grade": reference_grade} if reference_grade else {}),
                **({"target grade": target_grade} if target_grade else {}),
                **(commanded.options() if commanded else {}),
                "poses": Path(pose_list.source).name if pose_list else "none",
                **(asked.options if asked else {}),
            },
            magnetometer,
        ),
        limits=limit_list.content() if limit_list else {},
        warnings=(
            *match.warnings,
            *reference_warnings(unit, fitted, strength, source, applied, by_table=commanded is not None),
            *rates_not_shown(commanded, fitted, unit.name),
        ),
        software=f"tumble {_core.__version__}",
        commanded=commanded,
    )
    table_sigma = commanded.for_core()[1] if commanded else 0.0
    procedure = TargetProcedure(
        unit,
        fitted,
        match,
        settings,
        compared,
        strength,
        limit_list,
        response_asked_for=bool(g_sensitivity),
        sources=BudgetSources(uncertainty.errors, place.sigma or 0.0, table_sigma, target_grade)
        if certified
        else None,
        magnetometer=magnetometer,
    )
    procedure.first_with_gyroscope(unit.name, unit)
    provenance = Provenance(
        date_now(), operator or (asked.operator if asked else ""), station or (asked.station if asked else "")
    )
    return TurntableSession(batch, provenance, unit, procedure, reference)


def turntable(
    reference: RecordingSource,
    targets: RecordingSource | Sequence[RecordingSource],
    *,
    poses: PoseList | str | Path | None = SIX_FACES,
    truth: TruthSource = "reference",
    rates: Sequence[float] | None = None,
    rate_accuracy: float | None = None,
    gravity: float | None = None,
    latitude: float | None = None,
    height: float | None = None,
    gravity_uncertainty: float | None = None,
    reference_calibration: Calibration | str | Path | None = None,
    reference_grade: str | None = None,
    reference_certificate: CertificateSource | None = None,
    reference_model: str = "",
    target_grade: str | None = None,
    clock: Clocks = "auto",
    g_sensitivity: bool | None = None,
    limits: Limits | str | Path | None = None,
    read: ReadOptions | Mapping[str, ReadOptions] | None = None,
    operator: str = "",
    station: str = "",
    jobs: int | None = None,
    progress: RecordingsRead | None = None,
) -> TurntableResult:
    """Calibrates targets that were bolted beside a high-precision reference on a turntable.

    `poses` is a pose list, its file, or None where no pose is known: the targets are calibrated all the
    same, the mounting angle is not. Without it the list of a recorded session holds, else the six faces.
    Gravity is standard, or `gravity` in m/s^2, or follows from `latitude` in deg and `height` in m;
    `gravity_uncertainty` is its 1-sigma, m/s^2, by docs/theory/uncertainty.md if not given. `read` holds the
    options of reading all logs or, by its name, each of them. `operator` and `station` stand in the
    calibration files. A target that cannot be calibrated has its reason in `failure`.

    With truth `table` gyroscopes are calibrated with the `rates` that the table was commanded, magnitudes in
    deg/s, or those of the pose list; `rate_accuracy` is the 1-sigma of their common error, 100 ppm if not
    given.

    The uncertainty that the calibration of the reference states, or else its grade, goes to the targets.
    With `reference_certificate`, a file or what was read of one, in place of a calibration, each parameter
    has a budget; it has to be of `reference_model`, where that is stated. `target_grade` states how far
    temperature moves the biases of targets. The response of a gyroscope to specific force is fitted where
    `g_sensitivity` is true, or None and the residuals show it.

    All results are kept in memory, 0.1 MB a target; the command writes each as it is made.

    Raises `TumbleError` where the reference is unfit, or no target at all could be calibrated.

    Method: docs/theory/turntable.md.
    """
    sources = sources_of(targets)
    if not sources:
        raise ProcedureError("no target was given; name at least one recording besides the reference")
    session = open_session(
        reference,
        poses=(poses_beside(reference) or poses) if poses is SIX_FACES else poses,
        truth=truth,
        rates=rates,
        rate_accuracy=rate_accuracy,
        gravity=gravity,
        latitude=latitude,
        height=height,
        gravity_uncertainty=gravity_uncertainty,
        reference_calibration=reference_calibration,
        reference_grade=reference_grade,
        reference_certificate=reference_certificate,
        reference_model=reference_model,
        target_grade=target_grade,
        clock=clock,
        g_sensitivity=g_sensitivity,
        limits=limits,
        read=options_for(reference, read),
        operator=operator,
        station=station,
    )
    with ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
        units = []
        for unit in pool.map(session.acquire, sources, [options_for(source, read) for source in sources]):
            units.append(unit)
            if progress:
                progress(len(units) + 1, len(sources) + 1)
        for unit in units:
            if why := session.why_swapped(unit):
                raise ProcedureError(why)
        names = _unique_names(sources, units)
        session.note_gyroscopes(names, units)
        results = tuple(pool.map(session.calibrate, names, units))
    refuse_if_all_failed(results)
    return replace(session.batch, targets=results)


def serial_of(unit: UnitRead) -> str:
    """Returns the serial number that a log states; empty where it states none."""
    return "" if isinstance(unit, TumbleError) else unit.recording.metadata.serial


def with_serial(unit: UnitRead, serial: str) -> UnitRead:
    """Returns the unit a serial number that is known from elsewhere."""
    if isinstance(unit, TumbleError):
        return unit
    metadata = replace(unit.recording.metadata, serial=serial)
    return replace(unit, recording=replace(unit.recording, metadata=metadata))


def refuse_if_all_failed(results: Sequence[TargetResult]) -> None:
    """Raises `TargetsError`, with a line for each target, where none could be calibrated."""
    if all(result.failure for result in results):
        raise TargetsError([result.failure for result in results])


def _refuse_unknown(**words: tuple[str, object]) -> None:
    for option, (word, known) in words.items():
        if word not in get_args(known):
            raise ProcedureError(f"{option} {word!r}: give one of {', '.join(get_args(known))}")


def _acquire(
    source: RecordingSource,
    calibration: Calibration | None,
    read: ReadOptions | None,
    rates: Literal["reference", "target"],
) -> UnitRead:
    try:
        unit = acquire(open_sampled(source, read), calibration, rates=rates)
        if isinstance(source, str | Path):
            return replace(unit, log=replace(unit.log, sha256=log_digest(parse_spec(source).path)))
    except TumbleError as error:
        if isinstance(source, str | Path):
            error.why = _without_folders(error.why, source)
        return error
    return unit


def _without_folders(text: str, source: str | Path) -> str:
    """Names a log by its file and the last folder: what is above that is of this machine."""
    try:
        path = parse_spec(source).path
    except LogError:
        path = Path(source)
    near = Path(*[part for part in path.parts[-2:] if part != path.anchor])
    return text.replace(str(path), str(near))


def _same(one: RecordingSource, other: RecordingSource) -> bool:
    """Returns whether both name one recording, however they spell it."""
    if not (isinstance(one, str | Path) and isinstance(other, str | Path)):
        return one is other
    try:
        specs = [parse_spec(one), parse_spec(other)]
    except LogError:
        return False
    (path, imu), (other_path, other_imu) = [(spec.path.resolve(), spec.imu) for spec in specs]
    return path == other_path and imu == other_imu


def _unique_names(targets: Sequence[RecordingSource], units: Sequence[UnitRead]) -> list[str]:
    names = [
        unit.name if isinstance(unit, Imu) else _name_of(target)
        for target, unit in zip(targets, units, strict=True)
    ]
    return [
        name if names.count(name) == 1 else f"{name}-{names[: k + 1].count(name)}"
        for k, name in enumerate(names)
    ]


def _name_of(source: RecordingSource) -> str:
    if isinstance(source, Recording):
        return source.name
    return Path(source).stem if isinstance(source, str | Path) else "table"


def _noise(unit: Imu) -> float:
    return float(np.median(unit.acquired.noise_density[:3]))


def _fitted_reference(
    unit: Imu,
    match: PoseMatch,
    settings: _core.TurntableSettings,
    truth: TruthSource,
    uncertainty: KnownUncertainty,
) -> _core.Reference:
    if truth != "reference" and not match.known:
        raise ProcedureError(
            f"truth {truth!r} needs poses, and {match.reason}; give --poses or use --truth reference",
            about=unit.name,
        )
    try:
        return _core.fit_reference(
            unit.acquired,
            match.ups,
            settings,
            "gyroscope" in unit.triads,
            uncertainty.accelerometer,
            uncertainty.gyroscope,
        )
    except _core.CoreError as error:
        raise ProcedureError(explain(error, match.names), about=unit.name) from None
