"""Why a spin failed, in words a user can act on: the same on a robot's live stream as in its log."""

from __future__ import annotations

import math
from collections.abc import Callable

from tumble.acquisition.messages import REST_REJECTIONS
from tumble.foundation.results import Figures
from tumble.procedures.spin.failure import SpinFailure, SpinFailureKind
from tumble.procedures.spin.result import FULL_TURN

CHANNELS = (
    "accelerometer x",
    "accelerometer y",
    "accelerometer z",
    "gyroscope x",
    "gyroscope y",
    "gyroscope z",
)
SMALLEST_SHOWN = math.radians(1.0)
"""Angle below which a robot is reported as not turned."""


def explain(failure: SpinFailure) -> str:
    """One line: the fault and, where there is one, the remedy."""
    why, to_do = cause(failure), remedy(failure)
    return f"{why}; {to_do}" if to_do else why


def cause(failure: SpinFailure) -> str:
    """Describes the error, without the remedy."""
    return MESSAGES[failure.kind](failure.figures)[0]


def remedy(failure: SpinFailure) -> str:
    """Describes the remedy; empty where it is obvious."""
    return MESSAGES[failure.kind](failure.figures)[1]


def _no_turn(figures: Figures) -> tuple[str, str]:
    turned = figures.get("turned", 0.0)
    seen = f"turned only {_angle(turned)}" if abs(turned) >= SMALLEST_SHOWN else "did not turn"
    return seen, "after the rest, turn on the spot once round or more"


def _saturated(figures: Figures) -> tuple[str, str]:
    channel = int(figures["channel"])
    si, remedy = (
        ("m/s^2", "stop what shakes it, turn more slowly") if channel < 3 else ("rad/s", "turn more slowly")
    )
    return (
        f"{CHANNELS[channel]} is saturated at {figures['value']:.4g} {si}, first at {figures['time']:.1f} s",
        f"{remedy} or choose a larger range",
    )


def _miscounted(figures: Figures) -> tuple[str, str]:
    direction = "clockwise" if figures["clockwise"] else "counter-clockwise"
    return (
        f"turned {figures['turned'] / FULL_TURN:.2f} times {direction} by its gyroscope, truly "
        f"{figures['true'] / FULL_TURN:g} times by --true-turns",
        "count again, or correct the unit with --gyroscope-unit",
    )


MESSAGES: dict[SpinFailureKind, Callable[[Figures], tuple[str, str]]] = {
    SpinFailureKind.NEVER_STILL: lambda figures: (
        f"did not stand still long enough in {figures['waited']:.0f} s",
        "stop the robot and whatever shakes it, and start again",
    ),
    SpinFailureKind.NO_REST: lambda _: (
        "shows no rest before or after the turn",
        "let the robot stand still for 5 s, then turn on the spot",
    ),
    SpinFailureKind.NO_TURN: _no_turn,
    SpinFailureKind.TURNED_TOO_LITTLE: lambda figures: (
        f"turned only {_angle(figures['turned'])}, {_angle(figures['wanted'])} were asked for",
        "turn further, in either direction or in both",
    ),
    SpinFailureKind.NOT_ONE_AXIS: lambda figures: (
        f"turned about more than one axis at {figures['time']:.1f} s: {figures['across']:.2g} rad/s across "
        f"the turning axis, {figures['limit']:.2g} are allowed",
        "turn on an even floor, without sills, and do not tip or lift the robot",
    ),
    SpinFailureKind.LIFTED: lambda figures: (
        f"was lifted, dropped or pushed at {figures['time']:.1f} s: specific force changed by "
        f"{figures['change']:.2g} m/s^2, turning explains {figures['limit']:.2g}",
        "leave the robot on its wheels and start again",
    ),
    SpinFailureKind.SATURATED: _saturated,
    SpinFailureKind.FLOOR_TOO_STEEP: lambda figures: (
        f"the floor tilts by {math.degrees(figures['tilt']):.1f} deg, "
        f"{math.degrees(figures['limit']):.1f} deg are allowed",
        "find a more level place",
    ),
    SpinFailureKind.SAMPLE_RATE_TOO_LOW: lambda figures: (
        f"{figures['rate']:.3g} samples a second are too few for a turn this fast, {figures['needed']:.3g} "
        "are needed",
        "log faster or turn more slowly",
    ),
    SpinFailureKind.STREAM_STOPPED: lambda figures: (
        f"samples stopped at {figures['time']:.1f} s, {figures['gap']:.2g} s passed without one",
        "repair the connection and start again",
    ),
    SpinFailureKind.SAMPLES_MISSING: lambda figures: (
        f"samples are missing for {figures['gap']:.2g} s at {figures['time']:.1f} s, so the angle turned is "
        "not known",
        "repair the logger or the connection and start again",
    ),
    SpinFailureKind.UNSOLVABLE: lambda _: (
        "no solution: the samples hold values that are not numbers, or no noise at all",
        "check the sensor",
    ),
    SpinFailureKind.VIBRATING: lambda _: (f"is not a rest: {REST_REJECTIONS['vibrating']}", ""),
    SpinFailureKind.DRIFTING: lambda _: (f"is not a rest: {REST_REJECTIONS['drifting']}", ""),
    SpinFailureKind.TURNING: lambda _: (f"is not a rest: {REST_REJECTIONS['turning']}", ""),
    SpinFailureKind.NO_REST_FOR_LONG: lambda figures: (
        f"drove or was moved for {figures['duration']:.0f} s without a rest",
        "if it turned on the spot, give its times with --at",
    ),
    SpinFailureKind.BIAS_CHANGED: lambda figures: (
        f"rests at {figures['start']:.1f} to {figures['end']:.1f} s, where gyroscope bias "
        f"{'xyz'[int(figures['axis'])]} differs by {abs(figures['change']):.2g} rad/s from that of the other "
        "rests: it changed, or the robot turned slowly",
        "let the sensor warm up, and keep drivers from calibrating it on the way",
    ),
    SpinFailureKind.MOVED_FIRST: lambda _: ("moved before it had stood still", "stand still first"),
    SpinFailureKind.PUSHED: lambda figures: (
        f"drove or was pushed: turned only {math.degrees(figures['turned']):.0f} deg in "
        f"{figures['duration']:.1f} s",
        "",
    ),
    SpinFailureKind.TIPPED: lambda figures: (
        f"was tipped, lifted or carried: {figures['across']:.2g} rad/s across the vertical",
        "",
    ),
    SpinFailureKind.DROVE: lambda figures: (
        f"drove: reached about {figures['speed']:.1f} m/s",
        "stay on the spot"
        if figures["named"]
        else "stay on the spot, or give the times of the spin with --at",
    ),
    SpinFailureKind.DROVE_A_CIRCLE: lambda figures: (
        f"drove a circle of {figures['radius']:.1f} m radius",
        "turn on the spot, or give the times of the spin with --at",
    ),
    SpinFailureKind.RESTED_TOO_SHORTLY: lambda figures: (
        f"stood still for {figures['longest']:.1f} s at most, {figures['wanted']:g} s are asked for",
        "stand still longer before the turn, or ask for less with --still",
    ),
    SpinFailureKind.DEGREES_FOR_RADIANS: lambda figures: (
        f"turned at {figures['rate']:.0f} rad/s, which no robot does: deg/s were taken for rad/s",
        "give --gyroscope-unit deg/s",
    ),
    SpinFailureKind.MISCOUNTED: _miscounted,
}


def _angle(radians: float) -> str:
    """Degrees up to a full turn, turns beyond."""
    degrees = abs(math.degrees(radians))
    return f"{degrees:.0f} deg" if degrees < 359.5 else f"{degrees / 360.0:.2f} turns"
