"""Which procedures a recording can serve, and what it lacks for the others."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tumble import _core
from tumble.acquisition.acquire import FEWEST_RESTS
from tumble.inspect.result import Service
from tumble.logs.units import FASTEST_HZ, SLOWEST_HZ, is_imu_step
from tumble.recording import FloatArray
from tumble.results import Rest
from tumble.units import TRIADS, Triad

_APART = np.deg2rad(20.0)
_SMALLEST_SPREAD = 0.1
_SHORTEST_STILL = 2.0
_FULL_TURN = np.deg2rad(350.0)
_SMALLEST_TURN = 0.1
_LARGEST_TILT = np.deg2rad(15.0)
_SLOWEST_SPIN = 0.1
_LARGEST_ACROSS = 0.3
"""Angular rate across the vertical against that about it, while a robot turns on the spot."""
_LONGEST_PAUSE = 1.5
"""s besides rests between two turns of one spin: to speed up and slow down."""


def directions_of(rests: Sequence[Rest]) -> list[FloatArray]:
    """Give unit vectors of the specific force at rest, those within 20 deg of an earlier one left out."""
    found: list[FloatArray] = []
    for rest in rests:
        length = float(np.linalg.norm(rest.specific_force))
        if length == 0.0:
            continue
        direction = rest.specific_force / length
        if all(float(np.arccos(np.clip(direction @ other, -1.0, 1.0))) > _APART for other in found):
            found.append(direction)
    return found


def services_of(
    rests: Sequence[Rest],
    turn_angles: FloatArray,
    trace: tuple[FloatArray, FloatArray, FloatArray],
    alone: bool,
    interval: float,
    stuck: Sequence[str],
    triads: Sequence[Triad] = TRIADS,
) -> tuple[Service, ...]:
    """Judge a recording. `turn_angles` (k, 3) rad between rests; `trace`: times, specific forces, rates.

    `alone` says that no other IMU was logged together with this one, `interval` how far samples are apart, s.
    """
    faults = faults_of(interval, stuck)
    no_turns = not _turned(rests, turn_angles)
    unseen = ("gyroscope scale and axes stay unknown without turns between rests",) if no_turns else ()
    if "accelerometer" not in triads:
        target = Service(
            "turntable, as target", (*_lacking_rests(rests), *faults), (_unknown("accelerometer"), *unseen)
        )
        return (
            _refused("turntable, as reference", "accelerometer"),
            target,
            *_refused_in_motion("accelerometer"),
        )
    poses = (*_lacking_directions(directions_of(rests)), *faults)
    if "gyroscope" not in triads:
        reference = Service(
            "turntable, as reference", poses, ("it serves no gyroscope, as none was recorded",)
        )
        target = Service("turntable, as target", poses, (_unknown("gyroscope"),))
        return (reference, target, *_refused_in_motion("gyroscope"))
    partner = () if not alone else ("a second IMU logged with it by the same clock",)
    return (
        Service("turntable, as reference", poses),
        Service("turntable, as target", poses, unseen),
        Service("spin", (*_lacking_spin(rests, trace), *faults)),
        Service("redundancy", (*partner, *_lacking_motion(no_turns, trace), *faults)),
    )


def services_alone(
    rests_by_hand: Sequence[Rest],
    rests: Sequence[Rest],
    temperature: tuple[float, float] | None,
    faults: Sequence[str],
    triads: Sequence[Triad] = TRIADS,
) -> tuple[Service, ...]:
    """Judge whether a recording serves the procedures that need no equipment.

    `rests_by_hand` are those of a unit that is held, `temperature` the lowest and highest, degC, `faults`
    what no procedure can do with.
    """
    untouched = () if rests else ("a rest of at least 1 s, untouched",)
    return (
        _multipose(rests_by_hand, faults, triads),
        Service("noise", (*untouched, *faults)),
        Service("thermal", (*_lacking_temperature(temperature), *untouched, *faults)),
    )


def _multipose(rests: Sequence[Rest], faults: Sequence[str], triads: Sequence[Triad]) -> Service:
    if "accelerometer" not in triads:
        return _refused("multipose", "accelerometer")
    force = np.array([rest.specific_force for rest in rests]).reshape(-1, 3)
    found = len(set(_core.multipose_directions(force)))
    wanted = f"rests in at least {_core.FEWEST_DIRECTIONS} orientations, held for 3 s"
    lacking = () if found >= _core.FEWEST_DIRECTIONS else (f"{wanted}, {found} found",)
    return Service(
        "multipose", (*lacking, *faults), () if "gyroscope" in triads else (_unknown("gyroscope"),)
    )


def _lacking_temperature(temperature: tuple[float, float] | None) -> tuple[str, ...]:
    if temperature is None:
        return ("a temperature, none was recorded",)
    low, high = temperature
    if high - low >= _core.LEAST_TEMPERATURE_RANGE:
        return ()
    return (f"{_core.LEAST_TEMPERATURE_RANGE:g} K of change in temperature, {high - low:.2g} K found",)


def _unknown(triad: Triad) -> str:
    return f"the {triad} stays unknown, as none was recorded"


def _refused(procedure: str, missing: Triad) -> Service:
    return Service(procedure, (f"{missing} readings, none were recorded",))


def _refused_in_motion(missing: Triad) -> tuple[Service, Service]:
    return _refused("spin", missing), _refused("redundancy", missing)


def _lacking_rests(rests: Sequence[Rest]) -> tuple[str, ...]:
    return () if len(rests) >= FEWEST_RESTS else (f"at least {FEWEST_RESTS} rests, {len(rests)} found",)


def faults_of(interval: float, stuck: Sequence[str]) -> tuple[str, ...]:
    """Say what no procedure can do with; `interval` is how far samples are apart, s."""
    return (
        *_lacking_rate(interval),
        *(f"{'an' if name.startswith('a') else 'a'} {name} that is not stuck" for name in stuck),
    )


def _lacking_rate(interval: float) -> tuple[str, ...]:
    if is_imu_step(interval):
        return ()
    return (f"{SLOWEST_HZ:g} to {FASTEST_HZ:g} samples a second, {1.0 / interval:.3g} found",)


def _lacking_directions(directions: Sequence[FloatArray]) -> tuple[str, ...]:
    if len(directions) < FEWEST_RESTS:
        wanted = f"rests in at least {FEWEST_RESTS} directions more than 20 deg apart"
        return (f"{wanted}, {len(directions)} found",)
    design = np.column_stack([np.array(directions), np.ones(len(directions))])
    if np.linalg.svd(design, compute_uv=False)[-1] < _SMALLEST_SPREAD * np.sqrt(len(directions)):
        return ("a rest out of the plane in which all directions found lie",)
    return ()


def _turned(rests: Sequence[Rest], turn_angles: FloatArray) -> bool:
    """Tell whether any turn between rests is more than the bias of the gyroscope could feign."""
    spans = np.array([after.start - before.end for before, after in pairwise(rests)])
    if len(spans) == 0 or len(spans) != len(turn_angles):
        return False
    bias = np.array([rest.angular_rate for rest in rests[:-1]])
    return bool((np.linalg.norm(turn_angles - bias * spans[:, None], axis=1) > _SMALLEST_TURN).any())


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
    if len(time) < 2:
        return 0.0
    up = rest.specific_force / np.linalg.norm(rest.specific_force)
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
    """Whether a robot stood for all the time between two turns but what slowing down and speeding up take."""
    stood = sum(max(0.0, min(end, rest.end) - max(start, rest.start)) for rest in rests)
    return end - start - stood < _LONGEST_PAUSE


def _runs(mask: NDArray[np.bool_]) -> list[slice]:
    """Stretches over which a (n,) mask is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [slice(int(start), int(end)) for start, end in edges.reshape(-1, 2)]


def _lacking_motion(no_turns: bool, trace: tuple[FloatArray, FloatArray, FloatArray]) -> tuple[str, ...]:
    _, force, rate = trace
    moved = len(rate) > 0 and (
        np.ptp(rate, axis=0).max() > _SMALLEST_TURN or np.ptp(force, axis=0).max() > 1.0
    )
    return () if moved or not no_turns else ("motion to compare the units in",)
