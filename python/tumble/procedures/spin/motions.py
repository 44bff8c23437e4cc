"""Motion of a robot between two rests, judged by its gyroscope: whether it may be a turn on the spot."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tumble.acquisition.acquire import si_unit
from tumble.acquisition.imu import ChannelFault
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Rest
from tumble.procedures.spin.failure import SpinFailure, SpinFailureKind
from tumble.procedures.spin.messages import CHANNELS
from tumble.procedures.spin.segments import Segment

SMALLEST_PART = math.radians(10.0)
"""A robot that stops between turns at least so far at a time."""
SMALLEST_SPIN = math.radians(45.0)
NUDGE_SECONDS, NUDGE_ANGLE, NUDGE_SPEED = 1.0, math.radians(2.0), 0.1
"""s, rad and m/s: what is shorter, and turns and pushes less, leaves the robot where it was."""
FEWEST_SAMPLES = 12
"""Number of samples below which a motion is the edge of a rest: the segmenter omits ten samples or 0.05 s."""
BLOCK_SECONDS = 0.1
PAUSE_SECONDS, PAUSE_SHARE, SLOWEST_TURN = 0.5, 0.3, 0.05
"""s, share of the fastest, and rad/s: whoever turns more slowly for as long has stopped to turn."""
SMALLEST_RANGE = {"m/s^2": 15.0, "rad/s": 0.5}
"""No accelerometer or gyroscope on a robot has less; a coarse one may show a smaller value throughout."""
LARGEST_RATE = 20.0
"""rad/s: three times round in a second."""
LARGEST_ACROSS = 0.5
"""Angular rate across the vertical against that about it, root mean square: what is more was no turn."""


def credible_faults(faults: Sequence[ChannelFault]) -> tuple[ChannelFault, ...]:
    """Omits readings that pile up at the smallest value of a robot that turned one way only."""
    return tuple(
        fault
        for fault in faults
        if fault.kind == "stuck" or abs(fault.value) > SMALLEST_RANGE[si_unit(fault.channel)]
    )


def motion_failure(
    motion: Segment, beside: Rest, faults: Sequence[ChannelFault], given: bool
) -> SpinFailure | None:
    """Returns why a motion cannot be part of a spin; None if it can. `beside` is a rest next to it."""
    saturated = _saturated(motion, faults)
    if saturated or given or is_nudge(motion, beside):
        return saturated
    about, across = _rates(motion, beside)
    turned = turned_about(motion, beside)
    wobbled = _rms(across) > LARGEST_ACROSS * _rms(about)
    if turned < SMALLEST_PART or (wobbled and _rms(across) < SLOWEST_TURN):
        duration = motion.end - motion.start
        return SpinFailure(SpinFailureKind.PUSHED, {"turned": turned, "duration": duration})
    if _rms(about) > LARGEST_RATE:
        return SpinFailure(SpinFailureKind.DEGREES_FOR_RADIANS, {"rate": _rms(about)})
    if wobbled:
        return SpinFailure(SpinFailureKind.TIPPED, {"across": _rms(across)})
    return None


def is_nudge(motion: Segment, beside: Rest) -> bool:
    """Returns whether a motion left the robot in place, such as a knock or the start of a motor."""
    seconds = motion.end - motion.start
    if seconds > NUDGE_SECONDS:
        return False
    about, across = _rates(motion, beside)
    push = motion.samples.accelerometer.mean(axis=0) - beside.specific_force
    return (
        float(np.hypot(about, across).sum()) * BLOCK_SECONDS < NUDGE_ANGLE
        and float(np.linalg.norm(push)) * seconds < NUDGE_SPEED
    )


def first_turn(motion: Segment, beside: Rest) -> tuple[Segment, ...]:
    """Cuts out what a motion turns without a pause from its beginning; nothing if that is little or all.

    A robot that drives off as soon as it has turned gives no rest between.
    """
    about, _ = _rates(motion, beside)
    slow = np.abs(about) < max(SLOWEST_TURN, PAUSE_SHARE * float(np.abs(about).max()))
    steps = round(PAUSE_SECONDS / BLOCK_SECONDS)
    pauses = np.flatnonzero(np.convolve(slow, np.ones(steps), "valid") == steps)
    if len(pauses) == 0:
        return ()
    first = motion.between(motion.start, motion.start + BLOCK_SECONDS * float(pauses[0]))
    return (first,) if turned_about(first, beside) >= SMALLEST_SPIN else ()


def nearest_rest(motion: Segment, rests: Sequence[Rest]) -> Rest:
    """Finds the rest beside a motion."""
    middle = 0.5 * (motion.start + motion.end)
    return min(rests, key=lambda rest: min(abs(rest.start - middle), abs(rest.end - middle)))


def _saturated(motion: Segment, faults: Sequence[ChannelFault]) -> SpinFailure | None:
    for fault in faults:
        if fault.touches(motion.start, motion.end):
            when = next(max(first, motion.start) for first, last in fault.runs if last >= motion.start)
            figures = {"time": when, "channel": float(CHANNELS.index(fault.channel)), "value": fault.value}
            return SpinFailure(SpinFailureKind.SATURATED, figures)
    return None


def _rates(motion: Segment, beside: Rest) -> tuple[FloatArray, FloatArray]:
    """(k,) rad/s about the vertical and across it, of successive blocks of a motion."""
    rate = _block_means(motion.samples.time, motion.samples.gyroscope - beside.angular_rate)
    up = beside.specific_force / np.linalg.norm(beside.specific_force)
    about: FloatArray = rate @ up
    across: FloatArray = np.linalg.norm(rate - np.outer(about, up), axis=1)
    return about, across


def turned_about(motion: Segment, beside: Rest) -> float:
    """Angle turned about the vertical, rad, both directions counted."""
    if len(motion.samples) < FEWEST_SAMPLES:
        return 0.0
    about, _ = _rates(motion, beside)
    return float(np.abs(about).sum()) * BLOCK_SECONDS


def _block_means(time: FloatArray, values: FloatArray) -> FloatArray:
    """(k, 3) means over segments of equal length, so that noise does not add up to an angle."""
    count = max(1, round(float(time[-1] - time[0]) / BLOCK_SECONDS))
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], count + 1)[:-1])
    edges = np.unique(edges)
    lengths = np.diff(np.append(edges, len(time)))
    means: FloatArray = np.add.reduceat(values, edges, axis=0) / lengths[:, None]
    return means


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
