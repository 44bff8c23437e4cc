"""Results of the core for one spin: parameters with names and units, and warnings."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL, NOT_SHOWN, Parameter, Rest
from tumble.procedures.spin.preset import TurnPreset
from tumble.procedures.spin.result import (
    FULL_TURN,
    SMALLEST_DIRECTION,
    BiasEstimate,
    Spin,
    SpinBlocks,
    misfit,
)

NOTABLE_TILT = math.radians(5.0)
"""A robot on a steeper floor rolls, slips, and sinks into its springs on one side."""
USUAL_TILT = math.radians(1.0)
"""Tilt assumed for a floor that nobody has measured."""
NOTABLE_LEVER_ARM = 1.0
"""m; few robots are so large."""
NOTABLE_WANDERING = 1e-4
"""rad/s, 20 deg/h: bias instability does as much in any MEMS gyroscope."""
SLOW = 0.2
"""rad/s: below, a spin takes so long that the gyroscope's bias wanders, and the lever arm hardly shows."""
NOTABLE_SCALE = 0.03
"""Scale error of the gyroscope that no data sheet allows; twice as much would pass a range 5 % off."""
MOST = 0.5
"""Share of a variance beyond which a cause is most of it."""
CONTRADICTION = 5.0
"""Sigmas by which two results may differ before a warning."""


def describe_spin(
    figures: _core.SpinFigures,
    blocks: _core.SpinBlockFigures | None,
    rests: tuple[Rest, ...],
    span: tuple[float, float],
    *,
    label: str,
    gravity: float,
    gravity_sigma: float = 0.0,
    level_floor: bool,
    preset: TurnPreset,
    pace_sigma: float = 0.0,
    stamp_sigma: float = 0.0,
) -> Spin:
    """Describe one spin that lasted over `span`, s; `blocks` is None where no samples were kept.

    `pace_sigma` and `stamp_sigma` are those of its times, as `tumble.foundation.recording.Metadata` has them.
    `gravity_sigma`, m/s^2, is within the sigmas of the accelerometer bias, and not within the covariance.
    """
    figures = _with_uncertain_time(figures, pace_sigma, stamp_sigma)
    default = figures["level_free_is_default"]
    covariance, as_published = _published(figures, gravity, level_floor)
    level_free, published = (
        bias.with_gravity(figures["up"], gravity_sigma) for bias in (_level_free(figures), as_published)
    )
    objections = tuple(_about_the_turning_bias(figures, rests))
    return Spin(
        label=label,
        start=span[0],
        end=span[1],
        rests=rests,
        turned_clockwise=figures["turned_clockwise"],
        turned_counter_clockwise=figures["turned_counter_clockwise"],
        heading_span=figures["heading_span"],
        rate=figures["rate"],
        turning_time=figures["turning_time"],
        method="level-free" if default else "published",
        gyroscope_bias=_bias(figures["gyroscope_bias"]),
        level_free=level_free,
        published=published,
        up=figures["up"],
        parameters=tuple(_parameters(figures, level_free if default else published)),
        slow_turn=_parameter("slow turn at rest", "rad/s", figures["slow_turn"]),
        chi_square=figures["chi_square"],
        degrees_of_freedom=figures["degrees_of_freedom"],
        widening=figures["widening"],
        covariance=covariance,
        by_earth=figures["by_earth"],
        noise=figures["noise"],
        blocks=SpinBlocks(**blocks) if blocks else _no_blocks(),
        warnings=(
            *preset.departures(figures["turning_time"], figures["rate"], _turns(figures)),
            *_warnings(figures, gravity, level_floor),
            *_about_the_earth(figures),
            *_about_the_rests(figures, rests),
            *objections,
        ),
        objections=objections,
    )


def _with_uncertain_time(
    figures: _core.SpinFigures, pace_sigma: float, stamp_sigma: float
) -> _core.SpinFigures:
    """Add to the sigmas of scale and lever arm that of the times by which the gyroscope was integrated."""
    turned = figures["turned_clockwise"] + figures["turned_counter_clockwise"]
    if not turned or not (pace_sigma or stamp_sigma):
        return figures
    # The robot is late by one time as it gets up to its rate, and by another as it slows down.
    of_angle = math.sqrt(2.0) * stamp_sigma * figures["rate"] / turned
    share = math.hypot(pace_sigma, of_angle)

    def widened(scale: tuple[float, float]) -> tuple[float, float]:
        return scale[0], math.hypot(scale[1], share * (1.0 + scale[0]))  # spin.md, eq. 26

    arm = figures["lever_arm"]
    return {
        **figures,
        "heading_scale": widened(figures["heading_scale"]),
        "scale_clockwise": widened(figures["scale_clockwise"]),
        "scale_counter_clockwise": widened(figures["scale_counter_clockwise"]),
        "lever_arm_sigma": np.hypot(figures["lever_arm_sigma"], 2.0 * share * np.abs(arm)),  # spin.md, eq. 26
    }


def _turns(figures: _core.SpinFigures) -> float:
    return (figures["turned_clockwise"] + figures["turned_counter_clockwise"]) / FULL_TURN


def _bias(figures: _core.BiasFigures, reason: str = "") -> BiasEstimate:
    observed = figures["observed"]
    value = figures["value"] if observed else np.full(3, np.nan)
    sigma = figures["sigma"] if observed else np.full(3, np.inf)
    return BiasEstimate(value, sigma, observed, reason or ("" if observed else NOT_SHOWN))


def _level_free(figures: _core.SpinFigures) -> BiasEstimate:
    """Returns the level-free bias; with less than a turn, also its limits."""
    degrees = math.degrees(figures["heading_span"])
    if not figures["level_free"]["observed"]:
        return _bias(
            figures["level_free"],
            f"{degrees:.0f} deg of heading do not separate bias from the tilt of the floor",
        )
    if figures["heading_span"] >= FULL_TURN:
        return _bias(figures["level_free"])
    worst = float(figures["level_free"]["sigma"].max())
    return _bias(
        figures["level_free"], f"{degrees:.0f} deg of heading show it to {worst:.2g} m/s^2, no better"
    )


def _published(
    figures: _core.SpinFigures, gravity: float, level_floor: bool
) -> tuple[FloatArray, BiasEstimate]:
    """Returns the published bias, and the covariance of the result.

    Where it is the result for want of a full turn, and the floor is not stated to be level, its sigma carries
    the tilt the floor seems to have, or one that is usual.
    """
    published = _bias(figures["published"])
    covariance = np.array(figures["covariance"])
    if level_floor or figures["level_free_is_default"] or not published.observable:
        return covariance, published
    tilt, sigma = figures["floor_tilt"]
    tilt = math.hypot(tilt, sigma) if sigma < USUAL_TILT else USUAL_TILT
    across = np.eye(3) - np.outer(figures["up"], figures["up"])
    covariance[:3, :3] += (gravity * math.sin(tilt)) ** 2 * across
    widened = np.sqrt(np.diag(covariance)[:3])
    reason = f"found as on a level floor; its sigma includes a tilt of {math.degrees(tilt):.1f} deg"
    return covariance, BiasEstimate(published.value, widened, True, reason)


def _parameters(figures: _core.SpinFigures, force_bias: BiasEstimate) -> Iterator[Parameter]:
    rate_bias = _bias(figures["gyroscope_bias"])
    yield from _by_axis("gyroscope bias", "rad/s", rate_bias.value, rate_bias.sigma)
    yield from _by_axis("accelerometer bias", "m/s^2", force_bias.value, force_bias.sigma, force_bias.reason)
    yield _angle("mounting roll", figures["roll"])
    yield _angle("mounting pitch", figures["pitch"])
    few = "the heading changed too little to separate the tilt of the floor from bias"
    yield _angle("floor tilt", figures["floor_tilt"], few)
    flat = "the floor is too level to show an uphill direction"
    yield _angle("uphill bearing", figures["uphill_bearing"], flat)
    slow = "the robot turned too slowly or evenly to separate the lever arm from bias"
    yield from _by_axis("lever arm", "m", figures["lever_arm"], figures["lever_arm_sigma"], slow)
    unsaid = "the angle truly turned is not known; give it with --true-turns"
    level = "gravity changes too little with the heading to measure it"
    yield _scale("gyroscope scale about the axis", figures["heading_scale"], level)
    yield _scale("gyroscope scale clockwise", figures["scale_clockwise"], unsaid)
    yield _scale("gyroscope scale counter-clockwise", figures["scale_counter_clockwise"], unsaid)


def _by_axis(
    name: str, unit: str, values: FloatArray, sigmas: FloatArray, reason: str = NOT_SHOWN
) -> Iterator[Parameter]:
    for axis, value, sigma in zip("xyz", values, sigmas, strict=True):
        yield _parameter(f"{name} {axis}", unit, (float(value), float(sigma)), reason)


def _angle(name: str, figures: tuple[float, float], reason: str = NOT_SHOWN) -> Parameter:
    value, sigma = figures
    return _parameter(name, "deg", (math.degrees(value), math.degrees(sigma)), reason)


def _scale(name: str, error: tuple[float, float], reason: str) -> Parameter:
    """Describes a scale, which is 1 for a perfect gyroscope, by its error."""
    value, sigma = error
    return _parameter(name, "1", (1.0 + value, sigma), reason)


def _parameter(name: str, unit: str, figures: tuple[float, float], reason: str = NOT_SHOWN) -> Parameter:
    value, sigma = figures
    if not (math.isfinite(value) and math.isfinite(sigma)):
        return Parameter(name, unit, math.nan, math.inf, math.nan, math.nan, False, reason)
    half = INTERVAL * sigma
    return Parameter(name, unit, value, sigma, value - half, value + half)


def _no_blocks() -> SpinBlocks:
    nothing = np.empty(0)
    return SpinBlocks(
        nothing, nothing, nothing, nothing, np.empty((0, 2)), np.empty((0, 3)), np.empty((0, 3))
    )


def _warnings(figures: _core.SpinFigures, gravity: float, level_floor: bool) -> Iterator[str]:
    yield from _about_the_turn(figures, gravity)
    yield from _about_the_floor(figures, gravity, level_floor)
    yield from _about_the_scale(figures)
    arm = float(np.linalg.norm(figures["lever_arm"]))
    if arm > NOTABLE_LEVER_ARM:
        yield f"the IMU is {arm:.1f} m from the turning axis: did the robot drive a circle?"
    turn, turn_sigma = figures["slow_turn"]
    if figures["turned_while_still"]:
        yield (
            f"turned at {turn:.3g} +- {turn_sigma:.2g} rad/s while it seemed to stand still, as gravity "
            "shows; the gyroscope bias is corrected for that"
        )
    if figures["widening"] > 1.0:
        yield misfit(figures["chi_square"], figures["degrees_of_freedom"], figures["widening"])
    if (factor := figures.get("row_factor", 1.0)) > 1.0:
        yield (
            "residuals of the specific force go on while the robot turns, as on a floor that gives way, on a "
            "circle, or with a gyroscope that was read in another range: the sigmas of specific force are "
            f"{math.sqrt(factor):.1f} times those of independent noise"
        )
    ways = [figures["turned_clockwise"], figures["turned_counter_clockwise"]]
    if min(ways) < SMALLEST_DIRECTION and np.isfinite(figures["lever_arm_sigma"]).all():
        yield (
            "turned one way only: the lever arm is counted from the point about which the robot turned, and "
            f"wheels that slip by 1 cm/s move that point by {10.0 / figures['rate']:.2g} mm; turn both ways "
            "to show that"
        )


def _about_the_scale(figures: _core.SpinFigures) -> Iterator[str]:
    """Reports the largest scale error of the gyroscope that no sound one has, as no file will correct it."""
    shown = (figures["heading_scale"], figures["scale_clockwise"], figures["scale_counter_clockwise"])
    error, sigma = max(
        shown, key=lambda each: np.nan_to_num(abs(each[0]) - CONTRADICTION * each[1], nan=-1.0)
    )
    if abs(error) - CONTRADICTION * sigma > NOTABLE_SCALE:
        share = 100.0 * error
        yield (
            f"the gyroscope's scale is off by {share:+.2g} %, more than that of a sound one, and a spin "
            "corrects bias only: check its range, its unit and the sample rate, or run multipose, which "
            "finds the scale"
        )


def _about_the_earth(figures: _core.SpinFigures) -> Iterator[str]:
    """Reports a gyroscope bias that is known as well as the Earth's rotation, and the remedy."""
    up, by_earth = figures["up"], figures["by_earth"]
    covariance = np.array(figures["covariance"])[3:, 3:]
    along, all_along = (float(up @ each @ up) for each in (by_earth, covariance))
    across, all_across = (float(np.trace(by_earth)) - along, float(np.trace(covariance)) - all_along)
    vertical, level = along > MOST * all_along, across > MOST * all_across
    sigma = math.sqrt(max(along, 0.5 * across))
    if vertical and level:
        yield (
            f"the Earth's rotation makes most of the sigma of the gyroscope bias, {sigma:.2g} rad/s: give "
            "--latitude, and end at rest half a turn from where the robot began"
        )
    elif vertical:
        yield (
            "the Earth's rotation makes most of the sigma of the gyroscope bias along the vertical, "
            f"{sigma:.2g} rad/s: give --latitude"
        )
    elif level:
        yield (
            "the Earth's rotation makes most of the sigma of the gyroscope bias across the vertical, "
            f"{sigma:.2g} rad/s an axis: end at rest half a turn from where the robot began"
        )


def _about_the_rests(figures: _core.SpinFigures, rests: tuple[Rest, ...]) -> Iterator[str]:
    """Reports a change of the gyroscope's bias, unless a slow turn explains it."""
    if len(rests) < 2 or figures["turned_while_still"]:
        return
    rates = np.array([rest.angular_rate for rest in rests])
    sigmas = np.array([rest.angular_rate_sigma for rest in rests])
    apart = np.abs(rates[:, None] - rates[None])
    chance = CONTRADICTION * np.hypot(sigmas[:, None], sigmas[None])
    if (apart > chance + NOTABLE_WANDERING).any():
        yield (
            f"the gyroscope's bias drifted by {apart.max():.2g} rad/s between the rests, which its sigma "
            "does not include: let the unit warm up, or turn for a shorter time"
        )


def _about_the_turning_bias(figures: _core.SpinFigures, rests: tuple[Rest, ...]) -> Iterator[str]:
    """Reports a bias while turning that is not that of the rests, across the axis: a slow turn is along it.

    Rests that differ among themselves show how far the bias drifts from one to the next.
    """
    if len(rests) < 2 or not figures["gyroscope_bias"]["observed"]:
        return
    across = np.eye(3) - np.outer(figures["up"], figures["up"])
    rates = np.array([rest.angular_rate for rest in rests]) @ across
    sigmas = np.array([rest.angular_rate_sigma for rest in rests])
    apart = np.abs(rates.mean(axis=0) - across @ figures["gyroscope_bias"]["value"])
    of_mean = np.sqrt(np.sum(sigmas**2, axis=0)) / len(rests)
    chance = CONTRADICTION * np.hypot(of_mean, figures["gyroscope_bias"]["sigma"])
    if (apart > chance + NOTABLE_WANDERING + np.ptp(rates, axis=0)).any():
        yield (
            f"the gyroscope reads otherwise while it turns than at rest, by {apart.max():.2g} rad/s across "
            "the axis: it zeroes itself at rest, or has a dead band; its bias cannot be found from rests"
        )


def _about_the_turn(figures: _core.SpinFigures, gravity: float) -> Iterator[str]:
    """Describes limits of the accelerometer bias where the robot turned less than once."""
    if figures["heading_span"] < FULL_TURN:
        degrees = math.degrees(figures["heading_span"])
        level_free = figures["level_free"]
        known = (
            f"known to {float(level_free['sigma'].max()):.2g} m/s^2"
            if level_free["observed"]
            else "not shown at all"
        )
        advice = "turn once round or more"
        if figures["level_free_is_default"]:
            yield f"only {degrees:.0f} deg of a turn: the accelerometer bias is {known}; {advice}"
        else:
            yield (
                f"only {degrees:.0f} deg of a turn: level-free, the accelerometer bias is {known}; the "
                "published method, which is the result, holds on a level floor only, and errs by "
                f"{gravity * math.radians(1.0):.2g} m/s^2 for each degree of its tilt; {advice}"
            )
    if figures["rate"] < SLOW:
        yield (
            f"turned at {figures['rate']:.2g} rad/s: at so low a rate the gyroscope's bias drifts meanwhile, "
            "and the lever arm hardly shows; about 1 rad/s is good"
        )


def _about_the_floor(figures: _core.SpinFigures, gravity: float, level_floor: bool) -> Iterator[str]:
    tilt, sigma = figures["floor_tilt"]
    if not (math.isfinite(tilt) and math.isfinite(sigma)):
        return
    if tilt > NOTABLE_TILT:
        yield f"the floor tilts by {math.degrees(tilt):.1f} deg; find a more level place"
    gap = np.abs(figures["level_free"]["value"] - figures["published"]["value"])
    both = np.hypot(figures["level_free"]["sigma"], figures["published"]["sigma"])
    contradicted = tilt > CONTRADICTION * sigma and bool((gap > CONTRADICTION * both).any())
    if level_floor and contradicted:
        yield (
            f"the floor tilts by {math.degrees(tilt):.2f} +- {math.degrees(sigma):.1g} deg, which adds "
            f"{gravity * math.sin(tilt):.2g} m/s^2 to the accelerometer bias of --level-floor; leave it out"
        )
