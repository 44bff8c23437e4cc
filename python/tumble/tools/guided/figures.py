"""Figures of a run that goes on, as numbers: pages draw them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from tumble.foundation.message import NOTHING, Message

CaseDirection: TypeAlias = tuple[float, float, float]
"""Unit vector in the case frame of a unit."""


@dataclass(frozen=True, slots=True)
class SphereFigure:
    """Directions of the case in which something pointed, such as up, on a sphere, and the next one."""

    held: tuple[CaseDirection, ...]
    """Those that were held still."""
    wanted: CaseDirection | None = None
    """The next one; None where there is none."""
    now: CaseDirection | None = None
    """The present one; None where it is not known."""
    title: Message = NOTHING


@dataclass(frozen=True, slots=True)
class AllanCurve:
    """Allan deviation of one axis."""

    name: str
    """`gyroscope x`."""
    tau: tuple[float, ...]
    """Averaging times, s."""
    deviation: tuple[float, ...]
    """At each averaging time, in the unit of its figure."""
    sigma: tuple[float, ...] = ()
    """1-sigma of each; empty where it is not known."""


@dataclass(frozen=True, slots=True)
class AllanFigure:
    """Allan deviations of one triad so far, over the averaging time."""

    title: Message
    unit: str
    """Unit of the deviations: `rad/s`."""
    curves: tuple[AllanCurve, ...]


@dataclass(frozen=True, slots=True)
class DeviationSeries:
    """Deviation of one unit over time."""

    name: str
    time: tuple[float, ...]
    """s since the run began."""
    value: tuple[float, ...]
    """In the unit of the figure."""
    note: Message = NOTHING
    """Words on the newest one, where it does not count any more."""


@dataclass(frozen=True, slots=True)
class DeviationFigure:
    """Deviations of units over time against their threshold."""

    title: Message
    unit: str
    """`m/s^2`."""
    series: tuple[DeviationSeries, ...]
    threshold: float | None = None
    """In the unit of the figure; None where there is none."""
    marks: tuple[tuple[float, str], ...] = ()
    """Events: s since the run began, and the text beside them."""


@dataclass(frozen=True, slots=True)
class StateRow:
    """State of one unit of a set."""

    name: str
    state: Message
    healthy: bool | None
    """None while that is not known."""
    cells: tuple[Message, ...]
    """One for each further column."""
    exceeded: tuple[bool, ...] = ()
    """Indicates for each cell whether it is beyond its threshold; empty where none is."""
    is_source: bool = False
    why: Message = NOTHING
    """Cause and remedy of a fault."""


@dataclass(frozen=True, slots=True)
class StateFigure:
    """States of the units of a set, and the unit that its output comes from."""

    title: Message
    columns: tuple[Message, ...]
    """Heads of the cells."""
    rows: tuple[StateRow, ...]


@dataclass(frozen=True, slots=True)
class EventLine:
    """One event of a set."""

    time: float
    """s since the run began."""
    unit: str
    text: Message
    is_fault: bool = False


@dataclass(frozen=True, slots=True)
class EventFigure:
    """Newest events, the latest first."""

    title: Message
    lines: tuple[EventLine, ...]


RunFigure: TypeAlias = SphereFigure | AllanFigure | DeviationFigure | StateFigure | EventFigure
