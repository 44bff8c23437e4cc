"""Estimates of a live session so far: the turntable procedure itself, on all that was acquired."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from tumble.acquisition.acquire import acquire
from tumble.acquisition.imu import Imu
from tumble.foundation.errors import TumbleError
from tumble.foundation.goal import Goal, GoalProgress
from tumble.foundation.recording import FloatArray, Recording
from tumble.foundation.results import LARGEST_WIDENING
from tumble.poses.pose_list import PoseList
from tumble.procedures.turntable.procedure import TurntableSession
from tumble.procedures.turntable.result import TargetResult
from tumble.procedures.turntable.slips import OTHER_AXES, Exchange, Slip, exchanges, slips, visits_of
from tumble.tools.record.objections import Objection, faults

OpenSession: TypeAlias = Callable[[Recording], TurntableSession]
"""Fits the reference, as `open_session` does; poses need not be known."""


@dataclass(frozen=True, slots=True)
class SoFar:
    """Estimates of the procedure so far."""

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
    """Runs the procedure; `complete` states that no pose is missing, whatever fails."""
    units: dict[str, Imu] = {}
    objections: list[Objection] = []
    for name, recording in recordings.items():
        try:
            units[name] = acquire(recording, rates="reference" if name == reference else "target")
            objections += faults(name, units[name])
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
    moved = list(slips(visits, matrices, session.batch.gravity))
    crossed = {slip.target for slip in moved if slip.other}
    misfits = [each.name for each in found if not _is_met(each) and each.name not in crossed]
    exchanged = [each for pair in exchanges(visits, misfits) for each in _exchanged(pair)]
    known = {each.unit for each in exchanged}
    slipped = [_slipped(slip) for slip in moved if slip.target not in known]
    objections += [*exchanged, *slipped]
    if complete:
        objections += _failures(session, targets, found, known | {each.unit for each in slipped})
    return SoFar(
        found, goal.progress(each for each in found if not each.failure) if goal else (), tuple(objections)
    )


def _matrix(target: TargetResult) -> FloatArray:
    triad = None if target.failure else target.accelerometer
    return np.eye(3) if triad is None else triad.M


def _slipped(slip: Slip) -> Objection:
    at = f"at {slip.visit.pose}"
    if slip.other:
        text = (
            f"shows {at} what {slip.other} showed there before: the plugs of the two were exchanged; "
            "exchange them back and begin anew"
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


def _exchanged(pair: Exchange) -> Iterator[Objection]:
    at = f"{pair.since.pose}, {pair.since.time:.0f} s"
    for name, other in ((pair.one, pair.other), (pair.other, pair.one)):
        yield Objection(
            name,
            f"exchanged {pair.since.time:.3f}",
            f"its plug and that of {other} were exchanged before {at}: since then each shows what the other "
            "showed; exchange them back and begin anew",
        )


def _is_met(target: TargetResult) -> bool:
    """Returns whether the readings of a target follow those of the reference."""
    triad = None if target.failure else target.accelerometer
    return triad is not None and triad.widening <= LARGEST_WIDENING


def _failures(
    session: TurntableSession, targets: Mapping[str, Imu], found: tuple[TargetResult, ...], known: set[str]
) -> Iterator[Objection]:
    """Describes why targets cannot be calibrated, or not well, where nothing more exact is known."""
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
