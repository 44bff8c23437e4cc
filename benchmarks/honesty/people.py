"""Imperfections of whoever holds a session."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.honesty.motion import (
    FloatArray,
    Motion,
    Segment,
    attitude_after,
    attitude_with_up,
    turned_by,
    visits,
)
from benchmarks.honesty.session import TURN_RATE, Session


def skip_poses(session: Session, size: float) -> None:
    """Leaves so many poses out: turns lead past them."""
    count = round(size)

    def skipped(segments: list[Segment]) -> list[Segment]:
        poses = [segment.pose for segment in segments if segment.pose >= 0]
        left_out = set(session.rng.choice(poses, min(count, len(poses) - 1), replace=False).tolist())
        return [segment for segment in segments if segment.pose not in left_out]

    session.plans.append(skipped)


def flatten(session: Session, size: float) -> None:
    """Holds the unit with all directions within so many deg of a plane."""
    normal = session.rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    seconds = session.segments[0].seconds
    ups = []
    for _ in range(18):
        up = session.rng.normal(size=3)
        up -= up @ normal * normal
        up /= np.linalg.norm(up)
        out_of_plane = np.tan(np.radians(session.rng.uniform(-size, size)))
        ups.append((up + out_of_plane * normal) / np.hypot(1.0, out_of_plane))
    attitudes = [attitude_with_up(ups[0], 0.0)]
    for up in ups[1:]:
        attitudes.append(attitude_after(attitudes[-1], up, 0.0))
    session.start, session.segments = attitudes[0], visits(attitudes, seconds, TURN_RATE)


def hurry(session: Session, size: float) -> None:
    """Rests so many s at each pose."""
    session.plans.append(
        lambda segments: [
            replace(segment, seconds=size) if segment.pose >= 0 else segment for segment in segments
        ]
    )


def cut(session: Session, size: float) -> None:
    """Ends the target's file after a share of it."""
    session.units[-1].rows.append(lambda rows: rows[: max(1, int(size * len(rows)))])


def exchange(session: Session, _: float) -> None:
    """Names the target before the reference."""
    session.units.reverse()


TOUCH_SECONDS = 0.3
"""s that a touch lasts."""
RATE_OVER_FORCE = 0.1
"""rad/s by which a touch turns a unit that it pushes by 1 m/s²."""


def touch(session: Session, size: float) -> None:
    """Pushes the unit once, by so many m/s²."""
    direction = session.rng.normal(size=3)
    share = float(session.rng.uniform(0.05, 0.95))

    def touched(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        phase = (motion.time - share * motion.time[-1]) / TOUCH_SECONDS
        push = np.sin(np.pi * phase) * ((phase > 0.0) & (phase < 1.0))
        pushed = size * push[:, None] * direction
        return force + pushed, rate + RATE_OVER_FORCE * pushed

    session.units[-1].sees.append(touched)


def tilt(session: Session, size: float) -> None:
    """Tilts the unit by so many deg, once and for good."""
    rotation = session.rng.normal(size=3)
    rotation *= np.radians(size) / np.linalg.norm(rotation)
    share = float(session.rng.uniform(0.05, 0.95))

    def tilted(motion: Motion, force: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
        after = (motion.time > share * motion.time[-1])[:, None]
        return np.where(after, force @ turned_by(rotation, np.ones(1))[0], force), rate

    session.units[-1].sees.append(tilted)
