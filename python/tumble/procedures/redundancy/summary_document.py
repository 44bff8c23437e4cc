"""JSON that `tumble redundancy` prints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tumble.foundation.printed import Printed, PrintedResult
from tumble.foundation.setting_table import Explained
from tumble.procedures.redundancy.explain import SETTINGS
from tumble.procedures.redundancy.result import SecondaryError, Selected
from tumble.procedures.redundancy.summary import SCHEMA


class RedundancyDocument(PrintedResult):
    """Result for the units of a redundant set."""

    schema_: Literal["tumble-redundancy-result/1"] = Field(SCHEMA, alias="schema")
    verdict: Literal["pass", "calibrated", "not calibrated", "fail"]
    primary: str
    secondaries: list[str]
    start: float
    """s of the clock of the logs."""
    end: float
    settings: dict[str, Any]
    preset: str
    """`as published`, or empty."""
    events: dict[str, int]
    """Number of each kind."""
    known_faults: list[str]
    """Faults that were known and stayed, the worst first."""
    output: list[str]
    """Known faults of the output that the platform would have used."""
    degraded: float
    """s in which the output was degraded."""
    errors: list[SecondaryError]
    selected: list[Selected]
    """Sources over time, with their reasons."""
    calibration_hash: str
    replay_rate: float
    """s of the logs in a second."""


class SettingsDocument(Printed):
    """All settings of the monitor, that `--explain` prints."""

    schema_: Literal["tumble-settings/1"] = Field(SETTINGS, alias="schema")
    verdict: Literal["listed"]
    settings: list[Explained]


class RedundancyEventLine(Printed):
    """Event of a redundant set, a line of `events.jsonl` and of a live session."""

    event: str
    """Such as `rest began`, `evaluated`, `triggered`, `adopted` (docs/how-to/redundancy.md#events)."""
    time: float
    """s of the recordings' common clock."""
    unit: str
    """Unit of the event."""
    figures: dict[str, float | int | str | bool | list[str] | None]
    """Its figures and reasons in words, SI units."""
