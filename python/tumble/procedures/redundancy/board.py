"""State of a watched set, gathered from the steps of a live monitor: terminals and pages show it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from tumble.procedures.redundancy.known_faults import NO_SAMPLES
from tumble.procedures.redundancy.live import RedundancyStep, SetState, UnitRate
from tumble.procedures.redundancy.result import NONE_FIT, RedundancyEvent, Sensor

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
ROUTINE = ("evaluated", "fitted")
"""Events that a table of units shows better than a line."""
HEALTHY, WAITING, DISAGREES = "healthy", "waiting", "disagrees"
"""Conditions without a fault; a fault is named by its reason."""
MOST_KEPT = 400
"""Evaluations of a sensor of a unit that are kept for a figure."""


@dataclass(frozen=True, slots=True)
class UnitOnBoard:
    """State of one unit."""

    name: str
    condition: str
    """`healthy`, `waiting`, `disagrees`, `lost`, `silent`, or the reason of a fault."""
    rate: UnitRate | None
    calibration: str
    """State of its calibration, with the reason; empty of the primary."""
    deviations: dict[Sensor, RedundancyEvent]
    """Newest evaluation of each sensor: the one nearest to its threshold, or farthest beyond."""
    calibrated: frozenset[Sensor]
    """Sensors that were calibrated after that evaluation."""
    cause: RedundancyEvent | None
    """Event that reported its fault, or why it was not calibrated; None where nothing is wrong."""


class SetBoard:
    """Gathers steps. `units` are names, primary first."""

    def __init__(self, units: Sequence[str], newest: int) -> None:
        self.units = tuple(units)
        self.state: SetState | None = None
        self.source, self.why = "", "no samples yet"
        """Name of the source, empty where there is none, and the reason."""
        self.motion = ""
        self.newest: deque[RedundancyEvent] = deque(maxlen=newest)
        """Newest events but for those of routine."""
        self.history: dict[tuple[str, Sensor], deque[tuple[float, float]]] = {}
        """Time, s, and deviation over threshold of evaluations, by unit and sensor."""
        self._conditions = dict.fromkeys(units, "")
        self._calibrations = dict.fromkeys(units, "")
        self._deviations: dict[tuple[str, Sensor], RedundancyEvent] = {}
        self._calibrated_since: set[tuple[str, Sensor]] = set()
        self._faults: dict[str, RedundancyEvent] = {}
        self._refusals: dict[str, RedundancyEvent] = {}

    def take(self, step: RedundancyStep) -> None:
        """Adds an event, or the state of the set."""
        if isinstance(step, SetState):
            self.state = step
            return
        if step.event not in ROUTINE:
            self.newest.append(step)
        self._see(step)

    def rows(self) -> Iterator[UnitOnBoard]:
        """Returns the state of each unit, primary first."""
        rates = {unit.name: unit for unit in self.state.units} if self.state is not None else {}
        for unit in self.units:
            yield UnitOnBoard(
                unit,
                self._condition(unit, rates.get(unit)),
                rates.get(unit),
                self._calibrations[unit],
                {of: event for (name, of), event in self._deviations.items() if name == unit},
                frozenset(of for name, of in self._calibrated_since if name == unit),
                self._faults.get(unit) or self._refusals.get(unit),
            )

    def _see(self, event: RedundancyEvent) -> None:
        reason = str(event.figures.get("reason", ""))
        match event.event:
            case "selected":
                self.source = "" if reason == NONE_FIT else event.unit
                self.why = reason
            case "evaluated":
                self._keep_deviation(event)
            case "rest began" | "rest ended":
                self.motion = "at rest" if event.event == "rest began" else "in motion"
            case "unhealthy" | "lost" | "silent":
                self._conditions[event.unit] = reason if event.event == "unhealthy" else event.event
                self._faults[event.unit] = event
            case "healthy" | "returned" | "agree":
                self._conditions[event.unit] = ""
                self._faults.pop(event.unit, None)
            case "disagree":
                self._conditions[event.unit] = DISAGREES
                self._faults[event.unit] = event
            case "no samples":
                self.motion = NO_SAMPLES
            case word if word in CALIBRATING:
                self._calibrations[event.unit] = f"{CALIBRATING[word]}{f': {reason}' if reason else ''}"
                self._note_refusal(event)
                if word == "adopted":
                    self._calibrated_since.add((event.unit, _sensor(event)))

    def _note_refusal(self, event: RedundancyEvent) -> None:
        self._refusals.pop(event.unit, None)
        if event.event in ("refused", "abandoned", "withheld"):
            self._refusals[event.unit] = event

    def _keep_deviation(self, event: RedundancyEvent) -> None:
        """Keeps the evaluation that is nearest to its threshold, or farthest beyond, of the newest rest."""
        place = event.unit, _sensor(event)
        before = self._deviations.get(place)
        is_new = before is None or before.time != event.time
        if before is not None and not is_new and ratio(event) <= ratio(before):
            return
        self._deviations[place] = event
        self._calibrated_since.discard(place)
        history = self.history.setdefault(place, deque(maxlen=MOST_KEPT))
        if not is_new:
            history.pop()
        history.append((event.time, ratio(event)))

    def _condition(self, unit: str, rate: UnitRate | None) -> str:
        if self._conditions[unit]:
            return self._conditions[unit]
        return HEALTHY if rate is not None and rate.samples else WAITING


def _sensor(event: RedundancyEvent) -> Sensor:
    return "gyroscope" if event.figures["sensor"] == "gyroscope" else "accelerometer"


def ratio(event: RedundancyEvent) -> float:
    """Returns the deviation of an evaluation over its threshold."""
    limit = abs(float(str(event.figures["threshold"])))
    return abs(float(str(event.figures["deviation"]))) / limit if limit else math.inf
