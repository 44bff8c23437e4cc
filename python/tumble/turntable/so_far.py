"""What a live session shows so far: the turntable procedure itself, on all that was acquired."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from tumble.acquisition.acquire import acquire, si_unit
from tumble.acquisition.imu import Imu
from tumble.errors import TumbleError
from tumble.recording import Chunk, FloatArray, Recording
from tumble.results import LARGEST_WIDENING
from tumble.turntable.goal import Goal, GoalProgress
from tumble.turntable.poses import PoseList
from tumble.turntable.procedure import Session
from tumble.turntable.result import TargetResult
from tumble.turntable.slips import OTHER_AXES, Slip, slips, visits_of

OpenSession: TypeAlias = Callable[[Recording], Session]
"""Fits the reference, as `open_session` does; poses need not be known."""

FEWEST_KEPT = 1 << 14
"""Samples for which there is room from the beginning."""
CLOCK = "live"
"""What all units of a live set are stamped by."""


class _Samples:
    """Samples of one unit, in arrays that grow; what was given of them stays as it was."""

    def __init__(self) -> None:
        self._count = 0
        self._time = np.empty(FEWEST_KEPT)
        self._triads = np.empty((2, FEWEST_KEPT, 3))

    def push(self, chunk: Chunk) -> None:
        end = self._count + len(chunk)
        if end > len(self._time):
            more = max(len(self._time), len(chunk))
            self._time = np.concatenate([self._time, np.empty(more)])
            self._triads = np.concatenate([self._triads, np.empty((2, more, 3))], axis=1)
        self._time[self._count : end] = chunk.time
        self._triads[0, self._count : end] = chunk.accelerometer
        self._triads[1, self._count : end] = chunk.gyroscope
        self._count = end

    def since(self, time: float) -> Chunk:
        first = int(np.searchsorted(self._time[: self._count], time))
        which = slice(first, self._count)
        return Chunk(self._time[which], self._triads[0, which], self._triads[1, which])


class Acquisition:
    """All samples of all units since the session began."""

    def __init__(self) -> None:
        self._units: dict[str, _Samples] = {}

    def push(self, name: str, chunk: Chunk) -> None:
        """Take in samples of a unit."""
        self._units.setdefault(name, _Samples()).push(chunk)

    def recordings(self) -> dict[str, Recording]:
        """Give what there is now; what comes later is not in it."""
        return {name: _recording(name, unit.since(-math.inf)) for name, unit in self._units.items()}

    def newest(self, name: str, seconds: float) -> Chunk:
        """Give the last so many s of a unit that has given samples."""
        unit = self._units[name]
        return unit.since(float(unit.since(-math.inf).time[-1]) - seconds)


@dataclass(frozen=True, slots=True)
class Objection:
    """Something wrong with a unit, and what to do about it."""

    unit: str
    key: str
    """The same for what is the same trouble, whatever its figures by now."""
    text: str


@dataclass(frozen=True, slots=True)
class SoFar:
    """What the procedure finds by now."""

    targets: tuple[TargetResult, ...] = ()
    """Empty while the poses do not suffice."""
    goals: tuple[GoalProgress, ...] = ()
    objections: tuple[Objection, ...] = ()


def evaluate(
    recordings: Mapping[str, Recording],
    reference: str,
    open_reference: OpenSession,
    poses: PoseList,
    goal: Goal | None,
    *,
    complete: bool,
) -> SoFar:
    """Run the procedure; `complete` says that each pose was shown, so that what fails is no want of poses."""
    units: dict[str, Imu] = {}
    objections: list[Objection] = []
    for name, recording in recordings.items():
        try:
            units[name] = acquire(recording)
            objections += _faults(name, units[name])
        except TumbleError as error:
            objections.append(Objection(name, "not read", error.why))
    if reference not in units:
        return SoFar((), (), tuple(objections))
    targets = {name: unit for name, unit in units.items() if name != reference}
    try:
        session = open_reference(recordings[reference])
    except TumbleError as error:
        told = [Objection(reference, "unfit", error.why)] if complete else []
        return SoFar((), (), (*objections, *told))
    found = tuple(session.calibrate(name, unit) for name, unit in targets.items())
    matrices = {each.name: _matrix(each) for each in found}
    visits = visits_of(
        units[reference].acquired, {name: unit.acquired for name, unit in targets.items()}, poses
    )
    slipped = [_slipped(slip) for slip in slips(visits, matrices, session.batch.gravity)]
    objections += slipped
    if complete:
        objections += _failures(session, targets, found, {each.unit for each in slipped})
    return SoFar(found, goal.progress(found) if goal else (), tuple(objections))


def _recording(name: str, chunk: Chunk) -> Recording:
    return Recording.from_arrays(name, chunk.time, chunk.accelerometer, chunk.gyroscope, clock=CLOCK)


def _matrix(target: TargetResult) -> FloatArray:
    triad = None if target.failure else target.accelerometer
    return np.eye(3) if triad is None else triad.M


def _faults(name: str, unit: Imu) -> Iterator[Objection]:
    remedies = {
        "stuck": "check the sensor and its cable",
        "saturated in motion": "turn more slowly, or choose a larger range",
        "saturated at rest": "choose a larger range",
    }
    for channel, kind, value, first, _ in unit.faults:
        seen = "is stuck" if kind == "stuck" else "is saturated"
        text = f"{channel} {seen} at {value:.4g} {si_unit(channel)} since {first:.1f} s; {remedies[kind]}"
        yield Objection(name, f"{kind} {channel}", text)


def _slipped(slip: Slip) -> Objection:
    at = f"at {slip.visit.pose}"
    if slip.other:
        text = (
            f"shows {at} what {slip.other} showed there before: the two are swapped; exchange their sources"
        )
    elif slip.angle > OTHER_AXES:
        text = (
            f"reads gravity {slip.angle:.0f} deg elsewhere {at} than before: another unit, or other axes; "
            "put it back as it was, or begin anew"
        )
    else:
        text = (
            f"is loose: {at} gravity moved by {slip.angle:.2f} deg against the reference's since the table "
            "was there before; fasten it and begin anew"
        )
    return Objection(slip.target, f"slipped {slip.visit.time:.3f}", text)


def _failures(
    session: Session, targets: Mapping[str, Imu], found: tuple[TargetResult, ...], known: set[str]
) -> Iterator[Objection]:
    """Say why targets cannot be calibrated, or not well, where nothing more exact is known of them."""
    for each in found:
        if why := session.why_swapped(targets[each.name]):
            yield Objection(each.name, "better than the reference", why)
        elif each.name in known:
            continue
        elif each.failure:
            yield Objection(each.name, "failure", each.failure_reason)
        elif each.accelerometer is not None and each.accelerometer.widening > LARGEST_WIDENING:
            yield Objection(
                each.name,
                "model not met",
                f"reads gravity {each.accelerometer.widening:.0f} times further off the reference than noise "
                "explains: it is loose, or its axes changed; fasten it and begin anew",
            )
