"""A simulated flight: scenario in, recordings of all units and their truth out."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.logs.aiding import Aiding
from tumble.tools.simulate import scenario_json
from tumble.tools.simulate.fault import Fault
from tumble.tools.simulate.flight.scenario import PRIMARY, FlightScenario, FlightUnit
from tumble.tools.simulate.scenario import ScenarioError
from tumble.tools.simulate.unit import PPM, SimulatedUnit, simulated_unit

VELOCITY_NOISE = b"velocity"
"""Distinguishes its random numbers from those of the units."""
LARGEST_RATE = 1.0
"""rad/s, of which a fault saturates a share."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedFlightUnit(SimulatedUnit):
    """One unit on board: what it recorded and what is true of it.

    Its `M` leads from the primary's case frame to its own axes, mounting included: `y = M u + b + G f`, with
    `u` the truth at its place.
    """

    arrival: FloatArray = field(repr=False)
    """(n,) s of the flight's clock at which each sample was at hand, never descending."""
    lever_arm: FloatArray
    """(3,) m from the primary, primary's case frame."""
    nominal_mounting: FloatArray
    """(3, 3) package from the primary's case, as the builder would state it."""
    accelerometer_ageing: FloatArray
    """(3,) m/s^2 by which b has moved since the factory."""
    gyroscope_ageing: FloatArray
    """(3,) rad/s."""
    latency: float
    """s."""

    @property
    def time(self) -> FloatArray:
        """(n,) s of its own clock."""
        return self.samples.time

    @property
    def specific_force(self) -> FloatArray:
        """(n, 3) m/s^2, raw."""
        return self.samples.accelerometer

    @property
    def angular_rate(self) -> FloatArray:
        """(n, 3) rad/s, raw."""
        return self.samples.gyroscope


@dataclass(frozen=True, slots=True)
class FlightTruth:
    """Readings of an ideal unit at the primary's place, in the primary's case frame."""

    time: FloatArray
    """(n,) s of the flight's clock."""
    specific_force: FloatArray
    """(n, 3) m/s^2."""
    angular_rate: FloatArray
    """(n, 3) rad/s, the Earth's included."""
    angular_acceleration: FloatArray
    """(n, 3) rad/s^2."""


@dataclass(frozen=True, slots=True)
class FlightPath:
    """Attitude and velocity of the primary, without vibration; level frame: x east, y north, z up."""

    time: FloatArray
    """(n,) s of the flight's clock."""
    level_from_case: FloatArray
    """(n, 3, 3)."""
    velocity: FloatArray
    """(n, 3) m/s."""


@dataclass(frozen=True, slots=True)
class SimulatedFlight:
    """Recordings of all units, and the truth."""

    scenario: FlightScenario
    units: tuple[SimulatedFlightUnit, ...]
    """The primary first."""
    rests: FloatArray
    """(k, 2) start and end of each rest, s."""
    manoeuvres: FloatArray
    """(m, 2) start and end of the manoeuvres of each flight, or of each drive, s."""
    duration: float
    """s."""
    motion: _core.FlightMotion = field(repr=False)

    def __getitem__(self, name: str) -> SimulatedFlightUnit:
        """Returns the unit of that name; raises `KeyError`."""
        for unit in self.units:
            if unit.name == name:
                return unit
        raise KeyError(name)

    def truth(self, time: FloatArray, averaging: float | None = None) -> FlightTruth:
        """Returns the truth at the primary's place at times (n,) s of the flight's clock.

        Vibration comes as its mean over `averaging` s, 0 for its value at an instant; as the primary takes it
        if not given.
        """
        time = np.ascontiguousarray(time, dtype=np.float64)
        if averaging is None:
            averaging = self.scenario.units[0].averaging_seconds
        figures = self.motion.truth(time, averaging)
        return FlightTruth(
            time, figures["specific_force"], figures["angular_rate"], figures["angular_acceleration"]
        )

    def temperature(self, time: FloatArray) -> FloatArray:
        """Temperature (n,) degC of all units; biases are `b + temperature_coefficient (T - 25)`."""
        warming = self.scenario
        rise = -np.expm1(-np.asarray(time) / warming.warm_up_seconds)
        temperature: FloatArray = warming.temperature_celsius + warming.warm_up_kelvin * rise
        return temperature

    def path(self, time: FloatArray) -> FlightPath:
        """Returns attitude and velocity at times (n,) s of the flight's clock."""
        time = np.ascontiguousarray(time, dtype=np.float64)
        figures = self.motion.path(time)
        return FlightPath(time, figures["level_from_case"], figures["velocity"])

    def velocity(self, rate: float, sigma: float) -> Aiding:
        """Returns the velocity of a satellite receiver at so many Hz, with noise of `sigma`, m/s.

        Raises `ScenarioError` where either is not above 0.
        """
        for name, value in (("velocity rate", rate), ("velocity sigma", sigma)):
            if not (value > 0.0 and np.isfinite(value)):
                raise ScenarioError(f"{name} is {value:g}; give a number above 0")
        time = np.arange(0.0, self.duration, 1.0 / rate)
        noise = np.random.default_rng([self.scenario.seed, *VELOCITY_NOISE]).standard_normal((len(time), 3))
        return Aiding.velocity(time, self.path(time).velocity + sigma * noise, sigma, source="velocity")


def simulate_flight(scenario: FlightScenario | None = None, **changes: Any) -> SimulatedFlight:  # noqa: ANN401
    """Plays a scenario; `changes` are fields of `FlightScenario`, set on top of it or of its defaults.

    Raises `ScenarioError`, in one line, where a figure makes no sense.
    """
    scenario = replace(scenario or FlightScenario(), **changes)
    played = scenario_json.play(_core.simulate_flight, _native(scenario), "flight")
    units = zip(scenario.names, scenario.units, played["units"], strict=True)
    return SimulatedFlight(
        scenario=scenario,
        units=tuple(_unit(scenario, name, unit, figures) for name, unit, figures in units),
        rests=played["rests"],
        manoeuvres=played["manoeuvres"],
        duration=played["duration"],
        motion=played["motion"],
    )


def _native(scenario: FlightScenario) -> dict[str, Any]:
    """Puts together the scenario of `flight.rs`."""
    vibration = scenario.shaking
    return {
        "conditions": scenario_json.conditions(
            seed=scenario.seed,
            temperature_celsius=scenario.temperature_celsius,
            warm_up_kelvin=scenario.warm_up_kelvin,
            warm_up_seconds=scenario.warm_up_seconds,
            bias_instability=scenario.bias_instability,
            quantisation=scenario.quantisation,
            g_sensitivity=scenario.g_sensitivity,
        ),
        "carrier": scenario.motion,
        "plan": {
            "flights": scenario.flights,
            "rest": scenario.rest_seconds,
            "moving": scenario.motion_seconds,
            "stops": scenario.stops,
            "stop": scenario.stop_seconds,
            "intensity": scenario.intensity,
            "sway": scenario.sway,
            "turning": scenario.turning,
            "ground": scenario_json.floor(scenario.ground_tilt_deg, scenario.uphill_deg),
            "gravity": scenario.gravity,
        },
        "vibration": {
            "specific_force": vibration.specific_force,
            "angular_rate": vibration.angular_rate,
            "tones": vibration.tones_hz,
            "band": vibration.band_hz,
        },
        "vibration_at_rest": vibration.at_rest,
        "flexing": vibration.flexing,
        "mounting": scenario_json.in_radians((scenario.roll_deg, scenario.pitch_deg, scenario.yaw_deg)),
        "latitude": scenario_json.in_radians_or_none(scenario.latitude_deg),
        "units": [
            {"unit": _native_unit(scenario, name, unit), "averaging": unit.averaging_seconds}
            for name, unit in zip(scenario.names, scenario.units, strict=True)
        ],
    }


def _native_unit(scenario: FlightScenario, name: str, unit: FlightUnit) -> dict[str, Any]:
    aged = (unit.accelerometer_ageing, unit.gyroscope_ageing)
    return scenario_json.unit(
        unit.grade_figures,
        perfect=unit.perfect,
        rate=unit.rate_hz,
        mounting=scenario_json.in_radians(unit.mounting_deg),
        ageing=[unit.ageing if given is None else given for given in aged],
        lever_arm=unit.lever_arm_m,
        clock=_native_clock(unit, is_primary=name == PRIMARY),
        latency=unit.latency_seconds,
        faults=[_fault(scenario, fault) for fault in unit.faults],
    )


def _native_clock(unit: FlightUnit, *, is_primary: bool) -> dict[str, Any]:
    offset, skew = unit.clock_offset_seconds, unit.clock_skew_ppm * PPM
    if unit.phase is None and not is_primary:
        return {"unphased": {"offset": offset, "skew": skew}}
    return scenario_json.given_clock(offset, skew, unit.phase or 0.0)


def _fault(scenario: FlightScenario, fault: Fault) -> dict[str, Any]:
    largest = scenario.gravity if fault.triad == "accelerometer" else LARGEST_RATE
    return scenario_json.injected_fault(fault, scenario.rest_seconds / 2, largest)


def _own_clock(unit: FlightUnit) -> bool:
    """Returns whether a unit has a clock other than the flight's."""
    return unit.clock_offset_seconds != 0.0 or unit.clock_skew_ppm != 0.0


def _unit(
    scenario: FlightScenario, name: str, unit: FlightUnit, figures: _core.SimulatedUnitFigures
) -> SimulatedFlightUnit:
    recorded = simulated_unit(
        figures,
        name=name,
        grade=unit.grade_figures,
        serial=f"SIM-{scenario.seed}-{scenario.names.index(name)}",
        clock="" if any(_own_clock(each) for each in scenario.units) else "flight",
        faults=unit.faults,
    )
    accelerometer_ageing, gyroscope_ageing = figures["ageing"]
    return SimulatedFlightUnit(
        **{each.name: getattr(recorded, each.name) for each in fields(recorded)},
        arrival=figures["arrival"],
        lever_arm=np.array(unit.lever_arm_m),
        nominal_mounting=figures["package_from_case"],
        accelerometer_ageing=accelerometer_ageing,
        gyroscope_ageing=gyroscope_ageing,
        latency=unit.latency_seconds,
    )
