"""Questions that a run asks before it begins, from which a form is made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from tumble.foundation.message import NOTHING, Message

FieldKind: TypeAlias = Literal["choice", "number", "text", "flag", "file"]
FieldValue: TypeAlias = str | float | bool | None


@dataclass(frozen=True, slots=True, kw_only=True)
class RunField:
    """One question, and what may be answered."""

    name: str
    """Key of the answer in the options of an order."""
    label: Message
    kind: FieldKind
    default: FieldValue = None
    help: Message = NOTHING
    unit: str = ""
    """Unit of a number: `s`."""
    choices: tuple[tuple[str, Message], ...] = ()
    """Values of a choice, each with its label."""
    least: float | None = None
    most: float | None = None
    """Bounds of a number, both allowed."""
    advanced: bool = False
    """Indicates whether most operators leave it as it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitRole:
    """A role that units have in a run, and for how many of them there is a place."""

    name: str
    """`reference`, `target`, `primary`, `secondary`, `unit`."""
    label: Message
    fewest: int = 1
    most: int | None = 1
    """None for as many as there are."""
