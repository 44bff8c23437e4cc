"""Magnetometers of a session: that of a target is held against that of the reference, rest by rest."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import rests_of
from tumble.acquisition.field_range import within_range
from tumble.acquisition.imu import Imu
from tumble.calibration.document import Calibration
from tumble.foundation.error_decomposition import factors, mounting_angles
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Parameter, Rest, TriadResult
from tumble.foundation.words import count_of, join
from tumble.poses.triads import parameter, triad_result
from tumble.procedures.turntable.reference_uncertainty import of_calibration
from tumble.procedures.turntable.result import NOT_STATED, FieldAtRest, SharedField
from tumble.tools.apply.magnetic import corrected_magnetometer

LARGEST_RESIDUAL = 0.05
"""Root mean square of the residuals over the strength of the field, beyond which both magnetometers saw
different fields."""
NOT_CALIBRATED = "the magnetometer was not calibrated: {why}"
_REASONS = {
    "too few rests": (
        "both magnetometers were read at {found}, in different orientations {needed:.0f} are needed"
    ),
    "directions too alike": (
        "the field was met from too few directions; add poses, and turn about the vertical between them"
    ),
    "left-handed": (
        "its axes mirror those of the magnetometer of the reference; in one of the two logs axes are "
        "exchanged, or signs are wrong"
    ),
    "axes coincide": "two of its axes read the same; check the columns",
    "unsolvable": "the rests hold values that are not numbers, or no noise at all",
}
_DISTURBANCES = {
    "strength": "the strength of the field at the reference departs from that at the other rests",
    "target": "the target departs from what the other rests predict",
}
_STEP = 1e-6
"""Change of an element of M over which derivatives are taken."""


@dataclass(frozen=True, slots=True)
class ReferenceMagnetometer:
    """The magnetometer of the reference, corrected by its calibration where there is one."""

    track: MagneticTrack
    rests: tuple[Rest, ...]
    calibrated: bool
    uncertainty: FloatArray | None
    """(12, 12) covariance of its [E row by row, e]; None where nobody states it."""
    clipped: str = ""
    """Remark on readings at the end of its range, which are left out."""

    @classmethod
    def of(cls, unit: Imu, applied: Calibration | None) -> ReferenceMagnetometer | None:
        """Returns that of a reference, None where its log has none; `applied` is its calibration."""
        known = applied if applied is not None and applied.magnetometer is not None else None
        recording = unit.recording
        track = recording.magnetic if known is None else corrected_magnetometer(known, recording)
        if track is None or recording.magnetic is None:
            return None
        rests = rests_of(unit.acquired, triads=unit.triads)
        track, clipped = within_range(recording.magnetic, track, ((rest.start, rest.end) for rest in rests))
        return cls(track, rests, known is not None, of_calibration(known, "magnetometer"), clipped)

    @property
    def source(self) -> str:
        """Source of its uncertainty: `calibration`, or `not stated`."""
        return NOT_STATED if self.uncertainty is None else "calibration"


@dataclass(frozen=True, slots=True)
class TargetMagnetometer:
    """The magnetometer of a target, or why it has no calibration."""

    triad: TriadResult | None = None
    field: SharedField | None = None
    warnings: tuple[str, ...] = ()


def calibrated_magnetometer(
    known: ReferenceMagnetometer | None,
    unit: Imu,
    figures: _core.TargetFigures,
    accelerometer: TriadResult | None,
    pose_names: dict[int, str],
) -> TargetMagnetometer:
    """Calibrates the magnetometer of a target at the rests that `figures` pair with the reference's."""
    track = unit.recording.magnetic
    if track is None:
        return TargetMagnetometer()
    if known is None:
        return _none("the log of the reference has none")
    felt = rests_of(unit.acquired, triads=unit.triads)
    track, own = within_range(track, track, ((rest.start, rest.end) for rest in felt))
    clipped = [*([own] if own else []), *([f"reference: {known.clipped}"] if known.clipped else [])]
    try:
        found = _fit(known, felt, track, figures)
    except _core.CoreError as error:
        return _none("; ".join([_reason(*error.args), *clipped]))
    triad = triad_result(
        "magnetometer", found["calibration"], np.full(3, np.nan), np.full(3, np.nan), pose_names
    )
    assert triad is not None, "it has figures"
    strength = found["strength"][0]
    worst = float(np.sqrt(np.mean(triad.residuals**2)))
    if worst > LARGEST_RESIDUAL * strength:
        return _none(
            f"it departs by {worst:.2g} uT from the field of {strength:.3g} uT at the reference: motors or "
            "steel of the table disturb one of the two; calibrate it by hand, away from the table"
        )
    field = _shared_field(found, known, pose_names, _mounting(triad, accelerometer))
    return TargetMagnetometer(triad, field, (*clipped, *_warnings(field)))


def _fit(
    known: ReferenceMagnetometer,
    felt: tuple[Rest, ...],
    track: MagneticTrack,
    figures: _core.TargetFigures,
) -> _core.TargetMagnetometerFigures:
    seen = known.rests
    spans = [
        (rest, (seen[rest].start, seen[rest].end), (felt[first].start, felt[last].end))
        for rest, first, last in figures["pairs"]
    ]
    force = np.array([seen[rest].specific_force for rest, _, _ in figures["pairs"]]).reshape(-1, 3)
    return _core.magnetometer_of_target(
        np.ascontiguousarray(known.track.time),
        np.ascontiguousarray(known.track.field),
        np.ascontiguousarray(track.time),
        np.ascontiguousarray(track.field),
        spans,
        force,
        known.uncertainty,
    )


def _none(why: str) -> TargetMagnetometer:
    return TargetMagnetometer(warnings=(NOT_CALIBRATED.format(why=why),))


def _reason(word: str, figures: dict[str, float]) -> str:
    found = count_of("rest", round(figures.get("found", 0)))
    return _REASONS[word].format(found=found, needed=figures.get("needed", 0))


def _shared_field(
    found: _core.TargetMagnetometerFigures,
    known: ReferenceMagnetometer,
    pose_names: dict[int, str],
    mounting: tuple[Parameter, ...],
) -> SharedField:
    strength, sigma = found["strength"]
    return SharedField(
        strength=strength,
        strength_sigma=sigma,
        calibrated_reference=known.calibrated,
        uncertainty=known.source,
        reference_bias=found["reference_bias"],
        reference_bias_sigma=found["reference_bias_sigma"],
        difference=found["difference"],
        mounting=mounting,
        rests=tuple(
            FieldAtRest(
                f"rest {rest + 1}" + (f": {pose_names[rest]}" if rest in pose_names else ""),
                field=field,
                deviation=deviation,
                sigma=spread,
                disturbance=_DISTURBANCES.get(disturbance, ""),
            )
            for (rest, deviation, spread, disturbance), field in zip(
                found["rests"], found["field"], strict=True
            )
        ),
    )


def _mounting(magnetometer: TriadResult, accelerometer: TriadResult | None) -> tuple[Parameter, ...]:
    """Returns the angles of the axes of a magnetometer against those of the accelerometer beside it."""
    triads = (magnetometer, accelerometer)
    if accelerometer is None or not all(triad and "matrix" in triad.estimated for triad in triads):
        return ()
    covariance = np.zeros((18, 18))
    for place, triad in ((0, magnetometer), (9, accelerometer)):
        total = triad.covariance if triad.inherited is None else triad.covariance + triad.inherited
        covariance[place : place + 9, place : place + 9] = total[:9, :9]

    def angles(change: FloatArray) -> FloatArray:
        turned = [
            factors(triad.M + part)[2]
            for triad, part in ((magnetometer, change[0]), (accelerometer, change[1]))
        ]
        return mounting_angles(turned[0] @ turned[1].T)

    steps = _STEP * np.eye(18).reshape(18, 2, 3, 3)
    jacobian = np.column_stack([(angles(step) - angles(-step)) / (2.0 * _STEP) for step in steps])  # eq. 52
    sigmas = np.sqrt(np.diag(jacobian @ covariance @ jacobian.T))
    values = angles(np.zeros((2, 3, 3)))
    return tuple(
        parameter(f"mounting on the accelerometer {axis}", "deg", float(value), float(sigma), np.inf)
        for axis, value, sigma in zip("xyz", values, sigmas, strict=True)
    )


def _warnings(field: SharedField) -> Iterator[str]:
    for why in _DISTURBANCES.values():
        rests = [rest.label for rest in field.rests if rest.disturbance == why]
        if rests:
            yield (
                f"magnetometer: {join(rests)} not used, as {why}: something magnetic was near, or a motor ran"
            )
    if field.difference is not None:
        size = float(np.linalg.norm(field.difference))
        yield (
            f"magnetometer: the field at the target differs from that at the reference by {size:.2g} uT "
            "across the field, which the fit includes; nothing separates the part along the field from "
            "scale, whose sigma includes as much: place both closer together, or farther from steel"
        )
    if not field.calibrated_reference:
        yield (
            "magnetometer: scale and soft iron are relative to the magnetometer of the reference, which has "
            "no calibration; give one with --reference-calibration"
        )


def with_magnetometer_option(
    options: dict[str, object], known: ReferenceMagnetometer | None
) -> dict[str, object]:
    """Returns the options of a batch with how the magnetometer of the reference was taken, if it has one."""
    if known is None:
        return options
    return {**options, "reference magnetometer": "calibrated" if known.calibrated else "as measured"}
