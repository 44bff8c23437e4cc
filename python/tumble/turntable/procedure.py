"""The turntable procedure: a reference and any number of targets, calibrated side by side."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import acquire, refuse_if_unfit
from tumble.acquisition.imu import Imu
from tumble.calibration.document import Calibration
from tumble.errors import LogError, ProcedureError, TumbleError
from tumble.gravity import local_gravity
from tumble.logs import ReadOptions, open_recording, options_for, parse_spec
from tumble.recording import Recording, RecordingSource, sources_of
from tumble.turntable.limits import Limits
from tumble.turntable.matching import PoseMatch, match_poses
from tumble.turntable.messages import explain
from tumble.turntable.poses import SIX_FACES, PoseList
from tumble.turntable.reference import pose_results, reference_result, reference_warnings
from tumble.turntable.result import TruthSource, TurntableResult
from tumble.turntable.target import TargetProcedure

RecordingsRead: TypeAlias = Callable[[int, int], None]
"""Told how many recordings are read, and of how many."""
Clocks: TypeAlias = Literal["auto", "shared", "apart"]

SWAPPED = 2.0
"""A target better by this factor than the reference, in noise and in keeping |f| = g, is the reference."""


def turntable(
    reference: RecordingSource,
    targets: RecordingSource | Sequence[RecordingSource],
    *,
    poses: PoseList | str | Path | None = SIX_FACES,
    truth: TruthSource = "reference",
    gravity: float | None = None,
    latitude: float | None = None,
    height: float | None = None,
    reference_calibration: Calibration | str | Path | None = None,
    clock: Clocks = "auto",
    g_sensitivity: bool = False,
    limits: Limits | str | Path | None = None,
    read: ReadOptions | Mapping[str, ReadOptions] | None = None,
    jobs: int | None = None,
    progress: RecordingsRead | None = None,
) -> TurntableResult:
    """Calibrate targets that were bolted beside a high-precision reference on a turntable.

    `poses` is a pose list, its file, or None where no pose is known: the targets are calibrated all the
    same, the mounting angle is not. Gravity is standard, or `gravity` in m/s^2, or follows from `latitude` in
    deg and `height` in m. `read` says how to read all logs or, by its name, each of them. A target that
    cannot be calibrated has its reason in `failure`.

    Raises `TumbleError` where the reference is unfit, or no target at all could be calibrated.

    Method: docs/theory/turntable.md.
    """
    sources = sources_of(targets)
    if not sources:
        raise ProcedureError("no target was given; name at least one recording besides the reference")
    _refuse_unknown(truth=(truth, TruthSource), clock=(clock, Clocks))
    pose_list = PoseList.load(poses) if isinstance(poses, str | Path) else poses
    limit_list = Limits.load(limits) if isinstance(limits, str | Path) else limits
    applied = (
        Calibration.load(reference_calibration)
        if isinstance(reference_calibration, str | Path)
        else reference_calibration
    )
    strength, source = local_gravity(gravity, latitude, height)
    settings = _core.TurntableSettings(
        strength, truth, clock, None if latitude is None else math.radians(latitude), g_sensitivity
    )
    unit, others = _acquire_all(reference, sources, applied, read, jobs, progress)
    if isinstance(unit, TumbleError):
        raise unit
    refuse_if_unfit(unit.name, unit.acquired, strength)
    _refuse_if_swapped(unit, others, strength)
    match = match_poses(
        unit.recording, unit.acquired.rest_specific_force, unit.acquired.rest_parts, pose_list
    )
    fitted = _fitted_reference(unit, match, settings, truth)
    procedure = TargetProcedure(unit, fitted, match, settings, strength, limit_list)
    names = _unique_names(sources, others)
    with ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
        results = list(pool.map(procedure.calibrate, names, others))
    if all(result.failure for result in results):
        raise ProcedureError("\n".join(result.failure for result in results))
    return TurntableResult(
        reference=reference_result(unit, fitted, match, applied),
        poses=pose_results(match, fitted),
        targets=tuple(results),
        truth=truth,
        gravity=strength,
        gravity_source=source,
        options={
            "clock": clock,
            "g-sensitivity": g_sensitivity,
            "poses": pose_list.source if pose_list else "none",
        },
        warnings=(*match.warnings, *reference_warnings(unit, fitted, strength)),
        software=f"tumble {_core.__version__}",
    )


def _refuse_unknown(**words: tuple[str, object]) -> None:
    for option, (word, known) in words.items():
        if word not in get_args(known):
            raise ProcedureError(f"{option} {word!r}: give one of {', '.join(get_args(known))}")


def _acquire_all(
    reference: RecordingSource,
    targets: Sequence[RecordingSource],
    applied: Calibration | None,
    read: ReadOptions | Mapping[str, ReadOptions] | None,
    jobs: int | None,
    progress: RecordingsRead | None,
) -> tuple[Imu | TumbleError, list[Imu | TumbleError]]:
    """Read all recordings side by side; one that cannot be read yields its error."""

    def one(source: RecordingSource, calibration: Calibration | None) -> Imu | TumbleError:
        try:
            return acquire(open_recording(source, options_for(source, read)), calibration)
        except TumbleError as error:
            return error

    def target(source: RecordingSource) -> Imu | TumbleError:
        if _same(source, reference):
            return ProcedureError(
                "is the reference itself; leave it out of the targets", about=_name_of(source)
            )
        return one(source, None)

    with ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
        first = pool.submit(one, reference, applied)
        others: list[Future[Imu | TumbleError]] = [pool.submit(target, source) for source in targets]
        for done, _ in enumerate(as_completed([first, *others]), start=1):
            if progress:
                progress(done, len(others) + 1)
        return first.result(), [other.result() for other in others]


def _same(one: RecordingSource, other: RecordingSource) -> bool:
    """Whether both name one recording, however they spell it."""
    if not (isinstance(one, str | Path) and isinstance(other, str | Path)):
        return one is other
    try:
        specs = [parse_spec(one), parse_spec(other)]
    except LogError:
        return False
    (path, imu), (other_path, other_imu) = [(spec.path.resolve(), spec.imu) for spec in specs]
    return path == other_path and imu == other_imu


def _unique_names(targets: Sequence[RecordingSource], units: Sequence[Imu | TumbleError]) -> list[str]:
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


def _refuse_if_swapped(reference: Imu, others: Sequence[Imu | TumbleError], gravity: float) -> None:
    noise = _noise(reference)
    residual = _core.sphere_residual(reference.acquired, gravity)
    for other in others:
        if isinstance(other, TumbleError) or residual is None:
            continue
        better = _core.sphere_residual(other.acquired, gravity)
        if better is None or len(other.acquired.rest_times) < len(reference.acquired.rest_times):
            continue
        if SWAPPED * _noise(other) < noise and SWAPPED * better < residual:
            raise ProcedureError(
                f"{other.name} is quieter than the reference {reference.name}, and its |f| deviates "
                f"from g by {better:.2g} m/s^2, that of the reference by {residual:.2g}: "
                "reference and target are swapped; name the better unit first"
            )


def _noise(unit: Imu) -> float:
    return float(np.median(unit.acquired.noise_density[:3]))


def _fitted_reference(
    unit: Imu, match: PoseMatch, settings: _core.TurntableSettings, truth: TruthSource
) -> _core.Reference:
    if truth != "reference" and not match.known:
        raise ProcedureError(
            f"truth {truth!r} needs poses, and {match.reason}; give --poses or use --truth reference",
            about=unit.name,
        )
    try:
        return _core.fit_reference(unit.acquired, match.ups, settings)
    except _core.CoreError as error:
        raise ProcedureError(explain(error, match.names), about=unit.name) from None
