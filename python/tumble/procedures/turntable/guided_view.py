"""View of a turntable session: what to do now, ticks, lamps, sigmas and the body of the reference."""

from __future__ import annotations

import math

from tumble.foundation.message import NOTHING, Message, message
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import LISTENING, join
from tumble.poses.pose_list import angle_between
from tumble.procedures.turntable.guide import WantedPose, WantedTurn
from tumble.procedures.turntable.live import LiveTurntable, PoseProgress, TurnProgress, TurntableStep
from tumble.tools.guided.figures import CaseDirection
from tumble.tools.guided.view import (
    BodyView,
    CheckGroup,
    CheckItem,
    GoalShare,
    RunAction,
    RunView,
    UnitLamp,
    ViewKind,
)

KINDS: dict[str, ViewKind] = {
    LISTENING: "listening",
    "pose wanted": "wanted",
    "turn wanted": "wanted",
    "pose done": "held",
    "turn done": "part done",
    "progress": "progress",
    "warning": "warning",
    "done": "done",
    "ended early": "ended early",
}
"""Kind of a view by that of the step."""


def view_of(
    live: LiveTurntable, step: TurntableStep, reference: str, *, by_table: bool, aimed: FloatArray | None
) -> RunView:
    """Makes the view of a step; `aimed` is the direction that an automatic table brings up next."""
    wanted = live.guide.wanted
    instruction, detail = _instruction(live, step, by_table)
    up_wanted = aimed if by_table else wanted.pose.up if isinstance(wanted, WantedPose) else None
    return RunView(
        kind=KINDS[step.kind],
        elapsed=step.elapsed,
        instruction=instruction,
        detail=detail,
        remaining=_remaining(live),
        checks=_checks(live, step),
        lamps=tuple(UnitLamp(unit.name, unit.condition, unit.rate) for unit in step.units),
        goals=tuple(
            GoalShare(each.term.name, each.unit, each.sigma, each.term.sigma, each.target)
            for each in step.goals
        ),
        bodies=(_body(reference, live.up(), up_wanted),),
        actions=() if by_table else (_redo(step),),
        subject=step.subject,
        warning=message("{unit}: {text}", unit=step.subject, text=step.text)
        if step.kind == "warning"
        else message(step.text),
        table=step.table,
    )


def _instruction(live: LiveTurntable, step: TurntableStep, by_table: bool) -> tuple[Message, Message]:
    """Returns what to do now, and why or for how long."""
    guide = live.guide
    waiting = [unit.name for unit in step.units if unit.condition == "waiting"]
    if step.kind == "done":
        return message("Done."), NOTHING
    if step.kind == "ended early":
        return message("Ended early."), message(step.text)
    if len(waiting) == len(step.units):
        return message("Wait for the first samples."), message("Listening to {names}.", names=join(waiting))
    if by_table:
        return message("Hands off."), message("The table turns by itself: {place}.", place=step.table)
    wanted = guide.wanted
    if isinstance(wanted, WantedTurn):
        return (
            message("Turn about {axis} by a quarter or more.", axis=wanted.name),
            message("Then let it stand still."),
        )
    if wanted is None:
        return message("All is shown."), message("The last figures are computed.")
    if wanted is guide.at:
        return message("Keep still."), message("{pose}", pose=wanted.name)
    return message("Go to {pose}.", pose=wanted.name), message("Let it stand still there.")


def _remaining(live: LiveTurntable) -> float:
    at = live.guide.at
    if at is None or at.is_done:
        return math.nan
    return max(0.0, at.wanted - at.seconds)


def _checks(live: LiveTurntable, step: TurntableStep) -> tuple[CheckGroup, ...]:
    wanted = live.guide.wanted
    name = wanted.name if wanted is not None else ""
    ups = {pose.name: _direction(pose.up) for pose in live.poses}
    poses = tuple(_pose(each, step.at, ups[each.name]) for each in step.poses)
    turns = tuple(_turn(each, current=each.name == name) for each in step.turns)
    groups = [CheckGroup(message("Poses"), poses)]
    return (*groups, CheckGroup(message("Turns"), turns)) if turns else tuple(groups)


def _pose(pose: PoseProgress, at: str, up: CaseDirection) -> CheckItem:
    return CheckItem(
        name=pose.name,
        share=min(1.0, pose.seconds / pose.wanted),
        done=pose.done,
        current=pose.name == at,
        detail=message("{seconds} of {wanted} s", seconds=f"{pose.seconds:.0f}", wanted=f"{pose.wanted:.0f}"),
        units=tuple((unit.name, unit.done) for unit in pose.units),
        up=up,
    )


def _turn(turn: TurnProgress, *, current: bool) -> CheckItem:
    return CheckItem(
        name=turn.name,
        share=min(1.0, turn.count / turn.wanted),
        done=turn.done,
        current=current,
        detail=message("{count} of {wanted}", count=turn.count, wanted=turn.wanted),
    )


def _redo(step: TurntableStep) -> RunAction:
    shown = tuple(pose.name for pose in step.poses if pose.seconds > 0.0)
    return RunAction("redo", message("Redo a pose"), shown)


def _body(name: str, up: FloatArray | None, wanted: FloatArray | None) -> BodyView:
    off = math.nan if up is None or wanted is None else angle_between(up, wanted)
    return BodyView(
        name,
        None if up is None else _direction(up),
        None if wanted is None else _direction(wanted),
        off=off,
    )


def _direction(vector: FloatArray) -> CaseDirection:
    x, y, z = map(float, vector)
    return x, y, z
