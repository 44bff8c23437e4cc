"""The multi-pose procedure on a log: an IMU held still in many orientations, turned by hand in between."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import (
    acquire,
    refuse_if_damaged,
    refuse_if_misread,
    refuse_if_rate_misread,
    rejected_rests_of,
    rests_of,
    trace_of,
)
from tumble.acquisition.imu import Imu, log_name
from tumble.acquisition.notices import notices
from tumble.errors import ProcedureError
from tumble.gravity import local_gravity
from tumble.logs import ReadOptions, open_recording, parse_spec
from tumble.multipose.messages import explain
from tumble.multipose.result import MultiposeResult, NextOrientation, NominalScale, PoseFit, TurnFit
from tumble.provenance import Provenance, date_now, log_digest
from tumble.recording import FloatArray, Recording, RecordingSource, SampleProgress
from tumble.results import TriadResult
from tumble.turntable.triads import triad_result
from tumble.words import count_of

OWN_AXES = "the case frame is that of the accelerometer's own axes: no equipment shows how it is mounted"
"""Why the mounting of the accelerometer is not observable."""

FEW_TO_CHECK = 4
"""Directions beyond the nine unknowns, below which hardly anything checks them."""
STANDS_OUT = 0.5
"""Weight in the robust loss below which a pose is named."""
DECISIVE = 0.95
"""Leverage above which nothing but the pose itself shows what it shows."""

_UNKNOWNS = {
    0: "scale x",
    3: "non-orthogonality xy",
    4: "scale y",
    6: "non-orthogonality zx",
    7: "non-orthogonality yz",
    8: "scale z",
    9: "bias x",
    10: "bias y",
    11: "bias z",
}
"""What an element of [M row by row, b] is mostly about."""


def multipose(
    source: RecordingSource,
    *,
    gravity: float | None = None,
    latitude: float | None = None,
    height: float | None = None,
    g_sensitivity: bool = False,
    earth_rate: bool = False,
    raw: bool = False,
    read: ReadOptions | None = None,
    operator: str = "",
    station: str = "",
    progress: SampleProgress | None = None,
) -> MultiposeResult:
    """Calibrate a unit that was held still in many orientations and turned by hand in between.

    At rest the length of specific force is gravity in any orientation, which shows scale, non-orthogonality
    and bias of the accelerometer; between rests the gyroscope has to turn gravity as the accelerometer finds
    it turned. Gravity is standard, or `gravity` in m/s^2, or follows from `latitude` in deg and `height` in
    m. With `g_sensitivity` the gyroscope's response to specific force is fitted. With `earth_rate`, which
    needs the latitude, the upward part of the Earth's rotation is taken off. With `raw`, readings are counts
    of a scale nobody knows, which gravity and the turns show.

    Raises `TumbleError`, in one line, where the poses do not show all that is asked of the accelerometer. A
    gyroscope that cannot be calibrated has its reason in `gyroscope_reason`.

    Method: docs/theory/multipose.md.
    """
    strength, gravity_source = local_gravity(gravity, latitude, height)
    if earth_rate and latitude is None:
        raise ProcedureError("the Earth's rotation depends on latitude; give it with --latitude")
    recording = open_recording(source, as_counts(read) if raw else read)
    unit = _acquired(recording, strength, raw=raw, progress=progress)
    has_gyroscope = "gyroscope" in unit.triads
    try:
        figures = _core.multipose_of(
            *_samples(unit, progress),
            strength,
            gyroscope=has_gyroscope,
            g_sensitivity=g_sensitivity,
            latitude=math.radians(latitude) if earth_rate and latitude is not None else None,
            raw=raw,
        )
    except _core.CoreError as error:
        raise ProcedureError(explain(*error.args), about=recording.name) from None
    found = replace(unit, acquired=figures["acquired"])
    reason = _gyroscope_reason(figures, has_gyroscope)
    sha256 = log_digest(parse_spec(source).path) if isinstance(source, str | Path) else ""
    result = MultiposeResult(
        name=recording.name,
        source=log_name(recording),
        serial=recording.metadata.serial,
        accelerometer=_accelerometer(figures, found.acquired),
        gyroscope=_gyroscope(figures, found.acquired),
        gyroscope_reason=reason,
        poses=tuple(_poses(figures["poses"])),
        turns=tuple(_turns(figures["gyroscope"])),
        next_orientation=_next(figures["next"]),
        rests=rests_of(found.acquired, triads=unit.triads) + rejected_rests_of(found.acquired),
        trace=trace_of(found.acquired, unit.triads),
        gravity=strength,
        gravity_source=gravity_source,
        tolerance=figures["tolerance"],
        nominal_scale=_nominal(figures),
        temperature=unit.acquired.temperature,
        log=replace(unit.log, sha256=sha256),
        provenance=Provenance(date_now(), operator, station),
        options={"g-sensitivity": g_sensitivity, "earth-rate": earth_rate, "raw": raw},
        software=f"tumble {_core.__version__}",
    )
    return replace(result, warnings=tuple(_warnings(result, found, figures)))


def as_counts(read: ReadOptions | None) -> ReadOptions:
    """Make of how to read a log how to read its numbers as they stand."""
    return replace(read or ReadOptions(), accelerometer_unit="m/s^2", gyroscope_unit="rad/s")


def _acquired(recording: Recording, gravity: float, *, raw: bool, progress: SampleProgress | None) -> Imu:
    """Read the recording for the first time, and refuse what cannot serve."""
    if recording.parts:
        raise ProcedureError(
            f"is a folder of {count_of('log', len(recording.parts))}, one per pose; give the one log in "
            "which the unit is held and turned",
            about=recording.name,
        )
    if "accelerometer" not in recording.metadata.triads:
        raise ProcedureError(
            "holds no accelerometer readings, which show gravity; name a log that has them",
            about=recording.name,
        )
    unit = acquire(recording, None, progress)
    refuse_if_damaged(unit.name, unit.acquired, [] if raw else unit.faults)
    if raw or not len(unit.acquired.rest_times):
        return unit
    try:
        refuse_if_misread(unit.name, unit.acquired, gravity)
    except ProcedureError as error:
        raise ProcedureError(f"{error.why}; or take readings for counts, with --raw", unit.name) from None
    if "gyroscope" in unit.triads:
        refuse_if_rate_misread(unit.name, unit.acquired)
    return unit


def _samples(unit: Imu, progress: SampleProgress | None) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Read all samples, those without a number left out: time, specific force, angular rate."""
    times, forces, rates = [], [], []
    for chunk in unit.recording.chunks():
        rate = chunk.gyroscope if "gyroscope" in unit.triads else np.zeros((len(chunk), 3))
        good = (
            np.isfinite(chunk.time)
            & np.isfinite(chunk.accelerometer).all(axis=1)
            & np.isfinite(rate).all(axis=1)
        )
        times.append(chunk.time[good])
        forces.append(chunk.accelerometer[good])
        rates.append(rate[good])
        if progress is not None:
            progress(unit.acquired.samples, None)
    return np.concatenate(times), np.concatenate(forces), np.concatenate(rates)


def _accelerometer(figures: _core.MultiposeFigures, unit: _core.Acquired) -> TriadResult:
    found = triad_result(
        "accelerometer", figures["accelerometer"], unit.noise_density[:3], unit.bias_instability[:3], {}
    )
    assert found is not None
    parameters = tuple(
        replace(
            each,
            value=math.nan,
            sigma=math.inf,
            low=math.nan,
            high=math.nan,
            observable=False,
            reason=OWN_AXES,
        )
        if each.name.startswith("mounting")
        else each
        for each in found.parameters
    )
    return replace(
        found,
        parameters=parameters,
        unobservable=(f"mounting: {OWN_AXES}",),
        rank=figures["accelerometer"]["rank"],
    )


def _gyroscope(figures: _core.MultiposeFigures, unit: _core.Acquired) -> TriadResult | None:
    gyroscope = figures["gyroscope"]
    calibration = None if gyroscope is None else gyroscope["calibration"]
    return triad_result("gyroscope", calibration, unit.noise_density[3:], unit.bias_instability[3:], {})


def _gyroscope_reason(figures: _core.MultiposeFigures, has_gyroscope: bool) -> str:
    if not has_gyroscope:
        return "no gyroscope readings were recorded"
    refusal = figures["gyroscope_refusal"]
    return "" if refusal is None else explain(*refusal)


def _poses(figures: _core.MultiposePoses) -> Iterator[PoseFit]:
    ups = figures["force"] / np.linalg.norm(figures["force"], axis=1)[:, None]
    for k, up in enumerate(ups):
        yield PoseFit(
            up=up,
            before=figures["before"][k],
            after=figures["after"][k],
            sigma=figures["sigma"][k],
            held_out=figures["held_out"][k],
            weight=figures["weight"][k],
            direction=figures["direction"][k],
            leverage=figures["leverage"][k],
            influence=figures["influence"][k],
        )


def _turns(figures: _core.MultiposeGyroscope | None) -> Iterator[TurnFit]:
    if figures is not None:
        each = zip(figures["turns"], figures["angles_before"], figures["angles_after"], strict=True)
        for (before, after), angle_before, angle in each:
            yield TurnFit(before, after, angle_before, angle)


def _next(figures: _core.NextOrientationFigures | None) -> NextOrientation | None:
    if figures is None:
        return None
    return NextOrientation(figures["up"], _UNKNOWNS[figures["unknown"]], figures["before"], figures["after"])


def _nominal(figures: _core.MultiposeFigures) -> NominalScale | None:
    scale = figures["nominal_scale"]
    if scale is None:
        return None
    return NominalScale(1.0 / scale[0], None if figures["gyroscope"] is None else 1.0 / scale[1])


def _warnings(result: MultiposeResult, unit: Imu, figures: _core.MultiposeFigures) -> Iterator[str]:
    if result.nominal_scale is None:
        yield from notices(unit)
    else:
        yield from _about_counts(result.nominal_scale)
    if result.directions - 9 < FEW_TO_CHECK:
        yield (
            f"{result.directions} orientations for nine unknowns: hardly anything checks the fit; 15 to 20 "
            "are good"
        )
    spoilt = [str(k + 1) for k, pose in enumerate(result.poses) if pose.weight < STANDS_OUT]
    if spoilt:
        yield f"rest {', '.join(spoilt)}: departs from all others and weighs less in the fit; was it touched?"
    decisive = [str(k + 1) for k, pose in enumerate(result.poses) if pose.leverage > DECISIVE]
    if decisive:
        yield (
            f"rest {', '.join(decisive)}: no other shows what it shows, so nothing checks it; add poses "
            "near it"
        )
    if result.gyroscope_reason:
        yield result.gyroscope_reason
    if figures["gyroscope"] is not None:
        yield from _about_the_gyroscope(figures["gyroscope"], result)
    for triad in result.triads:
        if triad.widening > 1.0:
            yield (
                f"{triad.triad}: residuals are {triad.widening:.1f} times what noise explains; its sigmas "
                "include that"
            )


def _about_counts(scale: NominalScale) -> Iterator[str]:
    gyroscope = (
        "" if scale.gyroscope is None else f" --gyroscope-scale {scale.gyroscope:g} --gyroscope-unit rad/s"
    )
    yield (
        "readings are counts, and the calibration holds for logs read with --accelerometer-scale "
        f"{scale.accelerometer:g} --accelerometer-unit m/s^2{gyroscope}"
    )


def _about_the_gyroscope(figures: _core.MultiposeGyroscope, result: MultiposeResult) -> Iterator[str]:
    with_g = figures["with_g_sensitivity"]
    if with_g is not None:
        yield (
            "the gyroscope's bias depends on how the unit is held: with --g-sensitivity gravity would be "
            f"turned to {math.degrees(with_g):.2g} deg, now {math.degrees(result.angle_after):.2g} deg"
        )
    if figures["bias_excess"] > 0.0:
        yield (
            f"the gyroscope's bias varies by {figures['bias_excess']:.2g} rad/s from rest to rest, more than "
            "noise explains; its sigmas include that"
        )
    if figures["turn_excess"] > 0.0:
        yield (
            f"turns are off by {math.degrees(figures['turn_excess']):.2g} deg beyond noise; the sigmas "
            "include that"
        )
