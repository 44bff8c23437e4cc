"""Figures of the core as the result of an alignment: parameters with sigmas, and what to beware of."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tumble import _core
from tumble.foundation.log_time import LogTime
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL, Parameter
from tumble.foundation.words import count_of
from tumble.procedures.align.result import UnitAlignment

LARGEST_ARM_SIGMA = 0.3
"""m; with a larger sigma a lever arm is not observable."""
LARGEST_BIAS_SIGMA = {"gyroscope": 0.1, "accelerometer": 1.0}
"""rad/s and m/s^2, likewise."""
JUMPED = "no line leads through the offsets of parts of the motion: a clock was set"
SHOWN = 5.0
"""Sigmas from which on something that should be zero is remarked upon."""
NOTABLE_ANGLE = math.radians(0.5)
"""rad between accelerometers and gyroscopes that is worth a remark."""
NOTABLE_DELAY = 2e-4
"""s, likewise."""
ONE_AXIS = "the units turned about one axis only, {}"
TURN_MORE = "turn the units about two axes or more"


def describe_alignment(
    name: str, source: str, figures: _core.AlignFigures, around: float, time: LogTime, rate: float
) -> UnitAlignment:
    """Puts into a result what the core found; `around` is the offset, s, that the search began with.

    `time` is the clock of the primary, `rate` the sample rate of the slower unit, Hz.
    """
    rotation_seen = len(figures["rotation_unseen"]) == 0
    forces = figures["forces"] or _no_forces()
    arm_sigma = np.sqrt(np.diag(forces["lever_arm_covariance"]))
    unknown, jumped = np.full(3, np.nan), figures["jumped"]
    return UnitAlignment(
        name=name,
        source=source,
        sensor_from_primary=figures["sensor_from_primary"] if rotation_seen else None,
        rotation_vector=figures["rotation_vector"] if rotation_seen else unknown,
        rotation_covariance=figures["rotation_vector_covariance"],
        rotation_unseen=figures["rotation_unseen"],
        rotation_from_accelerometers=figures["completed"],
        time_offset=figures["time_offset"],
        time_offset_sigma=figures["time_offset_sigma"] if jumped is None else math.inf,
        skew=_skew(figures)[0],
        skew_sigma=_skew(figures)[1] if jumped is None else math.inf,
        reference_time=figures["reference_time"],
        lever_arm=_if_shown(forces["lever_arm"], arm_sigma, LARGEST_ARM_SIGMA),
        lever_arm_covariance=forces["lever_arm_covariance"],
        lever_arm_unseen=forces["lever_arm_unseen"],
        gyroscope_bias=_if_shown(
            figures["gyroscope_bias"], figures["gyroscope_bias_sigma"], LARGEST_BIAS_SIGMA["gyroscope"]
        ),
        gyroscope_bias_sigma=figures["gyroscope_bias_sigma"],
        accelerometer_bias=_if_shown(
            forces["accelerometer_bias"],
            forces["accelerometer_bias_sigma"],
            LARGEST_BIAS_SIGMA["accelerometer"],
        ),
        accelerometer_bias_sigma=forces["accelerometer_bias_sigma"],
        accelerometer_angle=forces["accelerometer_angle"],
        accelerometer_angle_sigma=forces["accelerometer_angle_sigma"],
        gyroscope_residual=figures["gyroscope_residual"],
        accelerometer_residual=forces["accelerometer_residual"],
        correlation=figures["correlation"],
        motion=figures["motion"],
        window=figures["window"],
        pairs=figures["pairs"],
        parameters=tuple(_parameters(figures)),
        warnings=tuple(_warnings(figures, around, time, rate)),
    )


def _if_shown(value: FloatArray, sigma: FloatArray, limit: float) -> FloatArray:
    """Puts NaN for what is less certain than a limit."""
    shown: FloatArray = np.where(sigma < limit, value, np.nan)
    return shown


def _parameters(figures: _core.AlignFigures) -> Iterator[Parameter]:
    yield from _rotation(figures)
    if figures["jumped"] is None:
        yield _parameter("time offset", "s", figures["time_offset"], figures["time_offset_sigma"])
        yield _parameter("clock skew", "1", *_skew(figures))
    else:
        yield _unknown("time offset", "s", JUMPED)
        yield _unknown("clock skew", "1", JUMPED)
    forces = figures["forces"] or _no_forces()
    yield from _lever_arm(forces)
    yield from _bias("gyroscope", "rad/s", figures["gyroscope_bias"], figures["gyroscope_bias_sigma"])
    yield from _bias(
        "accelerometer", "m/s^2", forces["accelerometer_bias"], forces["accelerometer_bias_sigma"]
    )


def _rotation(figures: _core.AlignFigures) -> Iterator[Parameter]:
    unseen = figures["rotation_unseen"]
    sigma = np.sqrt(np.diag(figures["rotation_vector_covariance"]))
    for k, axis in enumerate("xyz"):
        if len(unseen):
            why = ONE_AXIS.format(_direction(unseen[0], "of the secondary"))
            yield _unknown(f"rotation {axis}", "deg", f"{why}; {TURN_MORE}")
        else:
            value = math.degrees(figures["rotation_vector"][k])
            yield _parameter(f"rotation {axis}", "deg", value, math.degrees(sigma[k]))


def _skew(figures: _core.AlignFigures) -> tuple[float, float]:
    """Returns the skew with its sigma: one clock does not drift apart from itself."""
    return (0.0, 0.0) if figures["one_clock"] else (figures["skew"], figures["skew_sigma"])


def _lever_arm(forces: _core.AlignForceFigures) -> Iterator[Parameter]:
    unseen = forces["lever_arm_unseen"]
    sigma = np.sqrt(np.diag(forces["lever_arm_covariance"]))
    for k, axis in enumerate("xyz"):
        name = f"lever arm {axis}"
        if sigma[k] < LARGEST_ARM_SIGMA:
            yield _parameter(name, "m", forces["lever_arm"][k], sigma[k])
        elif len(unseen) == 3:
            yield _unknown(name, "m", f"it depends on a rotation that was not shown; {TURN_MORE}")
        elif len(unseen) == 1:
            why = ONE_AXIS.format(_direction(unseen[0], "of the primary"))
            yield _unknown(name, "m", f"{why}, along which a lever arm has no effect; {TURN_MORE}")
        else:
            yield _unknown(name, "m", "the units turned too slowly to show it; turn them faster")


def _no_forces() -> _core.AlignForceFigures:
    """Returns figures without information."""
    unknown, everywhere = np.full(3, np.nan), np.full(3, np.inf)
    return {
        "lever_arm": unknown,
        "lever_arm_covariance": np.where(np.eye(3) > 0.0, np.inf, np.nan),
        "lever_arm_unseen": np.eye(3),
        "accelerometer_bias": unknown,
        "accelerometer_bias_sigma": everywhere,
        "accelerometer_angle": unknown,
        "accelerometer_angle_sigma": everywhere,
        "accelerometer_delay": math.nan,
        "accelerometer_delay_sigma": math.inf,
        "accelerometer_stretch": np.full((3, 3), np.nan),
        "accelerometer_residual": math.nan,
        "changed": None,
    }


def _bias(triad: str, unit: str, value: FloatArray, sigma: FloatArray) -> Iterator[Parameter]:
    for k, axis in enumerate("xyz"):
        name = f"{triad} bias {axis}"
        if sigma[k] < LARGEST_BIAS_SIGMA[triad]:
            yield _parameter(name, unit, value[k], sigma[k])
        else:
            yield _unknown(name, unit, f"it depends on a rotation that was not shown; {TURN_MORE}")


def _parameter(name: str, unit: str, value: float, sigma: float) -> Parameter:
    half = INTERVAL * sigma
    return Parameter(name, unit, float(value), float(sigma), float(value - half), float(value + half))


def _unknown(name: str, unit: str, reason: str) -> Parameter:
    nan = math.nan
    return Parameter(name, unit, nan, math.inf, nan, nan, observable=False, reason=reason)


def _direction(axis: FloatArray, of: str) -> str:
    """Names a direction; an axis has no sign, so its largest component is given as positive."""
    # Adding zero makes a zero of the negative zero that rounding leaves.
    shown = np.round(axis * np.sign(axis[np.argmax(np.abs(axis))]), 2) + 0.0
    return f"({', '.join(f'{component:.2f}' for component in shown)}) {of}"


def _about_widening(figures: _core.AlignFigures, rate: float) -> str:
    forces = figures["forces"] or _no_forces()
    angle = math.degrees(float(np.linalg.norm(forces["accelerometer_angle"])))
    scale = 100.0 * float(np.abs(np.diag(forces["accelerometer_stretch"])).max())
    return (
        f"the accelerometers would be turned by {angle:.1f} deg against the gyroscopes and differ by "
        f"{scale:.1f} % in scale, as no sound units are: all sigmas are widened "
        f"{figures['widened']:.1f} times; "
        f"vibration above half the sample rate of {rate:.4g} Hz looks like motion: log faster, or turn the "
        "units by hand"
    )


def _warnings(figures: _core.AlignFigures, around: float, time: LogTime, rate: float) -> Iterator[str]:
    if around:
        yield (f"the logs have no time in common; their beginnings were aligned, {around:.3f} s apart")
    if figures["widened"] > 1.0:
        yield _about_widening(figures, rate)
    if figures["completed"]:
        yield "the units turned about one axis only; the rotation about it is what the accelerometers show"
    for whose in ("primary", "secondary"):
        saturated = figures["primary_saturated" if whose == "primary" else "secondary_saturated"]
        if saturated:
            yield f"left out {count_of('sample', saturated)} of the {whose} at the end of its range"
    yield from _changes(figures, time)
    if (jump := figures["jumped"]) is not None:
        yield (
            f"the offset jumps by about {1e3 * jump:.3g} ms in the course of the log: a clock was set, or "
            "stamps are wrong; cut the log there, and align each part"
        )
    elif not figures["one_clock"] and abs(figures["skew"]) > SHOWN * figures["skew_sigma"]:
        yield (
            f"the clocks drift apart by {1e6 * figures['skew']:.1f} ppm: the offset holds at "
            f"{time.at(figures['reference_time'])} from the start of the primary's log"
        )
    if figures["forces"] is not None and figures["widened"] == 1.0:
        yield from _force_warnings(figures["forces"], figures["completed"])


def _changes(figures: _core.AlignFigures, time: LogTime) -> Iterator[str]:
    """Remarks on what is to be constant and took a step (docs/theory/align.md, eq. 10)."""
    if (step := figures["changed"]) is not None:
        size, at = np.array(step["size"]), time.at(step["time"])
        turned, later = math.degrees(float(np.linalg.norm(size[:3]))), 1e3 * float(size[3])
        yield (
            f"from {at} on the rotation differs by about {turned:.2g} deg, and the time offset by "
            f"{later:.2g} ms, from those before: the unit slipped, its clock was set, or the motion is of "
            "another kind; the sigmas include that; cut the log there"
        )
    forces = figures["forces"]
    if forces is not None and (step := forces["changed"]) is not None:
        size, at = np.array(step["size"]), time.at(step["time"])
        arm = 1e3 * float(np.linalg.norm(size))
        yield (
            f"from {at} on the lever arm differs by about {arm:.2g} mm from that before; the sigmas include "
            "that; cut the log there"
        )


def _force_warnings(forces: _core.AlignForceFigures, one_axis: bool) -> Iterator[str]:
    """Remark on accelerometers that do not sit as the gyroscopes do, or are later."""
    angle, sigma = forces["accelerometer_angle"], forces["accelerometer_angle_sigma"]
    length = float(np.linalg.norm(angle))
    if not one_axis and length > NOTABLE_ANGLE and length > SHOWN * float(np.max(sigma)):
        yield (
            f"the rotation between the accelerometers differs by {math.degrees(length):.2f} deg from that "
            "between the gyroscopes"
        )
    delay, delay_sigma = forces["accelerometer_delay"], forces["accelerometer_delay_sigma"]
    if abs(delay) > NOTABLE_DELAY and abs(delay) > SHOWN * delay_sigma:
        yield (
            f"the time offset of the accelerometers differs by {1e3 * delay:.2f} ms from that of the "
            "gyroscopes"
        )
