"""Recordings with known truth: a turntable session as it would be recorded.

Read in this order: `grade` (how good a sensor is), `fault` (what can be wrong with it), `scenario`
(everything a session is made of), `session` (what comes out), `play` (from the one to the other), `files` (a
session on disk); `spin_scenario`, `spin` and `spin_files` are the same for a robot that turns on the spot,
`flight_scenario`, `flight` and `flight_files` for several units on a quadrotor or a vehicle.

>>> from tumble.simulate import simulate_turntable
>>> session = simulate_turntable(seed=7, grades=("consumer", "tactical"))
>>> session["target_1"].accelerometer.b.shape
(3,)
"""

from __future__ import annotations

from tumble.simulate.fault import FAULTS, Fault, FaultKind
from tumble.simulate.files import write_turntable
from tumble.simulate.flight import (
    FlightPath,
    FlightTruth,
    SimulatedFlight,
    SimulatedFlightUnit,
    simulate_flight,
)
from tumble.simulate.flight_files import write_flight
from tumble.simulate.flight_scenario import (
    USUAL_UNITS,
    VIBRATIONS,
    FlightScenario,
    FlightUnit,
    Vibration,
    unit_names,
)
from tumble.simulate.grade import Grade, TriadGrade, grade_names
from tumble.simulate.play import simulate_turntable
from tumble.simulate.scenario import ScenarioError, TurntableScenario
from tumble.simulate.session import (
    ClockTruth,
    SimulatedTurntable,
    SimulatedUnit,
    TriadTruth,
    TrueRest,
)
from tumble.simulate.spin import SimulatedSpin, simulate_spin
from tumble.simulate.spin_files import write_spin
from tumble.simulate.spin_scenario import Disturbance, SpinScenario, Step, parse_plan

__all__ = [
    "FAULTS",
    "USUAL_UNITS",
    "VIBRATIONS",
    "ClockTruth",
    "Disturbance",
    "Fault",
    "FaultKind",
    "FlightPath",
    "FlightScenario",
    "FlightTruth",
    "FlightUnit",
    "Grade",
    "ScenarioError",
    "SimulatedFlight",
    "SimulatedFlightUnit",
    "SimulatedSpin",
    "SimulatedTurntable",
    "SimulatedUnit",
    "SpinScenario",
    "Step",
    "TriadGrade",
    "TriadTruth",
    "TrueRest",
    "TurntableScenario",
    "Vibration",
    "grade_names",
    "parse_plan",
    "simulate_flight",
    "simulate_spin",
    "simulate_turntable",
    "unit_names",
    "write_flight",
    "write_spin",
    "write_turntable",
]
