"""Truth of a mission: the readings of a faultless primary, and the times in which each unit has no fault."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from benchmarks.redundancy_mission import ALWAYS, LASTING, Mission
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName
from tumble.tools.simulate.fault import Fault
from tumble.tools.simulate.flight.procedure import FlightTruth, SimulatedFlight, SimulatedFlightUnit
from tumble.tools.simulate.flight.scenario import FlightScenario
from tumble.tools.simulate.unit import TriadTruth

SETTLING = 1.0
"""s after a passing fault, and around any, that are not judged: windows and filters have to run out."""


def reference(
    mission: Mission, flight: SimulatedFlight, time: FloatArray, averaging: float
) -> dict[TriadName, FloatArray]:
    """Returns the readings of a primary without noise and fault, its own calibration applied, (n, 3).

    That is what the whole set is to agree with: a primary that is wrong from the factory is wrong for all.
    """
    truth = flight.truth(time, averaging)
    return {name: corrected(mission, flight, name, said) for name, said in _said(flight, truth).items()}


def corrected(mission: Mission, flight: SimulatedFlight, name: TriadName, said: FloatArray) -> FloatArray:
    """Corrects readings (n, 3) of the primary by its own calibration, where it has one."""
    own = mission.calibration(flight)
    if own is None:
        return said
    matrix, bias = own[name]
    return np.asarray(np.linalg.solve(matrix, (said - bias).T).T)


def _said(flight: SimulatedFlight, truth: FlightTruth) -> dict[TriadName, FloatArray]:
    """Returns what the faultless primary reads: its errors with the warming, without noise."""
    unit = flight.units[0]
    warmth = temperature(flight.scenario, truth.time)[:, None] - 25.0
    force, rate = truth.specific_force, truth.angular_rate
    return {
        "accelerometer": _sensed(unit.accelerometer, force, force, warmth),
        "gyroscope": _sensed(unit.gyroscope, rate, force, warmth),
    }


def _sensed(triad: TriadTruth, true: FloatArray, force: FloatArray, warmth: FloatArray) -> FloatArray:
    bias = triad.b + warmth * triad.temperature_coefficient
    return np.asarray(true @ triad.M.T + bias + force @ triad.g_sensitivity.T)


def temperature(scenario: FlightScenario, time: FloatArray) -> FloatArray:
    """Returns the temperature (n,) at times (n,), deg C."""
    risen = scenario.warm_up_kelvin * -np.expm1(-np.maximum(time, 0.0) / scenario.warm_up_seconds)
    return scenario.temperature_celsius + risen


def carried(truth: FlightTruth, arm: FloatArray) -> FloatArray:
    """Returns the specific force (n, 3) that a place has more than the primary's, `arm` m away."""
    w = truth.angular_rate
    return np.cross(truth.angular_acceleration, arm) + np.cross(w, np.cross(w, arm))


def spans(fault: Fault) -> tuple[float, float]:
    """Returns when it is at work, s; one that lasts has no end."""
    if fault.kind in ALWAYS:
        return -np.inf, np.inf
    if fault.kind == "doubled":
        return np.inf, np.inf
    start = -np.inf if fault.start is None else fault.start
    if fault.kind in LASTING:
        return start, np.inf
    end = np.inf if fault.end is None else fault.end
    return start, end + SETTLING + (fault.size or 0.0 if fault.kind == "late" else 0.0)


def faulty(
    unit: SimulatedFlightUnit, time: FloatArray, began_after: float = -np.inf
) -> npt.NDArray[np.bool_]:
    """Returns for (n,) times whether a fault acts; lasting ones count only if they begin after a time."""
    bad = np.zeros(len(time), dtype=bool)
    for fault in unit.faults:
        start, end = spans(fault)
        if np.isfinite(end) or start >= began_after:
            bad |= (time >= start - SETTLING / 2) & (time < end)
    return bad
