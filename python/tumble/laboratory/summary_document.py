"""JSON that `tumble registry` prints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tumble.foundation.printed import Printed
from tumble.laboratory.command import SCHEMA


class RegistryDocument(Printed):
    """Rows of the registry: each command prints the keys that belong to it."""

    schema_: Literal["tumble-registry/1"] = Field(SCHEMA, alias="schema")
    verdict: Literal["added", "listed", "due", "not due", "intact", "damaged"]
    added: list[dict[str, Any]] | None = None
    """Results of `add`, with whether each is new."""
    results: list[dict[str, Any]] | None = None
    """Results of `list`, the latest first."""
    result: str | None = None
    """Identity of the result that `show` found."""
    unit: dict[str, Any] | None = None
    """Unit of `show` and `history`."""
    session: dict[str, Any] | None = None
    recordings: list[dict[str, Any]] | None = None
    parameters: list[dict[str, Any]] | None = None
    """Parameters of `show`, or of the lot of `history`."""
    decisions: list[dict[str, Any]] | None = None
    superseded_by: Any = None
    values: list[dict[str, Any]] | None = None
    """Values of `history` over time."""
    due: list[dict[str, Any]] | None = None
    """Due date of each parameter of `history`."""
    units: int | list[dict[str, Any]] | None = None
    """Units of `due`, or how many `history` of a lot has."""
    equipment: list[dict[str, Any]] | None = None
    """Equipment with the dates at which it is due."""
    verification: dict[str, Any] | None = None
    """Counts and faults of `verify`."""
