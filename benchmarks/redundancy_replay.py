"""A mission put through the monitor, and how wrong what it stores and gives is."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks.redundancy_draw import SETTINGS, DrawnMission
from benchmarks.redundancy_fault import InjectedFault
from benchmarks.redundancy_judgement import Event, source_spans
from benchmarks.redundancy_set import SENSORS, Body, Samples, SimulatedSet, Unit
from benchmarks.redundancy_stored import StoredHistory
from tumble import _core
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName
from tumble.logs.aiding import Aiding, NativeAiding, in_order

PIECE = 5.0
"""s of arrival that are replayed at a time: what is stored is seen between two."""
FINE_PIECE = 0.01
"""s of the same where samples arrive late: within a piece they go by their stamps."""
FINE_SECONDS = 3.0
"""s for which pieces are fine; from then on a tenth as fine."""

AIDING_HZ, AIDING_SIGMA = 5.0, 0.3
"""Rate, and noise of each axis of a velocity, m/s."""
MISLED = {"accelerometer": 0.1, "gyroscope": 0.01}
"""m/s^2 and rad/s by which a calibration that followed a wrong primary errs more; a trigger, too."""
SPARSE = 100
"""Steps of the body from one moment to the next at which errors of records are taken."""


@dataclass(slots=True)
class Replay:
    """Output of the monitor."""

    events: list[Event] = field(default_factory=list)
    stored: StoredHistory = field(default_factory=StoredHistory)


def flown(
    mission: DrawnMission, *, with_aiding: bool = False
) -> tuple[SimulatedSet, tuple[Samples, ...], Replay]:
    """Simulates a mission, puts its fault in, and replays it: the set, all samples, the outcome."""
    simulated, said = simulated_with_fault(mission)
    return simulated, said, watched(mission, simulated, said, with_aiding=with_aiding)


def simulated_with_fault(mission: DrawnMission) -> tuple[SimulatedSet, tuple[Samples, ...]]:
    """Simulates a mission: the set, and the samples of all units with the fault in one of them."""
    simulated = mission.fly()
    return simulated, spoilt(simulated.samples, mission.faulty, mission.fault)


def watched(
    mission: DrawnMission, simulated: SimulatedSet, said: Sequence[Samples], *, with_aiding: bool = False
) -> Replay:
    """Puts the samples of all units of a mission through a monitor of the mission's precision."""
    told = [unit.told(number) for number, unit in enumerate(simulated.units)]
    monitor = _core.RedundancyMonitor(told, SETTINGS, mission.precision)
    heard = aiding(simulated.body, mission.seed) if with_aiding else []
    return replay(monitor, said, edges(mission.duration, mission.fault), heard)


def aiding(body: Body, seed: int) -> list[NativeAiding]:
    """Returns the velocity of a satellite receiver."""
    step = body.time[1] - body.time[0]
    level = np.einsum("nij,nj->ni", body.level_from_body, body.specific_force)
    velocity = np.cumsum(level - [0.0, 0.0, STANDARD_GRAVITY], axis=0) * step
    every = round(1.0 / (AIDING_HZ * step))
    time, said = body.time[::every], velocity[::every]
    noise = np.random.default_rng([seed, *b"aiding"]).standard_normal(said.shape)
    return in_order([Aiding.velocity(time, said + AIDING_SIGMA * noise, AIDING_SIGMA)], ())


def spoilt(samples: Sequence[Samples], faulty: int, fault: InjectedFault | None) -> tuple[Samples, ...]:
    """Returns the samples of all units with the fault in one of them."""
    return tuple(
        each if fault is None or number != faulty else fault.inject(each)
        for number, each in enumerate(samples)
    )


def edges(end: float, fault: InjectedFault | None) -> FloatArray:
    """Returns the times of arrival, s, between which samples are replayed at a time."""
    found = [np.arange(0.0, end, PIECE), np.array([np.inf])]
    if fault is not None and fault.kind == "late":
        fine = min(fault.start + FINE_SECONDS, end)
        found += [np.arange(fault.start, fine, FINE_PIECE), np.arange(fine, end, 10.0 * FINE_PIECE)]
    return np.unique(np.concatenate(found))


def replay(
    monitor: _core.RedundancyMonitor,
    said: Sequence[Samples],
    until: FloatArray,
    measurements: Sequence[NativeAiding] = (),
) -> Replay:
    """Puts the samples of all units through a monitor, piece by piece."""
    found = Replay()
    cuts = [np.searchsorted(each.arrival, until) for each in said]
    heard = [bisect_left(measurements, time, key=lambda each: each[0]) for time in until]
    for index in range(len(until) - 1):
        parts = [slice(cut[index], cut[index + 1]) for cut in cuts]
        piece = monitor.replay(
            [each.time[part] for each, part in zip(said, parts, strict=True)],
            [each.specific_force[part] for each, part in zip(said, parts, strict=True)],
            [each.angular_rate[part] for each, part in zip(said, parts, strict=True)],
            measurements=measurements[heard[index] : heard[index + 1]],
        )
        events = [(float(t), int(unit), what, dict(figures)) for t, unit, what, figures in piece["events"]]
        found.events += events
        found.stored.take(events, monitor.records())
    return found


def error_of(
    record: Mapping[str, object] | None,
    unit: Unit,
    primary: Unit,
    sensor: TriadName,
    body: Body,
    since: float,
) -> float:
    """Root mean square of what sets a compensated secondary apart from a faultless primary from a time on, s.

    The error is that in the later motion of the body, without noise, drift and vibration.
    """
    then = body.part(since, SPARSE)
    said, wanted = reading(unit, sensor, then), reading(primary, sensor, then)
    matrix = unit.turn if record is None else np.asarray(record["matrix"])
    bias = np.zeros(3) if record is None else np.asarray(record["bias"])
    error = np.linalg.solve(matrix, (said - bias).T).T - wanted
    if sensor == "accelerometer":
        found = None if record is None else record["lever_arm"]
        known = found if unit.stated_arm is None else unit.stated_arm
        error -= then.carried(np.zeros(3) if known is None else np.asarray(known))
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1))))


def reading(unit: Unit, sensor: TriadName, body: Body) -> FloatArray:
    """Returns what a unit reads (n, 3), without noise, drift and vibration."""
    true = body.specific_force + body.carried(unit.arm) if sensor == "accelerometer" else body.angular_rate
    return np.asarray(true @ unit.matrix[sensor].T + unit.bias[sensor])


def gathered(
    clean: Samples, faulty: Samples, unit: Unit, body: Body, spans: Sequence[tuple[float, float]]
) -> dict[TriadName, float]:
    """Integrates what a fault adds to the output over spans in which its unit is the source.

    Level axes: m/s for the accelerometer, rad for the gyroscope.
    """
    found = {}
    chosen = np.zeros(len(clean.arrival), dtype=bool)
    for start, end in spans:
        chosen |= (clean.arrival >= start) & (clean.arrival < end)
    index = np.clip(
        (clean.arrival[chosen] / (body.time[1] - body.time[0])).astype(int), 0, len(body.time) - 1
    )
    for sensor in SENSORS:
        error = np.nan_to_num(faulty.of(sensor)[chosen] - clean.of(sensor)[chosen]) @ unit.turn
        turned = np.einsum("nij,nj->i", body.level_from_body[index], error)
        found[sensor] = float(np.linalg.norm(turned) / unit.rate_hz)
    return found


def source_of(events: Sequence[Event], unit: int, start: float, end: float) -> list[tuple[float, float]]:
    """Returns the spans from `start` to `end` in which a unit is the source."""
    return [
        (max(first, start), min(last, end))
        for first, last, number in source_spans(events, end)
        if number == unit and last > start
    ]
