"""Imperfections of what holds a sensor."""

from __future__ import annotations

import numpy as np

from benchmarks.honesty.motion import GRAVITY, FloatArray, Motion, turned_by
from benchmarks.honesty.session import Session


def _rotated(rotation: FloatArray, vectors: FloatArray) -> FloatArray:
    """(n, 3) vectors in axes that are turned by small rotation vectors, (n, 3) rad."""
    return vectors - np.cross(rotation, vectors)


def flex(session: Session, size: float) -> None:
    """Tilts the target by its weight: so many deg where gravity is along an axis of the fixture."""
    give = np.radians(size) * session.rng.normal(size=(3, 3)) / GRAVITY

    def flexed(_: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        tilt = force @ give.T
        return _rotated(tilt, force), _rotated(tilt, rate)

    session.units[-1].sees.append(flexed)


def slip(session: Session, size: float) -> None:
    """Turns the target in its fixture once, in a turn of the table."""
    direction = session.rng.normal(size=3)
    rotation = np.radians(size) * direction / np.linalg.norm(direction)

    def slipped(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        first = int(session.rng.choice(np.flatnonzero(motion.pose == -1)))
        matrix = turned_by(rotation, np.ones(1))[0]
        force[first:], rate[first:] = force[first:] @ matrix, rate[first:] @ matrix
        return force, rate

    session.units[-1].sees.append(slipped)


def slip_each_time(session: Session, size: float) -> None:
    """Turns the target in its fixture a little at each pose."""

    def slipped(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        begins = np.flatnonzero((motion.pose[1:] >= 0) & (motion.pose[:-1] < 0)) + 1
        steps = np.zeros_like(force)
        steps[begins] = np.radians(size) * session.rng.normal(size=(len(begins), 3))
        rotation = np.cumsum(steps, axis=0)
        return _rotated(rotation, force), _rotated(rotation, rate)

    session.units[-1].sees.append(slipped)


def vibrate(session: Session, size: float) -> None:
    """Adds one line of 12 to 45 Hz to the force of all units, all the time."""
    frequency, direction = float(session.rng.uniform(12.0, 45.0)), session.rng.normal(size=3)

    def shaken(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        wave = np.sin(2.0 * np.pi * frequency * motion.time)[:, None]
        return force + size * wave * direction, rate + 0.01 * size * wave * direction

    for unit in session.units:
        unit.sees.append(shaken)


def _swayed(
    motion: Motion, tilt: FloatArray, force: FloatArray, rate: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Turns a body by small rotation vectors over time, (n, 3) rad."""
    return _rotated(tilt, force), rate + np.gradient(tilt, motion.time, axis=0)


def sway(session: Session, size: float) -> None:
    """Tilts the unit to and fro at rest, at 0.3 to 6 Hz."""
    frequency, direction = (
        float(np.exp(session.rng.uniform(np.log(0.3), np.log(6.0)))),
        session.rng.normal(size=3),
    )

    def swayed(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        wave = np.sin(2.0 * np.pi * frequency * motion.time)[:, None]
        return _swayed(motion, np.radians(size) * wave * direction, force, rate)

    session.units[-1].sees.append(swayed)


def tilt_with_heading(session: Session, size: float) -> None:
    """Tilts the robot by an angle that goes with twice its heading."""
    direction = session.rng.normal(size=2)

    def leaned(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        heading = np.unwrap(np.arctan2(motion.attitude[:, 1, 0], motion.attitude[:, 0, 0]))
        shape = np.column_stack([np.cos(2.0 * heading), np.sin(2.0 * heading), np.zeros(len(heading))])
        tilt = np.radians(size) * shape * np.array([*direction, 0.0])
        return _swayed(motion, tilt - tilt[0], force, rate)

    session.units[-1].sees.append(leaned)


def push(session: Session, size: float) -> None:
    """Pushes the robot along its own axis while it turns: it drives a circle."""
    direction = session.rng.normal(size=2)

    def pushed(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        share = np.linalg.norm(motion.rate, axis=1) / max(np.abs(motion.rate).max(), 1e-9)
        return force + size * share[:, None] * np.array([*direction, 0.0]), rate

    session.units[-1].sees.append(pushed)
