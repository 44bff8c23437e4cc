"""Faults of a unit that is read live, with their remedies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from tumble.acquisition.acquire import si_unit
from tumble.acquisition.imu import Imu
from tumble.tools.record.procedure import RecordStep

BROKEN = {
    "silent": "is silent; check its power and cable, and that it sends to this address",
    "lost": "was lost ({reason}); plug it in again, it is looked for every second",
    "returned": "is there again; check that it is the same unit, in the same place",
}
"""Texts by the kind of a step of a recording."""
REFUSED = "is read no further ({reason})"
"""Text for a unit whose source now states something else."""


@dataclass(frozen=True, slots=True)
class Objection:
    """Something wrong with a unit, and what to do about it."""

    unit: str
    key: str
    """The same for what is the same trouble, whatever its figures by now."""
    text: str


def broken(step: RecordStep) -> str:
    """Describes the state of the line of a unit; empty for a step of another kind."""
    text = REFUSED if step.is_final else BROKEN.get(step.kind, "")
    return text.format(reason=step.reason)


def faults(name: str, unit: Imu) -> Iterator[Objection]:
    """Names channels of a unit that are stuck, or at the end of their range."""
    remedies = {
        "stuck": "check the sensor and its cable",
        "saturated in motion": "turn more slowly, or choose a larger range",
        "saturated at rest": "choose a larger range",
    }
    for channel, kind, value, first, *_ in unit.faults:
        seen = "is stuck" if kind == "stuck" else "is saturated"
        text = f"{channel} {seen} at {value:.4g} {si_unit(channel)} since {first:.1f} s; {remedies[kind]}"
        yield Objection(name, f"{kind} {channel}", text)
