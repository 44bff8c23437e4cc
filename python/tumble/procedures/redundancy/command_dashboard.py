"""The dashboard of `tumble redundancy --live`: each unit, what it deviates by, and the source and why."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.procedures.redundancy.board import DISAGREES, HEALTHY, SENSORS, WAITING, SetBoard, UnitOnBoard
from tumble.procedures.redundancy.live import RedundancyStep, UnitRate
from tumble.procedures.redundancy.report.text import deviation_of_threshold, event_details, event_title
from tumble.procedures.redundancy.result import RedundancyEvent, Sensor

NEWEST = 6
"""Events below the table."""
STYLES = {HEALTHY: "green", WAITING: "dim", DISAGREES: "yellow"}
"""Styles of conditions; those that are not listed are faults."""


class Dashboard:
    """Gathers steps; `rendered` is what to show after them. `units` are names, primary first."""

    def __init__(self, units: Sequence[str]) -> None:
        self._board = SetBoard(units, NEWEST)

    def take(self, step: RedundancyStep) -> None:
        """Adds an event, or the state of the set."""
        self._board.take(step)

    def rendered(self) -> RenderableType:
        """Returns what to show."""
        return Group(self._head(), self._table(), *map(_line, self._board.newest))

    def _head(self) -> Text:
        board = self._board
        elapsed = 0.0 if board.state is None else board.state.elapsed
        source = f"source {board.source} ({board.why})" if board.source else f"no source ({board.why})"
        words = [f"{elapsed:.0f} s", *([board.motion] if board.motion else []), source]
        return Text(", ".join(words), "bold" if board.source else "bold red")

    def _table(self) -> Table:
        table = Table("unit", "state", "rate", *SENSORS, "calibration")
        rows = list(self._board.rows())
        for row in rows:
            table.add_row(
                Text(row.name, "bold" if row.name == self._board.source else ""),
                Text(row.condition, STYLES.get(row.condition, "red")),
                _rate(row.rate),
                *(_deviation(row, sensor, rows) for sensor in SENSORS),
                "primary" if row.name == self._board.units[0] else row.calibration,
            )
        return table


def _deviation(row: UnitOnBoard, sensor: Sensor, rows: Sequence[UnitOnBoard]) -> Text:
    event = row.deviations.get(sensor)
    if event is None:
        return Text("")
    beside = [each.deviations[sensor] for each in rows if sensor in each.deviations]
    return Text(deviation_of_threshold(event, beside), "red" if event.figures.get("exceeded") else "")


def _rate(unit: UnitRate | None) -> str:
    return "" if unit is None or math.isnan(unit.rate) else f"{unit.rate:.4g} Hz"


def _line(event: RedundancyEvent) -> Text:
    return Text(event_line(event), "dim")


def event_line(event: RedundancyEvent) -> str:
    """Describes an event in a line."""
    details = event_details(event)
    return f"{event.time:.2f} s  {event.unit}: {event_title(event)}{f': {details}' if details else ''}"
