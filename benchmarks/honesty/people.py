"""Imperfections of whoever holds a session."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.honesty.motion import Segment, attitude_after, attitude_with_up, visits
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
