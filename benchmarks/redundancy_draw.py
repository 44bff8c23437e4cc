"""Missions drawn from seeds: rest, then motion and rest in turn; a fault once all are calibrated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from benchmarks.redundancy_fault import InjectedFault, Kind, draw_fault
from benchmarks.redundancy_set import SimulatedSet, simulate_set
from tumble.foundation.recording import FloatArray

Drawn: TypeAlias = Kind | Literal["none"]
CYCLE: tuple[Drawn, ...] = (
    *("jump", "ramp", "scale", "none", "noise", "jump", "ramp", "stuck", "frozen"),
    *("swapped axes", "jump", "ramp", "scale", "none", "spikes", "wrong sign", "dead", "late"),
    *("not a number", "wrong sign"),
)
"""Kinds of successive seeds."""
UNITS = (2, 2, 3, 4, 4)
"""Numbers of units, drawn alike."""
REST_SECONDS = (8.0, 12.0)
MOTION_SECONDS = (38.0, 50.0)
FAULT_SECONDS = (115.0, 160.0)
"""When a fault begins: two motions have passed."""
AFTER_SECONDS = {"jump": 125.0, "ramp": 125.0, "scale": 125.0}
OTHERWISE_SECONDS = 60.0
"""s of a mission after its fault: long enough to be misled where that is tempting."""
SETTINGS: dict[str, object] = {"evaluate_every": 10.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnMission:
    """Mission drawn from a seed; flying it draws the rest."""

    seed: int
    kind: Drawn
    units: int
    faulty: int
    fault: InjectedFault | None
    spans: FloatArray
    """(n, 2) s of motion."""
    duration: float
    vibration: str
    precision: str

    @property
    def onset(self) -> float:
        """Returns when the fault shows at first, s: a gyroscope whose sign is wrong, when it moves."""
        if self.fault is None:
            return self.duration
        if self.fault.kind == "wrong sign" and self.fault.sensor == "gyroscope":
            return float(self.spans[0, 0])
        return self.fault.start

    def fly(self) -> SimulatedSet:
        """Simulates all units, without the fault."""
        random = np.random.default_rng([self.seed, 1])
        return simulate_set(random, self.units, self.spans, self.duration, self.vibration)


def draw(seed: int) -> DrawnMission:
    """Draws a mission; the same for the same seed."""
    random = np.random.default_rng([seed, 0])
    kind = CYCLE[seed % len(CYCLE)]
    units = int(random.choice(UNITS))
    start = 0.0 if kind == "wrong sign" else float(random.uniform(*FAULT_SECONDS))
    until = max(start, FAULT_SECONDS[0]) + AFTER_SECONDS.get(kind, OTHERWISE_SECONDS)
    return DrawnMission(
        seed=seed,
        kind=kind,
        units=units,
        faulty=0 if random.random() < 0.5 else int(random.integers(1, units)),
        fault=None if kind == "none" else draw_fault(random, kind, start),
        spans=_spans(random, until),
        duration=until,
        vibration="strong" if random.random() < 0.5 else "weak",
        precision="f32" if random.random() < 0.5 else "f64",
    )


def _spans(random: np.random.Generator, duration: float) -> FloatArray:
    found = []
    end = 0.0
    while end < duration:
        start = end + random.uniform(*REST_SECONDS)
        end = start + random.uniform(*MOTION_SECONDS)
        found.append((start, end))
    return np.array(found)


def kinds() -> tuple[str, ...]:
    """Returns all kinds that are drawn."""
    return ("none", *(kind for kind in get_args(Kind) if kind in CYCLE))
