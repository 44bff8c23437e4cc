"""Flies a mission, replays it through the monitor, and judges what the monitor did against the truth.

The measure is the reading of a faultless primary (`redundancy_truth.reference`), since the set is to agree
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
"""

from __future__ import annotations

import numpy as np

from benchmarks.redundancy_flown import (
    Flown,
    after_time_jumped,
    error_left,
    replayed,
    root_mean_square,
)
from benchmarks.redundancy_mission import draw
from benchmarks.redundancy_triggers import judge_triggers
from benchmarks.redundancy_truth import faulty, reference, spans
from benchmarks.redundancy_verdict import Verdict
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName
from tumble.tools.simulate.flight.procedure import FlightTruth

MARGIN: dict[TriadName, float] = {"accelerometer": 0.03, "gyroscope": 0.003}
"""m/s^2 and rad/s."""
SHARE = 0.1
SHORTEST = 5.0
"""s without fault that an adoption needs after it to be judged."""


def judged(seed: int) -> Verdict:
    """Draws, flies, replays and judges one mission."""
    flown = replayed(draw(seed))
    verdict = Verdict(seed, flown.flight.duration, len(flown.flight.units))
    verdict.replay_rate = flown.flight.duration / max(flown.seconds, 1e-9)
    for name in ("triggered", "adopted", "refused", "abandoned"):
        verdict.counts[name] = sum(event[2] == name for event in flown.events)
    _judge_adoptions(flown, verdict)
    judge_triggers(flown, verdict)
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
                "fit_model": figures["fit_model"],
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
                f"{kind}: unit {number} {name} at {at:.1f} s, {figures['fit_model']}: "
                f"{before:.4g} -> {after:.4g};"
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
    records = [flown.stored.at(moment).get((number, name)) for moment in (at, np.nextafter(at, np.inf))]
    as_read = readings @ unit.nominal_mounting.T
    before, after = (
        root_mean_square(
            error_left(flown, number, name, record, as_read, truth, measure)[clean], flown.window
        )
        for record in records
    )
    return before, after
