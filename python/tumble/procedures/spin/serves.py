"""Conditions on a recording of a spin."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Rest
from tumble.foundation.services import Evidence, Service, lacking_triad

_SHORTEST_STILL = 2.0
_FULL_TURN = np.deg2rad(350.0)
_LARGEST_TILT = np.deg2rad(15.0)
_SLOWEST_SPIN = 0.1
_LARGEST_ACROSS = 0.3
"""Angular rate across the vertical against that about it, while a robot turns on the spot."""
_LONGEST_PAUSE = 1.5
"""s besides rests between two turns of one spin: to speed up and slow down."""


def services(evidence: Evidence) -> Iterator[Service]:
    """Judges the suitability of a recording."""
    yield lacking_triad(evidence, "spin") or evidence.service(
        "spin", (*_lacking_spin(evidence.rests, evidence.trace), *evidence.lacking_rate)
    )


def _lacking_spin(rests: Sequence[Rest], trace: tuple[FloatArray, FloatArray, FloatArray]) -> tuple[str, ...]:
    still = [rest for rest in rests if rest.end - rest.start >= _SHORTEST_STILL]
    if not still:
        return (f"a rest of at least {_SHORTEST_STILL:g} s", "a full turn on the spot after it")
    angle = max(_longest_spin(rest, rests, trace) for rest in still)
    if angle < _FULL_TURN:
        return (f"a full turn on the spot, the longest found is {np.rad2deg(angle):.0f} deg",)
    return ()


def _longest_spin(
    rest: Rest, rests: Sequence[Rest], trace: tuple[FloatArray, FloatArray, FloatArray]
) -> float:
    """Largest angle turned about the vertical of that rest without leaving level, rad, stops included."""
    time, force, rate = trace
    strength = np.linalg.norm(rest.specific_force)
    # A dead accelerometer shows no vertical to turn about.
    if len(time) < 2 or strength == 0.0:
        return 0.0
    up = rest.specific_force / strength
    turning = rate - rest.angular_rate
    about_up = turning @ up
    across = np.linalg.norm(turning - np.outer(about_up, up), axis=1)
    lengths = np.maximum(np.linalg.norm(force, axis=1), np.finfo(np.float64).tiny)
    level = np.arccos(np.clip(force @ up / lengths, -1.0, 1.0)) < _LARGEST_TILT
    spinning = level & (np.abs(about_up) > _SLOWEST_SPIN) & (across < _LARGEST_ACROSS * np.abs(about_up))
    spacing = float(np.median(np.diff(time)))
    longest = angle = 0.0
    before = -np.inf
    for run in _runs(spinning):
        # The points just before and after belong to it in part.
        gained = spacing * float(np.abs(about_up[max(0, run.start - 1) : run.stop + 1]).sum())
        angle = gained + (angle if _is_pause(before, float(time[run.start]), rests) else 0.0)
        longest = max(longest, angle)
        before = float(time[run.stop - 1])
    return longest


def _is_pause(start: float, end: float, rests: Sequence[Rest]) -> bool:
    """Returns whether a robot stood between two turns for all but the time to slow down and speed up."""
    stood = sum(max(0.0, min(end, rest.end) - max(start, rest.start)) for rest in rests)
    return end - start - stood < _LONGEST_PAUSE


def _runs(mask: NDArray[np.bool_]) -> list[slice]:
    """Stretches over which a (n,) mask is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [slice(int(start), int(end)) for start, end in edges.reshape(-1, 2)]
