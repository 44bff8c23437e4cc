"""A mission, flown and put through the monitor, and what its units err by."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from benchmarks.redundancy_judgement import Event
from benchmarks.redundancy_mission import LASTING, Mission
from benchmarks.redundancy_stored import Record, StoredHistory
from benchmarks.redundancy_truth import carried, corrected
from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName
from tumble.tools.simulate.fault import FaultKind
from tumble.tools.simulate.flight.procedure import FlightTruth, SimulatedFlight

SENSORS: tuple[TriadName, TriadName] = ("accelerometer", "gyroscope")
SLOW = 0.5
"""s over which errors are averaged before they are squared."""
PIECE = 0.25
"""s of arrival that are replayed at a time: what is stored is seen after each adoption."""
FINE_PIECE = 0.001
"""s of the same from when a clock is at fault. Within a piece, samples go by their time stamps; a device
meets stamps that jump, and samples that are late, in order of arrival."""
FINE_SECONDS = 2.0
"""s for which pieces are fine after the start and the end of such a fault."""
BURST = 0.02
"""s of the pieces from then on, where a clock stays wrong: as if samples came in bursts."""
CLOCK_FAULTS: frozenset[FaultKind] = frozenset({"clock-jump", "time-backwards", "late", "gap", "doubled"})


@dataclass(slots=True)
class Flown:
    """A mission with all that the monitor gave."""

    mission: Mission
    flight: SimulatedFlight
    events: list[Event] = field(default_factory=list)
    stored: StoredHistory = field(default_factory=StoredHistory)
    seconds: float = 0.0
    pieces: list[_core.RedundancyReplay] = field(default_factory=list)

    @property
    def window(self) -> float:
        """Returns the length of the monitor's windows, s."""
        return float(str(self.mission.settings["window"]))

    def joined(self, name: str) -> FloatArray:
        """Puts the pieces of an array together."""
        each = [piece[name] for piece in self.pieces]  # type: ignore[literal-required]
        return np.concatenate(each)

    def of_units(self, name: str) -> list[FloatArray]:
        """Puts the pieces of an array of each unit together."""
        each = [piece[name] for piece in self.pieces]  # type: ignore[literal-required]
        return [np.concatenate(unit) for unit in zip(*each, strict=True)]


def replayed(mission: Mission) -> Flown:
    """Flies a mission and puts it through the monitor, piece by piece."""
    flight = mission.fly()
    flown = Flown(mission, flight)
    monitor = _core.RedundancyMonitor(mission.told(flight), mission.settings, mission.precision)
    edges = _edges(flight)
    cuts = [np.searchsorted(unit.arrival, edges) for unit in flight.units]
    pieces = len(edges) - 1
    for index in range(pieces):
        parts = [slice(cut[index], cut[index + 1]) for cut in cuts]
        piece = monitor.replay(
            [unit.time[part] for unit, part in zip(flight.units, parts, strict=True)],
            [unit.specific_force[part] for unit, part in zip(flight.units, parts, strict=True)],
            [unit.angular_rate[part] for unit, part in zip(flight.units, parts, strict=True)],
        )
        flown.pieces.append(piece)
        flown.seconds += piece["seconds"]
        events = [(float(t), int(unit), name, dict(figures)) for t, unit, name, figures in piece["events"]]
        flown.events += events
        flown.stored.take(events, monitor.records())
    return flown


def _edges(flight: SimulatedFlight) -> FloatArray:
    """Returns the times of arrival, s, between which samples are replayed at a time."""
    end = max(float(unit.arrival[-1]) for unit in flight.units if len(unit.arrival)) + PIECE
    edges = [np.arange(PIECE, end, PIECE), np.array([-1.0, end])]
    for fault in (each for unit in flight.units for each in unit.faults if each.kind in CLOCK_FAULTS):
        for moment in (fault.start, fault.end):
            if moment is not None and moment < end:
                until = min(moment + FINE_SECONDS, end)
                edges.append(np.arange(max(moment - 0.1, PIECE), until, FINE_PIECE))
                if fault.kind in LASTING:
                    edges.append(np.arange(until, end, BURST))
    return np.unique(np.concatenate(edges))


def unhealthy(flown: Flown, at: float) -> set[int]:
    """Units that are called unhealthy at a time."""
    ill: set[int] = set()
    for time, number, what, _ in flown.events:
        if time <= at and what == "unhealthy":
            ill.add(number)
        elif time <= at and what == "healthy":
            ill.discard(number)
    return ill


def error_left(
    flown: Flown,
    number: int,
    name: TriadName,
    record: Record | None,
    as_read: FloatArray,
    truth: FlightTruth,
    measure: FloatArray,
) -> FloatArray:
    """Error (n, 3) of what a secondary reads, compensated with a record, at the primary's place."""
    unit = flown.flight.units[number]
    matrix = unit.nominal_mounting if record is None else np.asarray(record["matrix"])
    bias = np.zeros(3) if record is None else np.asarray(record["bias"])
    as_primary = np.linalg.solve(matrix, (as_read - bias).T).T
    said = corrected(flown.mission, flown.flight, name, as_primary)
    if name == "accelerometer":
        arm = np.zeros(3)
        if flown.mission.known_arms[number]:
            arm = unit.lever_arm
        elif record is not None and record["lever_arm"] is not None:
            arm = np.asarray(record["lever_arm"])
        said = said - carried(truth, arm)
    return np.asarray(said - measure)


def root_mean_square(error: FloatArray, window: float) -> float:
    """Root mean square of means over half a second of successive windows, each of `window` s."""
    length = max(1, round(SLOW / window))
    whole = len(error) // length * length
    error = error[:whole].reshape(-1, length, 3).mean(axis=1)
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1)))) if len(error) else float("nan")


def after_time_jumped(flown: Flown, time: FloatArray) -> npt.NDArray[np.bool_]:
    """Returns for each time whether it is after a jump of the common clock."""
    torn = [event[0] for event in flown.events if event[2] == "time jumped"]
    torn += [
        f.start
        for f in flown.flight.units[0].faults
        if f.kind in ("clock-jump", "time-backwards") and f.start
    ]
    return np.asarray(time > min(torn, default=np.inf))
