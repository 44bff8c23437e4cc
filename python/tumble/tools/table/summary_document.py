"""JSON that `tumble table` prints."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tumble.foundation.printed import Printed
from tumble.tools.table.command import POSITION, TABLES


class PrintedProfile(Printed):
    """Profile of a table."""

    name: str
    axes: list[str]
    tried: str | None
    """On which table, and when; null if on none."""


class TablesDocument(Printed):
    """Drivers and profiles of tables."""

    schema_: Literal["tumble-tables/1"] = Field(TABLES, alias="schema")
    verdict: Literal["listed"]
    drivers: list[str]
    profiles: dict[str, PrintedProfile]


class PositionDocument(Printed):
    """Where a table is."""

    schema_: Literal["tumble-table-position/1"] = Field(POSITION, alias="schema")
    verdict: Literal["known", "partly known"]
    name: str
    position_deg: dict[str, float | None]
    """By axis."""
