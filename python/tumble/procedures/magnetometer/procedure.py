"""The magnetometer procedure: a log of a unit that was turned by hand becomes a calibration of it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import rests_of
from tumble.acquisition.field_range import within_range
from tumble.acquisition.imu import digest_of, log_name
from tumble.calibration.document import AccelerometerCalibration, Calibration
from tumble.calibration.start import started_from
from tumble.foundation.arrays import AXES
from tumble.foundation.errors import ProcedureError
from tumble.foundation.gravity import local_gravity
from tumble.foundation.growing_array import GrowingArray
from tumble.foundation.log_time import LogTime
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.provenance import NO_LOG, LogFacts
from tumble.foundation.recording import FloatArray, Recording, RecordingSource
from tumble.foundation.results import Parameter, TriadResult
from tumble.logs import ReadOptions, open_recording
from tumble.poses.triads import triad_result
from tumble.procedures.magnetometer import messages
from tumble.procedures.magnetometer.earth_field import EarthField, earth_field
from tumble.procedures.magnetometer.result import (
    FieldPoint,
    MagnetometerResult,
    NextField,
    estimated,
    unknown,
)


@dataclass(frozen=True, slots=True)
class RestingAccelerometer:
    """Specific force at the rests of a unit, by a calibrated accelerometer."""

    spans: Sequence[tuple[float, float]]
    """First and last time of each rest, s."""
    force: FloatArray
    """(k, 3) corrected specific force, m/s^2."""
    variance: FloatArray
    """(k, 3) of the mean readings, (m/s^2)^2."""
    M: FloatArray
    """(3, 3)."""
    covariance: FloatArray
    """(12, 12) of its [M row by row, b]."""


def magnetometer(
    source: RecordingSource,
    *,
    field: float | None = None,
    field_uncertainty: float | None = None,
    latitude: float | None = None,
    longitude: float | None = None,
    height: float | None = None,
    day: date | None = None,
    current: bool = False,
    turned: bool = False,
    calibration: Calibration | str | Path | None = None,
    read: ReadOptions | None = None,
) -> MagnetometerResult:
    """Calibrates a magnetometer by the Earth's field: hard iron, soft iron, and its mounting.

    The strength of the field is the same in all orientations, which shows bias, scale and soft iron. At rests
    of a unit with an accelerometer the angle between field and gravity is the same too, which shows the
    mounting. `field` is the strength in uT and `field_uncertainty` its 1-sigma; else both follow from
    `latitude`, `longitude` in deg, `height` in m and `day` by the World Magnetic Model; else scale is
    relative to the mean of the three axes.

    With `current` the response to the current or throttle in the log is fitted. `calibration` is one of
    the unit, whose accelerometer shows up; else that is calibrated from the same rests. With `turned`, and
    in a log without enough rests, all samples are used, and the mounting remains unknown.

    Raises `TumbleError`, in one line, where the log does not show all that is asked for.

    Method: docs/theory/magnetometer.md.
    """
    place = earth_field(
        field,
        uncertainty=field_uncertainty,
        latitude=latitude,
        longitude=longitude,
        height=height,
        day=day,
    )
    recording = open_recording(source, read, need_imu=False)
    track = track_of(recording)
    before = started_from(calibration, recording.metadata)
    gravity = local_gravity(None, latitude, height).value
    resting, reason = (None, "") if turned else _resting(recording, before, gravity)
    facts = _facts(recording, track)
    found = calibrated(track, resting, place, current=current, name=recording.name, facts=facts)
    metadata = recording.metadata
    notices = (*metadata.remarks, *metadata.assumptions, *track.remarks, *([reason] if reason else []))
    return replace(
        found,
        source=log_name(recording),
        serial=recording.metadata.serial or (before.serial if before else ""),
        start_hash=before.hash() if before else "",
        start=before.content() if before else {},
        options=found.options | {"accelerometer": _source_of_up(resting, before)},
        warnings=(*notices, *found.warnings),
    )


def track_of(recording: Recording) -> MagneticTrack:
    """Reads the magnetometer of a log; raises `ProcedureError` where it has none."""
    track = recording.magnetic
    if track is None:
        raise ProcedureError(messages.NO_MAGNETOMETER, about=recording.name)
    return track


def calibrated(
    track: MagneticTrack,
    resting: RestingAccelerometer | None,
    place: EarthField,
    *,
    current: bool = False,
    name: str = "",
    facts: LogFacts = NO_LOG,
) -> MagnetometerResult:
    """Calibrates a magnetometer at rests, or, where there are none, by all its samples.

    Raises `ProcedureError`, in one line, where they do not show all that is asked for.
    """
    recorded = len(track)
    track, clipped = within_range(track, track, () if resting is None else resting.spans)
    if len(track) < (1.0 - _core.MOST_LEFT_OUT) * recorded:
        raise ProcedureError(f"{messages.MOSTLY_CLIPPED}; {clipped}", about=name)
    load = _load(track, name) if current else None
    try:
        figures = _fit(track, resting, place, load)
    except _core.CoreError as error:
        why = messages.explain(*error.args)
        raise ProcedureError(f"{why}; {clipped}" if clipped else why, about=name) from None
    dip = _dip(figures)
    if dip.observable and place.dip is not None and _is_mirrored(dip.value, place.dip):
        raise ProcedureError(messages.left_handed(dip.value, place.dip), about=name)
    scatter = figures["scatter"]
    result = MagnetometerResult(
        name=name,
        source="",
        serial="",
        magnetometer=_triad(figures, aligned=dip.observable),
        current=tuple(_response(figures, track.current_unit)),
        current_unit=track.current_unit,
        strength=_strength(figures, place),
        strength_source=place.source,
        dip=dip,
        expected_dip=place.dip,
        points=tuple(_points(figures["points"])),
        next_field=_next(figures["next"]),
        coverage=figures["coverage"],
        at_rest=resting is not None,
        scatter=None if scatter is None else scatter[0],
        correlated=None if scatter is None else scatter[1],
        log=facts,
        options={"current": current, "turned": resting is None},
        software=f"tumble {_core.__version__}",
    )
    warnings = (*([clipped] if clipped else []), *messages.warnings_of(result, facts.time))
    return replace(result, warnings=warnings)


def _fit(
    track: MagneticTrack, resting: RestingAccelerometer | None, place: EarthField, load: FloatArray | None
) -> _core.MagnetometerFigures:
    time, field = np.ascontiguousarray(track.time), np.ascontiguousarray(track.field)
    if resting is None:
        return _core.magnetometer_turned(
            time, field, current=load, strength=place.strength, strength_sigma=place.sigma
        )
    return _core.magnetometer_at_rests(
        time,
        field,
        list(resting.spans),
        np.ascontiguousarray(resting.force),
        np.ascontiguousarray(resting.variance),
        np.ascontiguousarray(resting.M),
        np.ascontiguousarray(resting.covariance),
        current=load,
        strength=place.strength,
        strength_sigma=place.sigma,
    )


def _load(track: MagneticTrack, name: str) -> FloatArray:
    """Returns the current or throttle of each reading; zero where the log does not state it."""
    if track.current is None or not np.isfinite(track.current).any():
        raise ProcedureError(messages.NO_CURRENT, about=name)
    return np.ascontiguousarray(np.nan_to_num(track.current))


def _facts(recording: Recording, track: MagneticTrack) -> LogFacts:
    metadata = recording.metadata
    return LogFacts(
        sha256=digest_of(recording),
        duration=float(track.time[-1] - track.time[0]) if len(track) else 0.0,
        axes=metadata.body,
        reading=metadata.reading,
        time=LogTime(float(track.time[0]) if len(track) else math.nan),
    )


def _resting(
    recording: Recording, before: Calibration | None, gravity: float
) -> tuple[RestingAccelerometer | None, str]:
    """Returns what the accelerometer shows at rests; else nothing, and the reason."""
    if "accelerometer" not in recording.metadata.triads or recording.parts:
        return None, ""
    has_gyroscope = "gyroscope" in recording.metadata.triads
    columns = (GrowingArray(), GrowingArray(AXES), GrowingArray(AXES))
    for chunk in recording.chunks():
        rate = chunk.gyroscope if has_gyroscope else np.zeros_like(chunk.accelerometer)
        readings = np.column_stack([chunk.time, chunk.accelerometer, rate])
        good = np.isfinite(readings).all(axis=1)
        for column, values in zip(columns, (chunk.time, chunk.accelerometer, rate), strict=True):
            column.add(values[good])
    try:
        time, force, rate = (each.whole() for each in columns)
        figures = _core.multipose_of(time, force, rate, gravity, gyroscope=False)
    except _core.CoreError as error:
        return None, messages.no_rests(*error.args)
    return resting_accelerometer(figures, None if before is None else before.accelerometer), ""


def resting_accelerometer(
    figures: _core.MultiposeFigures, known: AccelerometerCalibration | None = None
) -> RestingAccelerometer:
    """Returns what a multi-pose fit shows at its rests, by its own accelerometer or one that is known."""
    own, rests = figures["accelerometer"], rests_of(figures["acquired"], triads=("accelerometer",))
    force, M, covariance = figures["poses"]["force"], own["M"], own["covariance"]
    if known is not None:
        raw = np.array([rest.specific_force for rest in rests])
        force, M = np.linalg.solve(known.M, (raw - known.b).T).T, known.M
        stated = known.covariance
        covariance = np.zeros((12, 12)) if stated is None else np.nan_to_num(stated)
    return RestingAccelerometer(
        spans=[(rest.start, rest.end) for rest in rests],
        force=force,
        variance=np.array([rest.specific_force_sigma**2 for rest in rests]),
        M=M,
        covariance=covariance,
    )


def _source_of_up(resting: RestingAccelerometer | None, before: Calibration | None) -> str:
    if resting is None:
        return "none"
    return "calibration" if before is not None and before.accelerometer is not None else "same rests"


def _is_mirrored(dip: float, expected: float) -> bool:
    telling = min(abs(dip), abs(expected)) > messages.TELLING_DIP
    return telling and (dip > 0.0) != (expected > 0.0)


def _triad(figures: _core.MagnetometerFigures, *, aligned: bool) -> TriadResult:
    nothing = np.full(3, np.nan)
    found = triad_result("magnetometer", figures["calibration"], nothing, nothing, {})
    assert found is not None
    if aligned:
        return found
    parameters = tuple(
        unknown(each.name, each.unit, messages.OWN_AXES) if each.name.startswith("mounting") else each
        for each in found.parameters
    )
    return replace(
        found,
        parameters=parameters,
        unobservable=(f"mounting: {messages.OWN_AXES}",),
        rank=figures["calibration"]["rank"],
    )


def _response(figures: _core.MagnetometerFigures, unit: str) -> Iterator[Parameter]:
    values, sigmas = figures["current"], figures["current_sigma"]
    if values is not None and sigmas is not None:
        printed = "uT per A" if unit == "A" else "uT"
        for axis, value, sigma in zip("xyz", values, sigmas, strict=True):
            yield estimated(f"current {axis}", printed, float(value), float(sigma))


def _strength(figures: _core.MagnetometerFigures, place: EarthField) -> Parameter:
    value, sigma = figures["strength"]
    return estimated("field strength", "uT", value, sigma if place.strength is None else place.sigma)


def _dip(figures: _core.MagnetometerFigures) -> Parameter:
    if figures["dip"] is None:
        return unknown("dip", "deg", messages.NO_DIP)
    value, sigma = figures["dip"]
    return estimated("dip", "deg", math.degrees(value), math.degrees(sigma))


def _points(figures: _core.FieldPointFigures) -> Iterator[FieldPoint]:
    for k, (start, end) in enumerate(figures["span"]):
        dip, dip_sigma = figures["dip"][k]
        yield FieldPoint(
            start=start,
            end=end,
            field=figures["field"][k],
            before=figures["before"][k],
            after=figures["after"][k],
            sigma=figures["sigma"][k],
            dip=math.degrees(dip),
            dip_sigma=math.degrees(dip_sigma),
            weight=figures["weight"][k],
            chance=figures["chance"][k],
            disturbed=figures["disturbed"][k],
            direction=figures["direction"][k],
            leverage=figures["leverage"][k],
            influence=figures["influence"][k],
            held_out=figures["held_out"][k],
        )


def _next(figures: _core.NextFieldFigures | None) -> NextField | None:
    if figures is None:
        return None
    return NextField(
        figures["field"],
        figures["up"],
        messages.UNKNOWNS[figures["unknown"]],
        figures["before"],
        figures["after"],
    )
