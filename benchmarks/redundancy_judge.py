"""Flies a mission, replays it through the monitor, and judges what the monitor did against the truth.

The measure is what a faultless primary would say (`redundancy_truth.reference`), since the set is to agree
with its primary. All root mean squares are of the norm of the error of means over half a second: vibration,
which every unit samples at instants of its own, is no error of a calibration.

*Wrongly adopted*: over the rest of the mission, as long as that unit has no new fault, the adopted error
leaves more than the one that was stored before (or none), by more than a tenth and by more than 0.03 m/s^2
or 0.003 rad/s. It is *misled* where the primary itself was at fault until then: with two units and at rest,
an error of the primary across gravity cannot be seen; such ones are counted apart, not left out.

*Missed trigger*: at an evaluation, the means of the raw samples over the rest, taken anew in numpy and
compensated with what was stored then, deviate by more than 1.2 of the threshold, the gate's sensors of the
primary deviate by less than 0.8 of theirs, both units are without fault and called healthy, and there is
neither a trigger nor a calibration under way. *False trigger*: it was triggered while they deviate by less
than 0.8 of every threshold of the sensors that were triggered.

*False alarm*: a unit is called unhealthy while none of its faults is at work, and none ended within the last
second. What is wrong with it from the factory is no fault, but may be beyond what is plausible at rest: an
alarm at rest is false only if the deviation is within the limit that the event states.

*Failover*: the time from the start of the primary's fault to the selection of another unit; it is *missed*
if there is none though the fault is one of `EVIDENT` and a secondary is without fault and in health.
"""

from __future__ import annotations

import numpy as np

from benchmarks.redundancy_flown import (
    SENSORS,
    Flown,
    after_time_jumped,
    error_left,
    replayed,
    root_mean_square,
    unhealthy,
)
from benchmarks.redundancy_mission import draw
from benchmarks.redundancy_output import judge_output
from benchmarks.redundancy_triggers import judge_triggers
from benchmarks.redundancy_truth import faulty, reference, spans
from benchmarks.redundancy_verdict import Verdict
from tumble.recording import FloatArray
from tumble.results import TriadName
from tumble.simulate.fault import Fault, FaultKind
from tumble.simulate.flight.procedure import FlightTruth

MARGIN: dict[TriadName, float] = {"accelerometer": 0.03, "gyroscope": 0.003}
"""m/s^2 and rad/s."""
SHARE = 0.1
SHORTEST = 5.0
"""s without fault that an adoption needs after it to be judged."""
EVIDENT: frozenset[FaultKind] = frozenset({"dead", "frozen", "nan", "gap", "absent"})
"""Faults that show in the data of the unit alone, whatever it measures."""
EVIDENT_SECONDS = 0.3
"""Time for which they have to last, to be called missed."""


def judged(seed: int) -> Verdict:
    """Draw, fly, replay and judge one mission."""
    flown = replayed(draw(seed))
    verdict = Verdict(seed, flown.flight.duration, len(flown.flight.units))
    verdict.replay_rate = flown.flight.duration / max(flown.seconds, 1e-9)
    for name in ("triggered", "adopted", "refused", "abandoned"):
        verdict.counts[name] = sum(event[2] == name for event in flown.events)
    _judge_adoptions(flown, verdict)
    judge_triggers(flown, verdict)
    _judge_alarms(flown, verdict)
    _judge_failovers(flown, verdict)
    judge_output(flown, verdict)
    return verdict


def _judge_adoptions(flown: Flown, verdict: Verdict) -> None:
    adopted = [event for event in flown.events if event[2] == "adopted"]
    verdict.counts["wrongly adopted"] = verdict.counts["misled"] = verdict.counts["not judged"] = 0
    if not adopted:
        return
    time = flown.joined("window_time")
    window = flown.window
    truth = flown.flight.truth(time, window)
    measure = reference(flown.mission, flown.flight, time, window)
    for at, number, _, figures in adopted:
        name: TriadName = figures["sensor"]
        before, after = _left(flown, number, name, at, time, truth, measure[name])
        if not np.isfinite(before):
            verdict.counts["not judged"] += 1
            continue
        begun = max(e[0] for e in flown.events if e[1] == number and e[2] == "triggered" and e[0] <= at)
        misled = any(start < at and (end > begun) for start, end in map(spans, flown.flight.units[0].faults))
        wrong = after > (1.0 + SHARE) * before and after - before > MARGIN[name]
        verdict.adoptions.append(
            {
                "unit": number,
                "sensor": name,
                "time": at,
                "rung": figures["rung"],
                "before": before,
                "after": after,
                "wrong": bool(wrong),
                "misled": bool(wrong and misled),
            }
        )
        if wrong:
            kind = "misled" if misled else "wrongly adopted"
            verdict.counts[kind] += 1
            verdict.findings.append(
                f"{kind}: unit {number} {name} at {at:.1f} s, {figures['rung']}: {before:.4g} -> {after:.4g};"
                f" residual {figures['residual_before']:.4g} -> {figures['residual']:.4g}"
            )


def _left(
    flown: Flown,
    number: int,
    name: TriadName,
    at: float,
    time: FloatArray,
    truth: FlightTruth,
    measure: FloatArray,
) -> tuple[float, float]:
    """Root mean square of what the error stored before, and the adopted one, leave after an adoption."""
    unit = flown.flight.units[number]
    clean = (time > at) & ~faulty(unit, time, began_after=at)
    clean &= ~after_time_jumped(flown, time)
    readings = flown.of_units("specific_force" if name == "accelerometer" else "angular_rate")[number]
    clean &= np.isfinite(readings).all(axis=1)
    if not clean.sum() * flown.window > SHORTEST:
        return np.nan, np.nan
    records = [flown.stored_at(moment).get((number, name)) for moment in (at, np.nextafter(at, np.inf))]
    as_read = readings @ unit.nominal_mounting.T
    before, after = (
        root_mean_square(
            error_left(flown, number, name, record, as_read, truth, measure)[clean], flown.window
        )
        for record in records
    )
    return before, after


def _judge_alarms(flown: Flown, verdict: Verdict) -> None:
    verdict.counts["false alarms"] = verdict.counts["alarms"] = 0
    for at, number, what, figures in flown.events:
        if what != "unhealthy" or after_time_jumped(flown, np.array([at - 1e-6]))[0]:
            continue
        verdict.counts["alarms"] += 1
        if faulty(flown.flight.units[number], np.array([at]))[0]:
            continue
        if figures["reason"] == "implausible at rest":
            continue
        if figures["reason"] == "late" and at > flown.flight.duration - 0.2:
            continue
        verdict.counts["false alarms"] += 1
        verdict.findings.append(f"false alarm: unit {number} at {at:.2f} s, {figures}")


def _judge_failovers(flown: Flown, verdict: Verdict) -> None:
    verdict.counts["missed failovers"] = 0
    units = flown.flight.units
    selections = [(e[0], e[1], e[3]["reason"]) for e in flown.events if e[2] == "selected"]
    for fault in units[0].faults:
        start, end = spans(fault)
        start = max(start, 0.0)
        if start > flown.flight.duration - 1.0 or end <= start:
            continue
        # The primary was the source before, so that there is something to fail over from.
        source = [unit for time, unit, _ in selections if time <= start]
        if source and source[-1] != 0:
            continue
        to = next(
            (
                (t, unit, why)
                for t, unit, why in selections
                if start < t <= end and why != "start" and (unit != 0 or why == "none fit")
            ),
            None,
        )
        passed = None if to is None or to[2] == "none fit" else to[0] - start
        spare = _spare(flown, start)
        verdict.failovers.append(
            {
                "kind": fault.kind,
                "triad": fault.triad,
                "size": fault.size,
                "time": start,
                "seconds": passed,
                "lasts": min(end, flown.flight.duration) - start,
                "spare": spare,
                "to_faulty": bool(passed is not None and to and faulty(units[to[1]], np.array([to[0]]))[0]),
            }
        )
        if _is_missed(flown, fault, start, end, passed, spare):
            verdict.counts["missed failovers"] += 1
            verdict.findings.append(f"missed failover: {fault.kind} at {start:.2f} s for {end - start:.2f} s")


def _spare(flown: Flown, start: float) -> bool:
    """Tell whether a secondary could have taken over: sound, in health, calibrated where it has to be."""
    ill = unhealthy(flown, start)
    moment = np.array([start + 0.5])
    stored = flown.stored_at(start)
    needs = bool(flown.mission.settings["calibrated_only"])
    return any(
        k not in ill
        and not faulty(unit, moment)[0]
        and (not needs or all((k, name) in stored for name in SENSORS))
        for k, unit in enumerate(flown.flight.units)
        if k > 0
    )


def _is_missed(
    flown: Flown, fault: Fault, start: float, end: float, passed: float | None, spare: bool
) -> bool:
    lasts = min(end - 1.0, flown.flight.duration) - start
    evident = fault.kind in EVIDENT and lasts > EVIDENT_SECONDS
    return evident and spare and passed is None
