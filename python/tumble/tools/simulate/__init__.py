"""Recordings with known truth: a turntable session as it would be recorded.

Read in this order: `grade` (how good a sensor is), `fault` (what can be wrong with it), `unit` (what one
records, and what is true of it), then `turntable`, `spin` (a robot that turns on the spot), `static` (a
unit that stands still), `magnetometer` (one in the Earth's field), `thermal` (one that warms and cools),
`plateaus` (one on a turntable at several temperatures) or `flight` (several units on a quadrotor or a
vehicle), each with its `scenario` (everything it is made of), `procedure` (from there to recordings and
truth), `files` (those on disk) and `command`. `scenario_json` converts a scenario for the native simulator.
`live` serves all of these, and a table, as they happen.

>>> from tumble.tools.simulate import simulate_turntable
>>> session = simulate_turntable(seed=7, grades=("consumer", "tactical"))
>>> session["target_1"].accelerometer.b.shape
(3,)
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tumble.foundation import lazy

if TYPE_CHECKING:
    from tumble.tools.simulate.fault import FAULTS, Fault, FaultKind
    from tumble.tools.simulate.flight.files import write_flight
    from tumble.tools.simulate.flight.procedure import (
        FlightPath,
        FlightTruth,
        SimulatedFlight,
        SimulatedFlightUnit,
        simulate_flight,
    )
    from tumble.tools.simulate.flight.scenario import (
        USUAL_UNITS,
        VIBRATIONS,
        FlightScenario,
        FlightUnit,
        Vibration,
        unit_names,
    )
    from tumble.tools.simulate.grade import Grade, TriadGrade, grade_names
    from tumble.tools.simulate.live.fault import LIVE_FAULTS, LiveFault
    from tumble.tools.simulate.live.files import write_live
    from tumble.tools.simulate.live.procedure import LiveSimulation
    from tumble.tools.simulate.live.scenario import LiveScenario
    from tumble.tools.simulate.magnetometer.files import write_magnetometer
    from tumble.tools.simulate.magnetometer.procedure import (
        MagneticScenario,
        SimulatedMagnetometer,
        simulate_magnetometer,
    )
    from tumble.tools.simulate.multipose.files import write_multipose
    from tumble.tools.simulate.multipose.procedure import SimulatedMultipose, simulate_multipose
    from tumble.tools.simulate.plateaus.files import write_plateaus
    from tumble.tools.simulate.plateaus.procedure import SimulatedPlateaus, simulate_plateaus
    from tumble.tools.simulate.plateaus.scenario import PlateausScenario
    from tumble.tools.simulate.scenario import ScenarioError
    from tumble.tools.simulate.spin.files import write_spin
    from tumble.tools.simulate.spin.procedure import SimulatedSpin, simulate_spin
    from tumble.tools.simulate.spin.scenario import SimulatedDisturbance, SpinScenario, Step, parse_plan
    from tumble.tools.simulate.static.files import write_static
    from tumble.tools.simulate.static.procedure import SimulatedStatic, simulate_static
    from tumble.tools.simulate.static.scenario import StaticScenario
    from tumble.tools.simulate.thermal.files import write_thermal
    from tumble.tools.simulate.thermal.procedure import SimulatedThermal, simulate_thermal
    from tumble.tools.simulate.thermal.scenario import ThermalScenario
    from tumble.tools.simulate.turntable.files import write_turntable
    from tumble.tools.simulate.turntable.procedure import SimulatedTurntable, TrueRest, simulate_turntable
    from tumble.tools.simulate.turntable.scenario import TurntableScenario
    from tumble.tools.simulate.unit import ClockTruth, SimulatedUnit, TriadTruth

__all__ = [
    "FAULTS",
    "LIVE_FAULTS",
    "USUAL_UNITS",
    "VIBRATIONS",
    "ClockTruth",
    "Fault",
    "FaultKind",
    "FlightPath",
    "FlightScenario",
    "FlightTruth",
    "FlightUnit",
    "Grade",
    "LiveFault",
    "LiveScenario",
    "LiveSimulation",
    "MagneticScenario",
    "PlateausScenario",
    "ScenarioError",
    "SimulatedDisturbance",
    "SimulatedFlight",
    "SimulatedFlightUnit",
    "SimulatedMagnetometer",
    "SimulatedMultipose",
    "SimulatedPlateaus",
    "SimulatedSpin",
    "SimulatedStatic",
    "SimulatedThermal",
    "SimulatedTurntable",
    "SimulatedUnit",
    "SpinScenario",
    "StaticScenario",
    "Step",
    "ThermalScenario",
    "TriadGrade",
    "TriadTruth",
    "TrueRest",
    "TurntableScenario",
    "Vibration",
    "grade_names",
    "parse_plan",
    "simulate_flight",
    "simulate_magnetometer",
    "simulate_multipose",
    "simulate_plateaus",
    "simulate_spin",
    "simulate_static",
    "simulate_thermal",
    "simulate_turntable",
    "unit_names",
    "write_flight",
    "write_live",
    "write_magnetometer",
    "write_multipose",
    "write_plateaus",
    "write_spin",
    "write_static",
    "write_thermal",
    "write_turntable",
]

__getattr__ = lazy.attributes(
    __name__,
    {
        "tumble.tools.simulate.fault": ("FAULTS", "Fault", "FaultKind"),
        "tumble.tools.simulate.flight.files": ("write_flight",),
        "tumble.tools.simulate.flight.procedure": (
            "FlightPath",
            "FlightTruth",
            "SimulatedFlight",
            "SimulatedFlightUnit",
            "simulate_flight",
        ),
        "tumble.tools.simulate.flight.scenario": (
            "USUAL_UNITS",
            "VIBRATIONS",
            "FlightScenario",
            "FlightUnit",
            "Vibration",
            "unit_names",
        ),
        "tumble.tools.simulate.grade": ("Grade", "TriadGrade", "grade_names"),
        "tumble.tools.simulate.live.fault": ("LIVE_FAULTS", "LiveFault"),
        "tumble.tools.simulate.live.files": ("write_live",),
        "tumble.tools.simulate.live.procedure": ("LiveSimulation",),
        "tumble.tools.simulate.live.scenario": ("LiveScenario",),
        "tumble.tools.simulate.magnetometer.files": ("write_magnetometer",),
        "tumble.tools.simulate.magnetometer.procedure": (
            "MagneticScenario",
            "SimulatedMagnetometer",
            "simulate_magnetometer",
        ),
        "tumble.tools.simulate.multipose.files": ("write_multipose",),
        "tumble.tools.simulate.multipose.procedure": ("SimulatedMultipose", "simulate_multipose"),
        "tumble.tools.simulate.plateaus.files": ("write_plateaus",),
        "tumble.tools.simulate.plateaus.procedure": ("SimulatedPlateaus", "simulate_plateaus"),
        "tumble.tools.simulate.plateaus.scenario": ("PlateausScenario",),
        "tumble.tools.simulate.scenario": ("ScenarioError",),
        "tumble.tools.simulate.spin.files": ("write_spin",),
        "tumble.tools.simulate.spin.procedure": ("SimulatedSpin", "simulate_spin"),
        "tumble.tools.simulate.spin.scenario": ("SimulatedDisturbance", "SpinScenario", "Step", "parse_plan"),
        "tumble.tools.simulate.static.files": ("write_static",),
        "tumble.tools.simulate.static.procedure": ("SimulatedStatic", "simulate_static"),
        "tumble.tools.simulate.static.scenario": ("StaticScenario",),
        "tumble.tools.simulate.thermal.files": ("write_thermal",),
        "tumble.tools.simulate.thermal.procedure": ("SimulatedThermal", "simulate_thermal"),
        "tumble.tools.simulate.thermal.scenario": ("ThermalScenario",),
        "tumble.tools.simulate.turntable.files": ("write_turntable",),
        "tumble.tools.simulate.turntable.procedure": ("SimulatedTurntable", "TrueRest", "simulate_turntable"),
        "tumble.tools.simulate.turntable.scenario": ("TurntableScenario",),
        "tumble.tools.simulate.unit": ("ClockTruth", "SimulatedUnit", "TriadTruth"),
    },
)


def __dir__() -> list[str]:
    return __all__
