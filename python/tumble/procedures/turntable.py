"""The turntable procedure: a reference and any number of targets, calibrated side by side."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from tumble import _core
from tumble.calibration import Calibration
from tumble.errors import ProcedureError, TumbleError
from tumble.logs import ReadOptions, open_recording
from tumble.poses import SIX_FACES, PoseList
from tumble.procedures.acquire import STANDARD_GRAVITY, acquire, refuse_if_unfit, rests_of, trace_of
from tumble.procedures.limits import Limits
from tumble.procedures.matching import PoseMatch, match_poses
from tumble.procedures.objections import in_words
from tumble.procedures.triads import triad_result
from tumble.recording import FloatArray, Recording
from tumble.results import (
    AxisReading,
    Clock,
    Mounting,
    PoseResult,
    ReferenceResult,
    TargetResult,
    Trace,
    Truth,
    TurntableResult,
)

Source: TypeAlias = Recording | str | Path
Progress: TypeAlias = Callable[[int, int], None]
Clocks: TypeAlias = Literal["auto", "shared", "apart"]

SWAPPED = 2.0
"""A target better than the reference by this factor, in noise and on the sphere of gravity, is the reference."""


@dataclass(frozen=True, slots=True)
class _Unit:
    recording: Recording
    acquired: _core.Acquired


def turntable(
    reference: Source,
    targets: Sequence[Source],
    *,
    poses: PoseList | str | Path | None = SIX_FACES,
    truth: Truth = "reference",
    gravity: float | None = None,
    latitude: float | None = None,
    height: float | None = None,
    reference_calibration: Calibration | str | Path | None = None,
    clock: Clocks = "auto",
    g_sensitivity: bool = False,
    limits: Limits | str | Path | None = None,
    read: ReadOptions | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> TurntableResult:
    """Calibrate targets that were bolted beside a high-precision reference on a turntable.

    `poses` is a pose list, its file, or None where no pose is known: the targets are calibrated all the same, the
    mounting angle is not. Gravity is standard, or `gravity` in m/s^2, or follows from `latitude` in deg and
    `height` in m. A target that cannot be calibrated has its reason in `failure`.

    Raises `TumbleError` where the reference is unfit, or no target at all could be calibrated.

    Method: docs/theory/turntable.md.
    """
    if not targets:
        raise ProcedureError("no target was given; name at least one recording beside the reference")
    pose_list = PoseList.load(poses) if isinstance(poses, str | Path) else poses
    limit_list = Limits.load(limits) if isinstance(limits, str | Path) else limits
    brought = _brought(reference_calibration)
    strength, source = _gravity(gravity, latitude, height)
    settings = _core.TurntableSettings(
        strength, truth, clock, None if latitude is None else math.radians(latitude), g_sensitivity
    )
    first, others = _acquire_all(reference, targets, brought, read, jobs, progress)
    if isinstance(first, TumbleError):
        raise first
    unit = first
    refuse_if_unfit(unit.recording.name, unit.acquired, strength)
    _refuse_if_swapped(unit, others, strength)
    match = match_poses(
        unit.recording, unit.acquired.rest_specific_force, unit.acquired.rest_parts, pose_list
    )
    understood = _understand(unit, match, settings, truth)
    batch = _Batch(unit, understood, match, settings, strength, limit_list)
    results = [
        batch.calibrate(source, other) for source, other in zip(_unique_names(targets, others), others, strict=True)
    ]
    if all(result.failure for result in results):
        raise ProcedureError("\n".join(result.failure for result in results))
    return TurntableResult(
        reference=_reference_result(unit, understood, match, brought),
        poses=_pose_results(match, understood),
        targets=tuple(results),
        truth=truth,
        gravity=strength,
        gravity_source=source,
        options={"clock": clock, "g-sensitivity": g_sensitivity, "poses": pose_list.source if pose_list else "none"},
        warnings=match.warnings,
        software=f"tumble {_core.__version__}",
    )


def _brought(calibration: Calibration | str | Path | None) -> Calibration | None:
    return Calibration.load(calibration) if isinstance(calibration, str | Path) else calibration


def _gravity(gravity: float | None, latitude: float | None, height: float | None) -> tuple[float, str]:
    if gravity is not None:
        if not 9.5 < gravity < 10.0:
            raise ProcedureError(f"gravity of {gravity:g} m/s^2 is found nowhere on Earth; give it in m/s^2")
        return gravity, "given"
    if latitude is None:
        return STANDARD_GRAVITY, "standard"
    if not -90.0 <= latitude <= 90.0:
        raise ProcedureError(f"latitude of {latitude:g} deg is outside -90 to 90")
    above = height or 0.0
    return _core.normal_gravity(math.radians(latitude), above), f"WGS 84 at {latitude:g} deg, {above:g} m"


def _acquire_all(
    reference: Source,
    targets: Sequence[Source],
    brought: Calibration | None,
    read: ReadOptions | None,
    jobs: int | None,
    progress: Progress | None,
) -> tuple[_Unit | TumbleError, list[_Unit | TumbleError]]:
    """Read all recordings at a time; one that cannot be read yields its error."""

    def one(source: Source, calibration: Calibration | None) -> _Unit | TumbleError:
        try:
            recording = source if isinstance(source, Recording) else open_recording(source, read)
            return _Unit(recording, acquire(recording, calibration))
        except TumbleError as error:
            return error

    with ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
        first = pool.submit(one, reference, brought)
        others: list[Future[_Unit | TumbleError]] = [pool.submit(one, target, None) for target in targets]
        for done, _ in enumerate(as_completed([first, *others]), start=1):
            if progress:
                progress(done, len(others) + 1)
        return first.result(), [other.result() for other in others]


def _unique_names(targets: Sequence[Source], units: Sequence[_Unit | TumbleError]) -> list[str]:
    names = [
        unit.recording.name if isinstance(unit, _Unit) else _name_of(target)
        for target, unit in zip(targets, units, strict=True)
    ]
    return [
        name if names.count(name) == 1 else f"{name}-{names[: k + 1].count(name)}" for k, name in enumerate(names)
    ]


def _name_of(source: Source) -> str:
    return source.name if isinstance(source, Recording) else Path(source).name


def _refuse_if_swapped(reference: _Unit, others: Sequence[_Unit | TumbleError], gravity: float) -> None:
    noise = _noise(reference)
    residual = _core.sphere_residual(reference.acquired, gravity)
    for other in others:
        if isinstance(other, TumbleError) or residual is None:
            continue
        better = _core.sphere_residual(other.acquired, gravity)
        if better is None or len(other.acquired.rest_times) < 4:
            continue
        if SWAPPED * _noise(other) < noise and SWAPPED * better < residual:
            raise ProcedureError(
                f"{other.recording.name} is quieter than the reference {reference.recording.name} and holds |f| = g to "
                f"{better:.2g} m/s^2 against {residual:.2g}: reference and target are swapped; name the better unit first"
            )


def _noise(unit: _Unit) -> float:
    return float(np.median(unit.acquired.noise_density[:3]))


def _understand(
    unit: _Unit, match: PoseMatch, settings: _core.TurntableSettings, truth: Truth
) -> _core.Reference:
    if truth != "reference" and not match.known:
        raise ProcedureError(
            f"{unit.recording.name}: truth {truth!r} needs poses, and {match.reason}; give --poses or use --truth reference"
        )
    try:
        return _core.understand_reference(unit.acquired, match.ups, settings)
    except _core.CoreError as error:
        raise ProcedureError(f"{unit.recording.name}: {in_words(error, match.names)}") from None


@dataclass(frozen=True, slots=True)
class _Batch:
    """What all targets share."""

    reference: _Unit
    understood: _core.Reference
    match: PoseMatch
    settings: _core.TurntableSettings
    gravity: float
    limits: Limits | None

    def calibrate(self, name: str, unit: _Unit | TumbleError) -> TargetResult:
        """One target; what hinders it becomes its failure."""
        if isinstance(unit, TumbleError):
            return _failed(name, str(unit))
        try:
            refuse_if_unfit(name, unit.acquired, self.gravity)
            figures = _core.calibrate_target(
                self.reference.acquired, self.understood, unit.acquired, self.match.ups, self.settings
            )
        except _core.CoreError as error:
            return _failed(name, f"{name}: {in_words(error, self.match.names)}", unit)
        except TumbleError as error:
            return _failed(name, str(error), unit)
        result = self._result(name, unit, figures)
        return replace(result, checks=self.limits.check(result)) if self.limits else result

    def _result(self, name: str, unit: _Unit, figures: _core.TargetFigures) -> TargetResult:
        noise, instability = unit.acquired.noise_density, unit.acquired.bias_instability
        names = self.match.names
        accelerometer = triad_result(
            "accelerometer", figures["accelerometer"], noise[:3], instability[:3], names
        )
        gyroscope = triad_result("gyroscope", figures["gyroscope"], noise[3:], instability[3:], names)
        poses = {
            rest: names[seen]
            for seen, first, last in figures["pairs"]
            if seen in names
            for rest in range(first, last + 1)
        }
        result = TargetResult(
            name=name,
            source=unit.recording.metadata.source,
            serial=unit.recording.metadata.serial,
            accelerometer=accelerometer,
            gyroscope=gyroscope,
            rests=rests_of(unit.acquired, poses),
            trace=trace_of(unit.acquired),
            clock=_clock(figures["clock"]),
            axis_readings=(),
            temperature=unit.acquired.temperature,
        )
        return replace(
            result,
            axis_readings=self._axis_readings(result, figures),
            warnings=tuple(self._warnings(unit, result, figures)),
        )

    def _axis_readings(self, result: TargetResult, figures: _core.TargetFigures) -> tuple[AxisReading, ...]:
        """The source's figures: X and Y at the poses, before and after R_e^-1."""
        shown = self.understood.figures
        known = [(seen, first) for seen, first, _ in figures["pairs"] if seen in self.match.names]
        if "R_e" not in shown or not known:
            return ()
        ideal = self.gravity * self.match.ups[[seen for seen, _ in known]]
        rests = [result.rests[first] for _, first in known]
        measured = np.array([rest.specific_force for rest in rests])
        sigma = np.array([rest.specific_force_sigma for rest in rests])
        # Rows are vectors: m R_e is R_e^-1 m, row by row.
        compensated = measured @ shown["R_e"]
        labels = tuple(self.match.names[seen] for seen, _ in known)
        return (
            AxisReading("X", labels, ideal[:, 0], measured[:, 0], compensated[:, 0], sigma[:, 0]),
            AxisReading("Y", labels, ideal[:, 1], measured[:, 1], compensated[:, 1], sigma[:, 1]),
        )

    def _warnings(self, unit: _Unit, result: TargetResult, figures: _core.TargetFigures) -> list[str]:
        warnings = list(_remarks(unit))
        contradiction = figures["clock"]["contradiction"]
        if contradiction:
            warnings.append(
                f"the turns lie {contradiction[0]:.3f} s apart although the clock is shared; try --clock apart"
            )
        seen = {rest for rest, _, _ in figures["pairs"]}
        lost = [k + 1 for k in range(len(self.match.ups)) if k not in seen]
        if lost:
            warnings.append(f"rest {', '.join(map(str, lost))} of the reference is no rest of this unit; not used")
        for triad, shown in ((result.accelerometer, figures["accelerometer"]), (result.gyroscope, figures["gyroscope"])):
            if triad and shown["widened"] > 1.0:
                worst = int(np.argmax(np.abs(triad.residuals / triad.residual_sigma).max(axis=1)))
                warnings.append(
                    f"{triad.triad} residuals exceed the noise (chi-square {triad.chi_square:.3g} for "
                    f"{triad.degrees_of_freedom}), most at {triad.residual_labels[worst]}: "
                    f"all sigmas were widened by {math.sqrt(shown['widened']):.2g}"
                )
        return warnings


def _remarks(unit: _Unit) -> list[str]:
    metadata = unit.recording.metadata
    remarks = list(metadata.remarks)
    if metadata.already_corrected:
        remarks.append("the log was corrected before it was written: this calibrates what the correction left")
    remarks += [f"{start:.1f} to {end:.1f} s is no rest: {why}" for start, end, why in unit.acquired.refused]
    remarks += [
        f"{channel} is saturated between {first:.1f} and {last:.1f} s: turns in that time are not used"
        for channel, _, _, first, last in unit.acquired.faults
    ]
    if unit.acquired.not_finite:
        remarks.append(f"{unit.acquired.not_finite} samples are not numbers and were passed over")
    return remarks


def _clock(figures: _core.ClockFigures) -> Clock:
    ppm = 1e6
    return Clock(
        shared=figures["shared"],
        offset=figures["offset"],
        offset_sigma=figures["offset_sigma"],
        skew=figures["skew"] * ppm,
        skew_sigma=figures["skew_sigma"] * ppm,
        turns=figures["turns"],
    )


def _failed(name: str, failure: str, unit: _Unit | None = None) -> TargetResult:
    nothing = np.empty((0, 3))
    return TargetResult(
        name=name,
        source=unit.recording.metadata.source if unit else name,
        serial=unit.recording.metadata.serial if unit else "",
        accelerometer=None,
        gyroscope=None,
        rests=rests_of(unit.acquired) if unit else (),
        trace=trace_of(unit.acquired) if unit else Trace(np.empty(0), nothing, nothing),
        clock=None,
        axis_readings=(),
        temperature=unit.acquired.temperature if unit else None,
        failure=failure,
    )


def _reference_result(
    unit: _Unit, understood: _core.Reference, match: PoseMatch, brought: Calibration | None
) -> ReferenceResult:
    figures = understood.figures
    mounting = None
    if "R_e" in figures:
        mounting = Mounting(
            np.degrees(figures["rotation_vector"]), np.degrees(figures["rotation_sigma"]), figures["R_e"]
        )
    return ReferenceResult(
        name=unit.recording.name,
        source=unit.recording.metadata.source,
        serial=unit.recording.metadata.serial,
        calibration_hash=brought.hash() if brought else "",
        bias=figures["bias"],
        bias_sigma=figures["bias_sigma"],
        norm_residual=figures["norm_residual"],
        gyroscope_bias=figures["gyroscope_bias"],
        gyroscope_bias_sigma=figures["gyroscope_bias_sigma"],
        rests=rests_of(unit.acquired, match.names),
        trace=trace_of(unit.acquired),
        mounting=mounting,
        mounting_reason="" if mounting else match.reason or "the poses do not determine a rotation",
        temperature=unit.acquired.temperature,
    )


def _pose_results(match: PoseMatch, understood: _core.Reference) -> tuple[PoseResult, ...]:
    """One result a pose; repeats of a pose share it, with the mean of their errors."""
    figures = understood.figures
    if "R_e" not in figures:
        return ()
    rests = sorted(match.names)
    places: dict[str, list[int]] = {}
    for place, rest in enumerate(rests):
        places.setdefault(match.names[rest], []).append(place)
    angles: FloatArray = np.degrees(figures["table_error_angles"])
    sigmas: FloatArray = np.degrees(figures["table_error_sigmas"])
    return tuple(
        PoseResult(
            name=name,
            up_table=match.ups[rests[at[0]]],
            rests=tuple(rests[place] for place in at),
            table_error=figures["table_errors"][at].mean(axis=0),
            table_error_angle=float(angles[at].mean()),
            table_error_sigma=float(np.sqrt((sigmas[at] ** 2).sum()) / len(at)),
        )
        for name, at in places.items()
    )
