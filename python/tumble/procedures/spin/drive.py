"""Detection of robots that left the spot during a turn, by their accelerometers."""

from __future__ import annotations

import math

import numpy as np

from tumble import _core
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray
from tumble.procedures.spin.chain import Chain, FailedChain
from tumble.procedures.spin.failure import SpinFailure, SpinFailureKind
from tumble.procedures.spin.segments import Segment

LARGEST_SPEED = 0.25
"""m/s that the accelerometers show while the robot should have stayed on the spot."""
LARGEST_MISFIT = 0.003
"""m/s^2 that a fit may be off for long and adds up to a speed nobody drove."""
SIGMAS_OF_WALK = 2.0
LARGEST_LEVER_ARM = 1.0
"""m; what seems to be further off its turning axis drove a circle."""


def drive_failure(
    chain: Chain, figures: _core.SpinFigures, blocks: _core.SpinBlockFigures
) -> FailedChain | None:
    """Finds the motion in which the robot left the spot."""
    speeds = [_speed(motion, chain, figures, blocks) for motion in chain.motions]
    fastest = int(np.argmax(speeds))
    faulty_motion = chain.motions[fastest]
    if speeds[fastest] > _largest_speed(faulty_motion, chain, figures):
        reached = {"speed": speeds[fastest], "named": float(chain.given)}
        return FailedChain(SpinFailure(SpinFailureKind.DROVE, reached), faulty_motion)
    if not chain.given and np.linalg.norm(figures["lever_arm"]) > LARGEST_LEVER_ARM:
        return FailedChain(
            drove_a_circle(figures["lever_arm"]), faulty_motion if len(chain.motions) == 1 else None
        )
    return None


def _speed(
    motion: Segment, chain: Chain, figures: _core.SpinFigures, blocks: _core.SpinBlockFigures
) -> float:
    """Largest horizontal speed of the turning axis over one motion, m/s, from the accelerometers.

    That is the speed of the IMU, integrated from rest, less what turning about the axis gives it.
    """
    kept = (blocks["time"] >= motion.start) & (blocks["time"] <= motion.end)
    if kept.sum() < 2:
        return 0.0
    heading = blocks["heading"][kept]
    spacing = np.gradient(blocks["time"])[kept]
    pull = (blocks["force"][kept, :2] - _gravity_along(heading, figures)) @ [1.0, 1.0j]
    # Forward and left as one complex number, which the heading turns into a direction of the floor.
    gained = pull * np.exp(1j * heading) * spacing
    velocity = np.cumsum(gained) - 0.5 * gained
    turning = 1j * _arm_along_floor(figures) * blocks["rate"][kept] * np.exp(1j * heading)
    velocity -= turning
    if motion is not chain.segments[-1]:
        # It stands again afterwards: what the sum has gathered until then is drift.
        velocity -= np.linspace(0.0, 1.0, len(velocity)) * velocity[-1]
    return float(np.abs(velocity).max())


def _largest_speed(motion: Segment, chain: Chain, figures: _core.SpinFigures) -> float:
    """Speed that a motion on the spot may seem to reach, m/s: misfit adds up, and integrated noise walks."""
    seconds = motion.end - motion.start
    noise = float(np.linalg.norm(figures["noise"][1])) * math.sqrt(2.0 / 3.0)
    walk = noise * seconds / math.sqrt(len(motion.samples))
    if motion is not chain.segments[-1]:
        # Zero at both ends, it walks half as far.
        walk *= 0.5
    return LARGEST_SPEED + LARGEST_MISFIT * seconds + SIGMAS_OF_WALK * walk


def _gravity_along(heading: FloatArray, figures: _core.SpinFigures) -> FloatArray:
    """(n, 2) specific force that a tilted floor puts forward and left, m/s^2."""
    (tilt, _), (bearing, _) = figures["floor_tilt"], figures["uphill_bearing"]
    if not (math.isfinite(tilt) and math.isfinite(bearing)):
        return np.zeros((len(heading), 2))
    uphill = np.column_stack([np.cos(bearing - heading), np.sin(bearing - heading)])
    return STANDARD_GRAVITY * math.sin(tilt) * uphill


def _arm_along_floor(figures: _core.SpinFigures) -> complex:
    """Lever arm forward and left as one complex number, m; the frame is that of the blocks."""
    up, arm = figures["up"], figures["lever_arm"]
    forward = np.array([1.0, 0.0, 0.0]) - up[0] * up
    forward /= np.linalg.norm(forward)
    return complex(arm @ forward, arm @ np.cross(up, forward))


def drove_a_circle(arm: FloatArray) -> SpinFailure:
    """Reports a turning axis too far from the IMU for a turn on the spot; `arm` (3,) m."""
    return SpinFailure(SpinFailureKind.DROVE_A_CIRCLE, {"radius": float(np.linalg.norm(arm))})
