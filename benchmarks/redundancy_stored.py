"""Stored errors of a monitor, over time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from benchmarks.redundancy_judgement import Event

Record = Mapping[str, object]
Stored = Mapping[tuple[int, str], Record]
"""By unit and sensor."""


@dataclass(slots=True)
class StoredHistory:
    """Stored errors from each time on, s."""

    steps: list[tuple[float, Stored]] = field(default_factory=list)

    def at(self, time: float) -> Stored:
        """Returns what was stored just before a time."""
        known: Stored = {}
        for since, stored in self.steps:
            if since < time:
                known = stored
        return known

    def take(self, events: Iterable[Event], records: Iterable[Record]) -> None:
        """Adds the records of adoption events."""
        by_sensor = {(int(str(record["identity"])) - 1, str(record["sensor"])): record for record in records}
        for time, unit, what, figures in events:
            if what == "adopted":
                known = self.steps[-1][1] if self.steps else {}
                sensor = (unit, str(figures["sensor"]))
                self.steps.append((time, {**known, sensor: by_sensor[sensor]}))
