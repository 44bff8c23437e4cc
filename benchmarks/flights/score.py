"""Score of a flown mission against its truth."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from benchmarks.flights.body import Body
from benchmarks.flights.missions import Flight, Mission
from benchmarks.flights.replay import Replayed, events_of, missing_output, stored_at_end
from benchmarks.redundancy_judgement import Event, Judgement, judge, source_spans
from benchmarks.redundancy_replay import MISLED
from benchmarks.redundancy_set import SENSORS
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName
from tumble.procedures.redundancy.result import SecondaryError

FITTED_SECONDS = 40.0
"""s before an adoption whose motion the calibration came from, or longer ago."""
OWED = 1.5
"""Times the threshold of a deviation at rest, from which on a calibration is owed."""
IN_HEALTH = (
    "faulty_in_health",
    "disagree_in_health",
    "health",
    "changes_in_health",
    "without_source_in_health",
)
"""Figures of a judgement that count what came before the fault."""
SETTLED = 1.0
"""s after a stall of its own in which a unit is rightly reported late."""
GRACE = 5.0
"""s after its fault in which a unit may be the source without being counted."""


def scored(mission: Mission, replay: Replayed) -> dict[str, Any]:
    """Returns all that is counted of a mission, plain enough for JSON."""
    events = [event for event in events_of(replay.result) if not tells_of_stall(replay.flight, event)]
    judgement = judged(mission, events)
    first = mission.faults[0] if mission.faults else None
    health = judgement.health
    named = judgement.faulty_in_health
    if replay.before is not None:
        earlier = judge(events_of(replay.before[1]), None, 0.0, float(replay.before[0].body.time[-1]))
        health, named = health + earlier.health, named + earlier.faulty_in_health
    owed, recalibrated = _recalibrated(mission, replay, events)
    early = events_before(mission, replay, events)
    return {
        "seed": mission.seed,
        "kind": mission.kind,
        "units": len(mission.rates_hz),
        "rate": min(mission.rates_hz),
        "vibration": float(max(np.max(line.size[0]) for line in mission.shaking.lines)),
        "aged": mission.has_aged,
        "faulty": first.unit if first else None,
        "sensor": first.fault.sensor if first else None,
        "size": first.fault.size if first else None,
        "calibrated": _is_calibrated(mission, replay, events),
        "velocity": None,
        "angle": None,
        **asdict(judgement),
        "health": health,
        "faulty_in_health": named,
        "reasons_in_health": dict(Counter(e[3]["reason"] for e in early if e[2] == "unhealthy")),
        "misled": _misled(mission, replay),
        "missing": missing_output(
            replay.result, replay.flight.recorded, replay.flight.stalls.tolist(), replay.result.end
        ),
        "on_faulty": on_faulty(mission, events),
        "owed": owed,
        "recalibrated": recalibrated,
    }


def events_before(mission: Mission, replay: Replayed, events: Sequence[Event]) -> Iterator[Event]:
    """Returns what was reported while all units were sound, in the flight before too."""
    if replay.before is not None:
        yield from events_of(replay.before[1])
    yield from (event for event in events if event[0] < mission.onset)


def tells_of_stall(flight: Flight, event: Event) -> bool:
    """Returns whether a unit that stalls alone is reported late."""
    time, unit, what, figures = event
    if what != "unhealthy" or unit != flight.lonely or figures["reason"] != "late":
        return False
    return any(start <= time <= end + SETTLED for start, end in flight.own_stalls)


def judged(mission: Mission, events: Sequence[Event]) -> Judgement:
    """Judges the events; of two faults both have to be right, and the worse one is returned."""
    if not mission.faults:
        return judge(events, None, mission.duration, mission.duration)
    first = mission.faults[0]
    if len(mission.faults) == 1:
        return judge(events, first.unit, mission.onset, mission.duration)
    second = mission.faults[1]
    start = second.fault.start
    before = judge([event for event in events if event[0] < start], first.unit, mission.onset, start)
    later = [
        event for event in events if event[2] != "unhealthy" or (event[0] >= start and event[1] != first.unit)
    ]
    after = judge(later, second.unit, start, mission.duration)
    # The health of a mission is what came before its first fault.
    return before if before.outcome != "right" else _with_health_of(after, before)


def _with_health_of(judgement: Judgement, other: Judgement) -> Judgement:
    kept = (
        "faulty_in_health",
        "disagree_in_health",
        "health",
        "changes_in_health",
        "without_source_in_health",
    )
    return Judgement(**(asdict(judgement) | {name: getattr(other, name) for name in kept}))


def on_faulty(mission: Mission, events: Sequence[Event]) -> float:
    """Returns for how many s, from `GRACE` after its fault on, a faulty unit was the source."""
    total = 0.0
    for each in mission.faults:
        start = max(each.fault.start, mission.onset) + GRACE
        for first, last, unit in source_spans(events, mission.duration):
            total += max(0.0, last - max(first, start)) if unit == each.unit else 0.0
    return total


def error_of(
    flight: Flight, unit: int, sensor: TriadName, stored: SecondaryError | None, time: FloatArray
) -> float:
    """Returns what sets a compensated secondary apart from a faultless primary, rms over times (n,) s.

    Without noise, vibration and bias instability; with the warming, which a calibration cannot know of.
    """
    wanted = flight.units[0].ideal(flight.body, time, flight.warming)[sensor]
    read = flight.units[unit].ideal(flight.body, time, flight.warming)[sensor]
    matrix = flight.units[unit].turn if stored is None else stored.matrix
    bias = np.zeros(3) if stored is None else stored.bias
    error = np.linalg.solve(matrix, (read - bias).T).T - wanted
    if sensor == "accelerometer":
        stated = flight.units[unit].stated_arm
        arm = stated if stated is not None else None if stored is None else stored.lever_arm
        if arm is not None:
            error = error - _carried(flight.body, time, arm)
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1))))


def _carried(body: Body, time: FloatArray, arm: FloatArray) -> FloatArray:
    return body.at(time, arm)[0] - body.at(time, np.zeros(3))[0]


def _misled(mission: Mission, replay: Replayed) -> int:
    """Counts sound secondaries whose calibration, adopted since the fault, errs beyond `MISLED`."""
    faulty = {each.unit for each in mission.faults}
    found = set()
    for (unit, sensor), stored in stored_at_end(replay.result).items():
        if unit in faulty or not faulty or stored.adopted is None or stored.adopted < mission.onset:
            continue
        time = np.arange(max(1.0, stored.adopted - FITTED_SECONDS), stored.adopted, 0.05)
        if error_of(replay.flight, unit, sensor, stored, time) > MISLED[sensor]:
            found.add(unit)
    return len(found)


def _is_calibrated(mission: Mission, replay: Replayed, events: Sequence[Event]) -> bool:
    """Returns whether every sensor of every secondary had a calibration when the fault began."""
    if mission.kind == "wrong sign":
        return True
    known = _adopted(mission, events)
    if replay.before is not None:
        known |= set(stored_at_end(replay.before[1]))
    return all((unit, name) in known for unit in range(1, len(mission.rates_hz)) for name in SENSORS)


def _recalibrated(mission: Mission, replay: Replayed, events: Sequence[Event]) -> tuple[int, int]:
    """Counts sensors of secondaries that aged beyond their threshold, and those of them calibrated anew.

    Flights in which all units are sound until then count: the first rest decides which are due.
    """
    if replay.before is None or mission.onset <= 0.0:
        return 0, 0
    stored = stored_at_end(replay.before[1])
    rest = np.arange(0.5, _first_rest_ends(mission), 0.05)
    owed = {
        key
        for key, error in stored.items()
        if _deviation_at_rest(replay.flight, key[0], key[1], error, rest) > OWED * MISLED[key[1]]
    }
    return len(owed), len(owed & _adopted(mission, events))


def _adopted(mission: Mission, events: Sequence[Event]) -> set[tuple[int, TriadName]]:
    """Returns which sensors of which units were calibrated before the fault."""
    return {
        (unit, figures["sensor"])
        for time, unit, what, figures in events
        if what == "adopted" and time < mission.onset
    }


def _first_rest_ends(mission: Mission) -> float:
    """End of the first rest, s."""
    return float(mission.motions[0, 0]) - 0.2


def _deviation_at_rest(
    flight: Flight, unit: int, sensor: TriadName, stored: SecondaryError, time: FloatArray
) -> float:
    """Returns by how much |f| differs from gravity, or |w| from none, compensated, at a rest."""
    read = flight.units[unit].ideal(flight.body, time, flight.warming)[sensor].mean(axis=0)
    norm = float(np.linalg.norm(np.linalg.solve(stored.matrix, read - stored.bias)))
    return abs(norm - STANDARD_GRAVITY) if sensor == "accelerometer" else norm
