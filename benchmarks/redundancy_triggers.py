"""Correctness of the decision of each evaluation at rest; `redundancy_judge.py` defines what counts."""

from __future__ import annotations

import numpy as np

from benchmarks.redundancy_flown import SENSORS, Flown, after_time_jumped, unhealthy
from benchmarks.redundancy_truth import corrected, faulty
from benchmarks.redundancy_verdict import Verdict
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName

CLEAR = 0.2
"""Share of a threshold by which a deviation has to be beyond it, or below, to be clear."""
HEARD = 0.1
"""s after an evaluation at which its alarm is reported at the latest."""


def judge_triggers(flown: Flown, verdict: Verdict) -> None:
    verdict.counts |= {"evaluations": 0, "missed triggers": 0, "false triggers": 0}
    times = sorted(
        {(event[0], event[1]) for event in flown.events if event[2] == "evaluated" and event[1] > 0}
    )
    for at, number in times:
        if after_time_jumped(flown, np.array([at]))[0]:
            continue
        verdict.counts["evaluations"] += 1
        mine = [e for e in flown.events if e[0] == at and e[1] == number]
        triggered = [e[3]["sensors"] for e in mine if e[2] == "triggered"]
        ratio = _deviations(flown, at, number)
        if triggered:
            _judge_trigger(flown, verdict, at, number, triggered[0], ratio)
        elif _should_trigger(flown, at, number, ratio) and not any(
            e[2] == "withheld" and e[3]["reason"] == "already calibrating" for e in mine
        ):
            verdict.counts["missed triggers"] += 1
            verdict.findings.append(f"missed trigger: unit {number} at {at:.2f} s, {ratio}; {mine}")


def _judge_trigger(
    flown: Flown, verdict: Verdict, at: float, number: int, sensors: str, ratio: dict[str, float]
) -> None:
    scope = flown.mission.settings["scope"]
    wanted = SENSORS if sensors == "both" or scope == "all sensors" else (sensors,)
    if all(ratio[name] < 1.0 - CLEAR for name in wanted):
        verdict.counts["false triggers"] += 1
        verdict.findings.append(f"false trigger: unit {number} at {at:.2f} s, {sensors}, {ratio}")


def _should_trigger(flown: Flown, at: float, number: int, ratio: dict[str, float]) -> bool:
    units = flown.flight.units
    moment = np.array([at])
    sound = not any(faulty(units[k], moment)[0] for k in (0, number))
    healthy = not (unhealthy(flown, at) | unhealthy(flown, at + HEARD)) & {0, number}
    gate = flown.mission.settings["gate"]
    valid = {name: ratio[f"primary {name}"] < 1.0 - CLEAR for name in SENSORS}
    for name in SENSORS:
        trusted = {"secondary alone": True, "whole primary": all(valid.values())}.get(str(gate), valid[name])
        if sound and healthy and trusted and ratio[name] > 1.0 + CLEAR:
            return True
    return False


def _deviations(flown: Flown, at: float, number: int) -> dict[str, float]:
    """Deviations over thresholds, of means of raw samples taken anew; the larger of both checks."""
    found: dict[str, float] = {}
    primary_valid = {}
    for name in SENSORS:
        limit = _threshold(flown, at, 0, name, "norm")
        found[f"primary {name}"] = _physics(flown, name, _said_at_rest(flown, 0, name, at)) / limit
        primary_valid[name] = found[f"primary {name}"] < 1.0
    for name in SENSORS:
        raw = flown.mission.settings["data"] == "raw"
        mean = _mean(flown, number, name, at)
        said = mean if raw else _as_primary(flown, number, name, mean, at)
        own = said if raw else corrected(flown.mission, flown.flight, name, said[None])[0]
        shares = [_share(_physics(flown, name, own), _threshold(flown, at, number, name, "norm"))]
        if flown.mission.settings["vector_check"] and primary_valid[name]:
            turn = flown.flight.units[number].nominal_mounting
            other = _mean(flown, 0, name, at)
            mine = turn.T @ said if raw else said
            apart = float(np.linalg.norm(mine - other))
            shares.append(_share(apart, _threshold(flown, at, number, name, "vector")))
        found[name] = max(shares)
    return found


def _share(deviation: float, threshold: float) -> float:
    return deviation / threshold if threshold > 0.0 else np.inf


def _threshold(flown: Flown, at: float, number: int, name: str, check: str) -> float:
    """Returns the threshold as it was at the time; infinite where that was not evaluated."""
    stated = (
        e[3]["threshold"]
        for e in flown.events
        if e[0] == at
        and e[1] == number
        and e[2] == "evaluated"
        and (e[3]["sensor"], e[3]["check"]) == (name, check)
    )
    return float(next(stated, np.inf))


def _said_at_rest(flown: Flown, number: int, name: TriadName, at: float) -> FloatArray:
    mean = _mean(flown, number, name, at)
    if flown.mission.settings["data"] == "raw":
        return mean
    return np.asarray(corrected(flown.mission, flown.flight, name, mean[None])[0])


def _mean(flown: Flown, number: int, name: TriadName, at: float) -> FloatArray:
    """Mean (3,) of the raw samples over the rest that was evaluated."""
    unit = flown.flight.units[number]
    offset = 0.0 if number == 0 else flown.mission.offset_errors[number] - unit.clock.offset
    time = unit.time + offset
    within = (time > at - 2.0) & (time <= at)
    samples = unit.specific_force if name == "accelerometer" else unit.angular_rate
    return np.asarray(samples[within].mean(axis=0)) if within.any() else np.full(3, np.nan)


def _as_primary(flown: Flown, number: int, name: str, mean: FloatArray, at: float) -> FloatArray:
    record = flown.stored.at(at).get((number, name))
    if record is None:
        return np.asarray(flown.flight.units[number].nominal_mounting.T @ mean)
    return np.asarray(np.linalg.solve(np.asarray(record["matrix"]), mean - np.asarray(record["bias"])))


def _physics(flown: Flown, name: str, mean: FloatArray) -> float:
    gravity = flown.flight.scenario.gravity if name == "accelerometer" else 0.0
    return float(abs(np.linalg.norm(mean) - gravity))
