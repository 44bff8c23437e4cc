"""Faults that a simulated recording can have on purpose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from tumble.foundation.results import TriadName

FaultKind = Literal[
    "scale",
    "stuck",
    "frozen",
    "moved",
    "bias-jump",
    "bias-drift",
    "noise",
    "spikes",
    "saturated",
    "nan",
    "swapped-axes",
    "left-handed",
    "wrong-unit",
    "gap",
    "absent",
    "dead",
    "late",
    "doubled",
    "time-backwards",
    "clock-jump",
]
AxisName = Literal["x", "y", "z"]

FAULTS: dict[FaultKind, str] = {
    "scale": "one axis has its scale multiplied by `size`, 1.2 if not given; the truth states it too",
    "stuck": "one axis repeats its last reading from `start` on",
    "frozen": "all axes repeat their last reading from `start` to `end`",
    "moved": "the unit slips about one axis by `size` deg at `start`, 2 if not given",
    "bias-jump": "the bias of one axis moves by `size` m/s^2 or rad/s at `start`, 1 or 0.1 if not given",
    "bias-drift": "the bias of one axis moves by `size` m/s^2 or rad/s, 1 or 0.1 if not given, evenly "
    "from `start` to `end`, and stays",
    "noise": "white noise grows on a triad from `start` on; at `end` it scatters by `size` m/s^2 or rad/s, "
    "1 or 0.1 if not given, and stays",
    "spikes": "readings of one axis, one in twenty, have errors of `size` m/s^2 or rad/s, 50 or 10 if not "
    "given, from `start` to `end`",
    "saturated": "a triad reads no more than `size` of gravity or of the turn rate (1 rad/s in flight), 0.8 "
    "if not given; always, or from `start`, or to `end`",
    "nan": "one axis reads not-a-number from `start` to `end`",
    "swapped-axes": "one axis and the next are exchanged in both triads",
    "left-handed": "one axis of both triads has its sign turned",
    "wrong-unit": "a triad is written in g or deg/s instead of m/s^2 or rad/s",
    "gap": "samples from `start` to `end` are missing",
    "absent": "samples up to `end` are missing, or all if not given",
    "dead": "the samples end at `start`",
    "late": "samples from `start` to `end` arrive late by `size` s, 0.5 if not given; their times stay",
    "doubled": "samples from `start` to `end` are written twice",
    "time-backwards": "the clock jumps back at `start` by `size` s, 1 if not given",
    "clock-jump": "the clock jumps ahead at `start` by `size` s, 1 if not given",
}
"""Effect of each kind."""

POSITIVE: tuple[FaultKind, ...] = ("saturated", "noise", "late", "time-backwards", "clock-jump")
"""Kinds whose size is positive."""
AXES: tuple[AxisName, ...] = get_args(AxisName)


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault of one unit. Fields that a kind does not use are ignored."""

    kind: FaultKind
    triad: TriadName = "accelerometer"
    axis: AxisName = "y"
    """The first of the six faces has x up, about which a slip would leave the accelerometer as it was."""
    start: float | None = None
    """s after the session began; the middle of the first rest if not given."""
    end: float | None = None
    """s after the session began; one second after `start` if not given."""
    size: float | None = None
    """Magnitude; unit and default depend on the kind, see `FAULTS`."""

    def __post_init__(self) -> None:
        if self.kind not in FAULTS:
            raise ValueError(f"unknown fault {self.kind!r}; known are {', '.join(FAULTS)}")
        if self.axis not in AXES:
            raise ValueError(f"fault {self.kind!r}: axis needs to be x, y or z, found {self.axis!r}")
        if self.triad not in get_args(TriadName):
            known = " or ".join(get_args(TriadName))
            raise ValueError(f"fault {self.kind!r}: triad needs to be {known}, found {self.triad!r}")
        for name in ("start", "end", "size"):
            if (value := getattr(self, name)) is not None and not math.isfinite(value):
                raise ValueError(f"fault {self.kind!r}: {name} needs to be a finite number, found {value:g}")
        if self.kind in POSITIVE and self.size is not None and not self.size > 0.0:
            raise ValueError(f"fault {self.kind!r}: size needs to be positive, found {self.size:g}")
