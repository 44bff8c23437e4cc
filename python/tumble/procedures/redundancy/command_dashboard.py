"""The dashboard of `tumble redundancy --live`: each unit, what it deviates by, and the source and why."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tumble.foundation.units import UNITS
from tumble.procedures.redundancy.known_faults import NO_SAMPLES
from tumble.procedures.redundancy.live import RedundancyStep, SetState, UnitRate
from tumble.procedures.redundancy.report.text import event_details, event_title
from tumble.procedures.redundancy.result import NONE_FIT, RedundancyEvent, Sensor
from tumble.report.numbers import readable_scale, significant

NEWEST = 6
"""Events below the table."""
SENSORS: tuple[Sensor, ...] = ("accelerometer", "gyroscope")
CALIBRATING = {
    "triggered": "waiting for motion",
    "motion began": "collecting",
    "fitted": "fitted",
    "adopted": "adopted",
    "refused": "refused",
    "abandoned": "abandoned",
    "withheld": "withheld",
    "restored": "stored before",
}
"""State of a calibration, by the event that reports it."""
STYLES = {"healthy": "green", "waiting": "dim", "disagrees": "yellow"}
"""Styles of conditions; those that are not listed are faults."""
ROUTINE = ("evaluated", "fitted")
"""Events that the table shows better than a line."""


class Dashboard:
    """Gathers steps; `rendered` is what to show after them. `units` are names, primary first."""

    def __init__(self, units: Sequence[str]) -> None:
        self._units = tuple(units)
        self._state: SetState | None = None
        self._conditions = dict.fromkeys(units, "")
        self._calibrations = dict.fromkeys(units, "")
        self._deviations: dict[tuple[str, str], RedundancyEvent] = {}
        self._source, self._why = "", "no samples yet"
        self._motion = ""
        self._newest: deque[RedundancyEvent] = deque(maxlen=NEWEST)

    def take(self, step: RedundancyStep) -> None:
        """Adds an event, or the state of the set."""
        if isinstance(step, SetState):
            self._state = step
            return
        if step.event not in ROUTINE:
            self._newest.append(step)
        self._see(step)

    def rendered(self) -> RenderableType:
        """Returns what to show."""
        return Group(self._head(), self._table(), *map(_line, self._newest))

    def _see(self, event: RedundancyEvent) -> None:
        reason = str(event.figures.get("reason", ""))
        match event.event:
            case "selected":
                self._source = "" if reason == NONE_FIT else event.unit
                self._why = reason
            case "evaluated":
                self._keep_deviation(event)
            case "rest began" | "rest ended":
                self._motion = "at rest" if event.event == "rest began" else "in motion"
            case "unhealthy" | "lost" | "silent":
                self._conditions[event.unit] = reason if event.event == "unhealthy" else event.event
            case "healthy" | "returned" | "agree":
                self._conditions[event.unit] = ""
            case "disagree":
                self._conditions[event.unit] = "disagrees"
            case "no samples":
                self._motion = NO_SAMPLES
            case word if word in CALIBRATING:
                self._calibrations[event.unit] = f"{CALIBRATING[word]}{f': {reason}' if reason else ''}"

    def _keep_deviation(self, event: RedundancyEvent) -> None:
        """Keeps the evaluation that is nearest to its threshold, or farthest beyond, of the newest rest."""
        place = event.unit, str(event.figures["sensor"])
        before = self._deviations.get(place)
        if before is None or before.time != event.time or _ratio(event) > _ratio(before):
            self._deviations[place] = event

    def _head(self) -> Text:
        elapsed = 0.0 if self._state is None else self._state.elapsed
        source = f"source {self._source} ({self._why})" if self._source else f"no source ({self._why})"
        words = [f"{elapsed:.0f} s", *([self._motion] if self._motion else []), source]
        return Text(", ".join(words), "bold" if self._source else "bold red")

    def _table(self) -> Table:
        table = Table("unit", "state", "rate", *SENSORS, "calibration")
        rates = {unit.name: unit for unit in self._state.units} if self._state is not None else {}
        for unit in self._units:
            condition = self._condition(unit, rates.get(unit))
            table.add_row(
                Text(unit, "bold" if unit == self._source else ""),
                Text(condition, STYLES.get(condition, "red")),
                _rate(rates.get(unit)),
                *(self._deviation(unit, sensor) for sensor in SENSORS),
                "primary" if unit == self._units[0] else self._calibrations[unit],
            )
        return table

    def _condition(self, unit: str, rate: UnitRate | None) -> str:
        if self._conditions[unit]:
            return self._conditions[unit]
        return "healthy" if rate is not None and rate.samples else "waiting"

    def _largest_limit(self, sensor: Sensor) -> float:
        """Returns the largest threshold in a column, which all of it is shown in a unit of."""
        found = [event for (_, of), event in self._deviations.items() if of == sensor]
        return max(abs(float(str(event.figures["threshold"]))) for event in found)

    def _deviation(self, unit: str, sensor: Sensor) -> Text:
        event = self._deviations.get((unit, sensor))
        if event is None:
            return Text("")
        found, limit = (abs(float(str(event.figures[name]))) for name in ("deviation", "threshold"))
        scale = readable_scale(UNITS[sensor], self._largest_limit(sensor))
        shown = scale.quantity(f"{significant(scale.factor * found)} of {significant(scale.factor * limit)}")
        return Text(shown, "red" if event.figures.get("exceeded") else "")


def _ratio(event: RedundancyEvent) -> float:
    limit = abs(float(str(event.figures["threshold"])))
    return abs(float(str(event.figures["deviation"]))) / limit if limit else math.inf


def _rate(unit: UnitRate | None) -> str:
    return "" if unit is None or math.isnan(unit.rate) else f"{unit.rate:.4g} Hz"


def _line(event: RedundancyEvent) -> Text:
    return Text(event_line(event), "dim")


def event_line(event: RedundancyEvent) -> str:
    """Describes an event in a line."""
    details = event_details(event)
    return f"{event.time:.2f} s  {event.unit}: {event_title(event)}{f': {details}' if details else ''}"
