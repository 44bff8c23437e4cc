"""View of a run at one moment: pure data, newest wins, nothing is lost with a view that nobody saw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from tumble.foundation.message import NOTHING, Message
from tumble.tools.guided.figures import CaseDirection, RunFigure

ViewKind: TypeAlias = Literal[
    "listening", "wanted", "progress", "held", "part done", "warning", "done", "ended early"
]
"""Latest event: `wanted` asks for something new, `held` ends a rest, `part done` a part of the run."""
UnitLampState: TypeAlias = Literal["waiting", "rest", "motion", "silent", "lost", "good", "warning", "faulty"]


@dataclass(frozen=True, slots=True)
class CheckItem:
    """One thing to be shown: a pose, a turn, an orientation."""

    name: str
    share: float
    """Progress, 0 to 1."""
    done: bool
    current: bool = False
    """Indicates whether it is shown right now."""
    detail: Message = NOTHING
    """`4 of 10 s`."""
    units: tuple[tuple[str, bool], ...] = ()
    """Name of each unit, and whether it has shown it."""
    up: CaseDirection | None = None
    """CaseDirection that points up there; None where that is no matter."""


@dataclass(frozen=True, slots=True)
class CheckGroup:
    """Things of one kind: poses, turns."""

    title: Message
    items: tuple[CheckItem, ...]


@dataclass(frozen=True, slots=True)
class UnitLamp:
    """Lamp of one unit."""

    name: str
    state: UnitLampState
    rate: float = float("nan")
    """Hz; NaN before it is known."""
    text: Message = NOTHING
    """Further words, such as why it is faulty."""


@dataclass(frozen=True, slots=True)
class GoalShare:
    """A sigma so far against the one that is wanted."""

    name: str
    """`accelerometer bias`."""
    unit: str
    sigma: float
    """Infinite while the data do not show it."""
    wanted: float | None
    """None where no goal is stated."""
    about: str = ""
    """Unit that is furthest from it."""


@dataclass(frozen=True, slots=True)
class BodyView:
    """A body as it stands, and as it should; directions and rotations are of its case frame."""

    name: str
    up_now: CaseDirection | None = None
    """CaseDirection of the case that points up; None where it is not known."""
    up_wanted: CaseDirection | None = None
    """CaseDirection that is to point up; None where any will do."""
    turned_now: tuple[float, float, float, float] | None = None
    """Rotation floor_from_case as a quaternion w, x, y, z, where more than `up_now` is known."""
    off: float = float("nan")
    """deg between both directions; NaN where one is not known."""


@dataclass(frozen=True, slots=True)
class RunAction:
    """One thing that an operator may do now, beside stopping."""

    name: str
    """Key for `GuidedRun.act`: `redo`, `evaluate`."""
    label: Message
    subjects: tuple[str, ...] = ()
    """Things it may be done to, such as poses; empty where it needs none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunView:
    """Latest event, and all that is known."""

    kind: ViewKind
    elapsed: float
    """s since the run began."""
    instruction: Message
    """One short sentence: do this now."""
    detail: Message = NOTHING
    """A second one, smaller: why, or what happens meanwhile."""
    remaining: float = float("nan")
    """s of the rest under way that are still wanted; NaN where nothing is counted."""
    checks: tuple[CheckGroup, ...] = ()
    lamps: tuple[UnitLamp, ...] = ()
    goals: tuple[GoalShare, ...] = ()
    bodies: tuple[BodyView, ...] = ()
    figures: tuple[RunFigure, ...] = ()
    actions: tuple[RunAction, ...] = ()
    subject: str = ""
    """Unit or part that the event is about."""
    warning: Message = NOTHING
    """Text of a `warning` or of `ended early`: cause and remedy."""
    table: str = ""
    """Place where an automatic table is or goes; empty without one."""
