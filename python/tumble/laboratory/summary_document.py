"""JSON that the commands of `tumble registry` print, a document each."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

from pydantic import Field

from tumble.foundation.printed import Printed

TableRow: TypeAlias = dict[str, Any]
"""Row of a table of the registry, by column (docs/how-to/registry.md)."""


class AddedRow(Printed):
    """A result that was given to the registry."""

    result: str
    """Its identity."""
    name: str
    serial: str
    new: bool
    """True where it was not there before."""


class AddDocument(Printed):
    """Results that `add` was given."""

    schema_: Literal["tumble-registry-add/1"] = Field("tumble-registry-add/1", alias="schema")
    verdict: Literal["added"]
    added: list[AddedRow]


class ListDocument(Printed):
    """Results, the latest first."""

    schema_: Literal["tumble-registry-list/1"] = Field("tumble-registry-list/1", alias="schema")
    verdict: Literal["listed"]
    results: list[TableRow]


class ShowDocument(Printed):
    """One result with all that belongs to it."""

    schema_: Literal["tumble-registry-show/1"] = Field("tumble-registry-show/1", alias="schema")
    verdict: Literal["listed"]
    result: TableRow
    unit: TableRow
    session: TableRow
    """The run that found it, with its `options`."""
    recordings: list[TableRow]
    parameters: list[TableRow]
    decisions: list[TableRow]
    superseded_by: list[str]


class HistoryDocument(Printed):
    """Values of a unit over time."""

    schema_: Literal["tumble-registry-history/1"] = Field("tumble-registry-history/1", alias="schema")
    verdict: Literal["listed"]
    unit: TableRow
    values: list[TableRow]
    due: list[TableRow]
    """Due date of each parameter."""


class LotDocument(Printed):
    """Capability of a lot or model, printed by `history` with `--lot` or `--model`."""

    schema_: Literal["tumble-registry-lot/1"] = Field("tumble-registry-lot/1", alias="schema")
    verdict: Literal["listed"]
    units: int
    """Number of units."""
    parameters: list[TableRow]


class DueUnit(Printed):
    """One unit with its due date."""

    unit: TableRow
    due: str
    """Date such as `2027-06-30`; empty where there is none."""
    parameters: list[TableRow]


class DueDocument(Printed):
    """Units with the dates at which they are due."""

    schema_: Literal["tumble-registry-due/1"] = Field("tumble-registry-due/1", alias="schema")
    verdict: Literal["due", "not due"]
    units: list[DueUnit]


class EquipmentDocument(Printed):
    """Equipment with the dates at which it is due."""

    schema_: Literal["tumble-registry-equipment/1"] = Field("tumble-registry-equipment/1", alias="schema")
    verdict: Literal["listed"]
    equipment: list[TableRow]


class Verified(Printed):
    """Counts and faults."""

    entries: int
    documents: int
    head: str
    """Hash of the last entry."""
    unreferenced: int
    """Documents that no row refers to; they do no harm."""
    faults: list[str]
    intact: bool


class VerifyDocument(Printed):
    """Outcome of a check of the whole registry."""

    schema_: Literal["tumble-registry-verify/1"] = Field("tumble-registry-verify/1", alias="schema")
    verdict: Literal["intact", "damaged"]
    verification: Verified
