"""Faults that a served stream can have on purpose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from tumble.tools.simulate.fault import AXES, FAULTS, AxisName
from tumble.tools.simulate.scenario import ScenarioError

LiveFaultKind = Literal[
    "unplugged", "garbled", "restart", "moved", "frozen", "gap", "late", "clock-jump", "time-backwards"
]

LIVE_FAULTS: dict[LiveFaultKind, str] = {
    "unplugged": "the line is taken away from `start` to `end`, then the unit is plugged in again",
    "garbled": "the share `size` of all bytes is damaged on the way from `start` to `end`, 0.01 if not given",
    "restart": "the unit is silent from `start` to `end`, and its clock starts anew at 0",
    **{kind: FAULTS[kind] for kind in ("moved", "frozen", "gap", "late", "clock-jump", "time-backwards")},
}
"""Effect of each kind; kinds that recordings have too have the same effect here."""
SIZES: dict[LiveFaultKind, float] = {
    "garbled": 0.01,
    "moved": 2.0,
    "late": 0.5,
    "clock-jump": 1.0,
    "time-backwards": 1.0,
}
"""Usual ones."""
START = 10.0
"""s, where a fault does not state its time."""


@dataclass(frozen=True, slots=True)
class LiveFault:
    """One fault of one unit. Fields that a kind does not use are ignored."""

    kind: LiveFaultKind
    axis: AxisName = "y"
    """About which a unit slips."""
    start: float = START
    """s after the start, as the units count them."""
    end: float | None = None
    """s; one second after `start` if not given, for ever for what stays."""
    size: float | None = None
    """Magnitude; unit and default depend on the kind, see `LIVE_FAULTS`."""

    def __post_init__(self) -> None:
        if self.kind not in get_args(LiveFaultKind):
            raise ValueError(f"unknown fault {self.kind!r}; known are {', '.join(LIVE_FAULTS)}")
        if self.axis not in AXES:
            raise ValueError(f"fault {self.kind!r}: axis needs to be x, y or z, found {self.axis!r}")
        for name in ("start", "end", "size"):
            if (value := getattr(self, name)) is not None and not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"fault {self.kind!r}: {name} needs to be zero or more, found {value:g}")
        if self.kind == "garbled" and self.bad > 1.0:
            raise ValueError(f"fault 'garbled': size is a share of 1, found {self.bad:g}")

    @property
    def bad(self) -> float:
        """Magnitude, or the usual one of the kind."""
        return SIZES.get(self.kind, 0.0) if self.size is None else self.size

    @property
    def span(self) -> tuple[float, float]:
        """From when to when, s."""
        if self.kind in ("moved", "clock-jump", "time-backwards"):
            return self.start, math.inf
        return self.start, self.start + 1.0 if self.end is None else self.end


def refuse_unknown_units(faults: dict[str, list[LiveFault]], names: tuple[str, ...]) -> None:
    """Raises `ScenarioError` where a fault is that of a unit there is not."""
    for name in faults:
        if name not in names:
            raise ScenarioError(f"unknown unit {name!r} of a fault; units are {', '.join(names)}")
