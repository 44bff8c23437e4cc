"""Why a spin failed, in words a user can act on: the same on a robot's live stream as in its log."""

from __future__ import annotations

import math
from collections.abc import Mapping

CHANNELS = (
    "accelerometer x",
    "accelerometer y",
    "accelerometer z",
    "gyroscope x",
    "gyroscope y",
    "gyroscope z",
)


def in_words(kind: str, figures: Mapping[str, float]) -> str:
    """One line: what is wrong and what to do.

    `kind` and `figures` are those of `SpinMachine.failure`, or the arguments of a `CoreError` of `fit_spin`:
    SI units, times in s of the clock of the samples.
    """
    return {
        "never still": _never_still,
        "turned too little": _turned_too_little,
        "not one axis": _not_one_axis,
        "lifted": _lifted,
        "saturated": _saturated,
        "floor too steep": _floor_too_steep,
        "sample rate too low": _sample_rate_too_low,
        "stream stopped": _stream_stopped,
        "samples missing": _samples_missing,
        "no rest": _no_rest,
        "no turn": _no_turn,
        "unsolvable": _unsolvable,
    }[kind](figures)


def _never_still(figures: Mapping[str, float]) -> str:
    return (
        f"did not stand still long enough in {figures['waited']:.0f} s; stop the robot and whatever shakes "
        "it, and begin again"
    )


def _turned_too_little(figures: Mapping[str, float]) -> str:
    return (
        f"turned only {_angle(figures['turned'])}, {_angle(figures['wanted'])} were asked for; "
        "turn on, in either direction or in both"
    )


def _not_one_axis(figures: Mapping[str, float]) -> str:
    return (
        f"turned about more than one axis at {figures['time']:.1f} s: {figures['across']:.2g} rad/s across "
        f"the turning axis, {figures['limit']:.2g} are allowed; turn on an even floor, without sills, and do "
        "not tip or lift the robot"
    )


def _lifted(figures: Mapping[str, float]) -> str:
    return (
        f"was lifted, dropped or pushed at {figures['time']:.1f} s: specific force changed by "
        f"{figures['change']:.2g} m/s^2, turning explains {figures['limit']:.2g}; leave the robot on its "
        "wheels and begin again"
    )


def _saturated(figures: Mapping[str, float]) -> str:
    channel = int(figures["channel"])
    si, remedy = (
        ("m/s^2", "stop what shakes it, turn more slowly") if channel < 3 else ("rad/s", "turn more slowly")
    )
    return (
        f"{CHANNELS[channel]} is saturated at {figures['value']:.4g} {si}, first at {figures['time']:.1f} s; "
        f"{remedy} or choose a larger range"
    )


def _floor_too_steep(figures: Mapping[str, float]) -> str:
    tilt, limit = math.degrees(figures["tilt"]), math.degrees(figures["limit"])
    return f"the floor tilts by {tilt:.1f} deg, {limit:.1f} deg are allowed; find a more level place"


def _sample_rate_too_low(figures: Mapping[str, float]) -> str:
    return (
        f"{figures['rate']:.3g} samples a second are too few for a turn this fast, {figures['needed']:.3g} "
        "are needed; log faster or turn more slowly"
    )


def _stream_stopped(figures: Mapping[str, float]) -> str:
    return (
        f"samples stopped at {figures['time']:.1f} s, {figures['gap']:.2g} s went by without one; mend the "
        "connection and begin again"
    )


def _samples_missing(figures: Mapping[str, float]) -> str:
    return (
        f"samples are missing for {figures['gap']:.2g} s at {figures['time']:.1f} s, so the angle turned is "
        "not known; mend the logger or the connection and begin again"
    )


def _no_rest(_: Mapping[str, float]) -> str:
    return "shows no rest beside the turn; let the robot stand still for 5 s, then turn on the spot"


def _no_turn(figures: Mapping[str, float]) -> str:
    turned = figures.get("turned", 0.0)
    seen = f"turned only {_angle(turned)}" if abs(turned) >= math.radians(1.0) else "did not turn"
    return f"{seen}; after the rest, turn on the spot once round or more"


def _unsolvable(_: Mapping[str, float]) -> str:
    return "no solution: the samples hold values that are not numbers, or no noise at all; check the sensor"


def _angle(radians: float) -> str:
    """Degrees up to a full turn, turns beyond."""
    degrees = abs(math.degrees(radians))
    return f"{degrees:.0f} deg" if degrees < 359.5 else f"{degrees / 360.0:.2f} turns"
