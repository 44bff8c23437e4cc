"""Results of the reference: its biases, its mounting angle, and the errors of the table."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import rejected_rests_of, rests_of, scale_notice, trace_of
from tumble.acquisition.imu import Imu, known, log_name
from tumble.acquisition.notices import notices
from tumble.calibration.document import Calibration, CertificateOfReference
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of
from tumble.procedures.turntable.matching import PoseMatch
from tumble.procedures.turntable.messages import drift_words
from tumble.procedures.turntable.result import MountingResult, PoseResult, ReferenceResult, UncertaintySources

NOTABLE_NORM_RESIDUAL = 0.005
"""m/s^2: what WGS 84 leaves of local gravity in mountains is less; standard gravity errs up to 0.027."""


REFERENCE_BIAS = 0.1
"""deg/s: bias of the gyroscope of a reference, as the core assumes it where no rest shows it."""


def reference_result(
    unit: Imu,
    fitted: _core.Reference,
    match: PoseMatch,
    applied: Calibration | None,
    uncertainty: UncertaintySources,
    certificate: CertificateOfReference | None = None,
) -> ReferenceResult:
    """Describes the reference; `applied` is the calibration that was applied to it."""
    figures, mounting = fitted.figures, mounting_result(fitted)
    return ReferenceResult(
        name=unit.name,
        source=log_name(unit.recording),
        serial=unit.recording.metadata.serial,
        calibration_hash=applied.hash() if applied else "",
        bias=figures["bias"],
        bias_sigma=figures["bias_sigma"],
        norm_residual=figures["norm_residual"],
        gyroscope_bias=known(figures["gyroscope_bias"], "gyroscope", unit.triads),
        gyroscope_bias_sigma=known(figures["gyroscope_bias_sigma"], "gyroscope", unit.triads),
        rests=rests_of(unit.acquired, match.names, unit.triads) + rejected_rests_of(unit.acquired),
        trace=trace_of(unit.acquired, unit.triads),
        mounting=mounting,
        mounting_reason="" if mounting else match.reason or "the poses do not determine a rotation",
        temperature=unit.acquired.temperature,
        missing_samples=unit.acquired.missing,
        log=unit.log,
        uncertainty=uncertainty,
        certificate=certificate,
    )


def mounting_result(fitted: _core.Reference) -> MountingResult | None:
    """Returns the mounting angle of the reference; `None` where the poses did not show it."""
    figures = fitted.figures
    if "R_e" not in figures:
        return None
    return MountingResult(
        np.degrees(figures["rotation_vector"]), np.degrees(figures["rotation_sigma"]), figures["R_e"]
    )


def reference_warnings(
    unit: Imu,
    fitted: _core.Reference,
    gravity: float,
    gravity_source: str,
    applied: Calibration | None,
    *,
    by_table: bool = False,
) -> Iterator[str]:
    """Describes irregularities of the reference; `gravity` and its source are those of `local_gravity`.

    `by_table` is true if the commanded rates are the truth of gyroscopes.
    """
    for notice in (*notices(unit), *scale_notice(unit.acquired, gravity)):
        yield f"{unit.name}: {notice}"
    yield from _unclear_rests(unit, by_table=by_table)
    yield from _rates_apart(unit)
    figures = fitted.figures
    if "drift" in figures:
        yield (
            f"{unit.name}: its accelerometer biases drifted over the session "
            f"{drift_words(figures['drift'])}, as the length of gravity at its rests shows: the targets are "
            "calibrated against it without that; let the reference warm up first"
        )
    if figures["excess"] > 1.0 and figures["norm_residual"] > NOTABLE_NORM_RESIDUAL:
        yield (
            f"{unit.name}: |f| deviates from {gravity:.6g} m/s^2 by {figures['norm_residual']:.2g} "
            f"m/s^2, {math.sqrt(figures['excess']):.0f} times what its noise explains, and the sigmas of "
            f"the targets include that: {_remedy(gravity_source, applied)}"
        )


def _unclear_rests(unit: Imu, *, by_table: bool) -> Iterator[str]:
    """Describes the loss for targets without a rest among constant rates."""
    if len(unit.acquired.rest_times) or not unit.acquired.constant_rates:
        return
    slow = [rate for *_, kind, rate, _ in unit.acquired.constant_rates if kind == "unclear"]
    fastest = math.degrees(max((float(np.linalg.norm(rate)) for rate in slow), default=0.0))
    unclear = (
        f"; turning at up to {fastest:.2g} deg/s cannot be told from rest with one line of gravity"
        if slow
        else ""
    )
    relative = (
        ""
        if by_table
        else ", and biases of gyroscopes are relative to the reference's, which is taken to be zero within "
        f"{REFERENCE_BIAS:g} deg/s"
    )
    yield (
        f"{unit.name}: no rest was found among {count_of('constant rate', len(unit.acquired.constant_rates))}"
        f"{unclear}: accelerometers are not calibrated{relative}; hold at least two poses still, "
        "about different axes, for 5 s or longer"
    )


def _rates_apart(unit: Imu) -> Iterator[str]:
    """Reports constant rates that no clock joins, which gyroscopes are not fitted to."""
    turning = sum(kind == "constant" for *_, kind, _, _ in unit.acquired.constant_rates)
    if unit.recording.parts and turning:
        yield (
            f"{unit.name}: {count_of('constant rate', turning)} in files of their own, which gyroscopes are "
            "not fitted to: the time from one file to the next is not known; record all rates in one file"
        )


def _remedy(gravity_source: str, applied: Calibration | None) -> str:
    """Describes missing options to give, and stated ones to check."""
    known = {
        "standard": "give the local gravity with --latitude and --height or --gravity",
        "given": "check the value of --gravity",
    }
    gravity = known.get(gravity_source, "check --latitude and --height, or give a measured --gravity")
    if applied is None:
        return f"{gravity}, or give the calibration of the reference with --reference-calibration"
    return f"{gravity}, or calibrate the reference anew: its calibration does not explain its readings"


def pose_results(match: PoseMatch, fitted: _core.Reference) -> tuple[PoseResult, ...]:
    """Returns the error of the table at each pose; repeats of a pose share one result, their mean."""
    figures = fitted.figures
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
