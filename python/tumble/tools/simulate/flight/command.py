"""`tumble simulate flight`: a quadrotor or a vehicle with several IMUs on board, with its truth."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tumble.cli.options import Options
from tumble.cli.output import OutputFolder, folder_named_after
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import TumbleError
from tumble.tools.simulate.options import (
    FAULTS_HELP,
    GravityOption,
    InstabilityOption,
    ResponseOption,
    SimulationOptions,
    StepsOption,
    faults_by_unit,
    numbers_of,
    print_simulation,
    unit_line,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from tumble.tools.simulate import Fault, FlightUnit, SimulatedFlight, Vibration

VECTORS = {"lever-arm": "lever_arm_m", "mounting": "mounting_deg"}
NUMBERS = {
    "rate": "rate_hz",
    "ageing": "ageing",
    "phase": "phase",
    "clock-offset": "clock_offset_seconds",
    "clock-skew": "clock_skew_ppm",
    "latency": "latency_seconds",
}
"""Keys of a unit, and the fields that hold them."""


class Carrier(str, Enum):
    """Carrier of the units."""

    QUADROTOR = "quadrotor"
    VEHICLE = "vehicle"


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightMotionOptions(Options):
    """Carrier of the units, and its motion."""

    motion: Annotated[Carrier, typer.Option(help="What carries the units.")] = Carrier.QUADROTOR
    flights: Annotated[int, typer.Option(help="Flights or drives, with rests between.")] = 1
    rest: Annotated[float, typer.Option(help="Rest before each and after the last, s.")] = 10.0
    duration: Annotated[float, typer.Option(help="Manoeuvres of each flight, or each drive, s.")] = 60.0
    stops: Annotated[int, typer.Option(help="Stops of a vehicle on each drive.")] = 1
    stop: Annotated[float, typer.Option(help="Each stop, s.")] = 5.0
    intensity: Annotated[float, typer.Option(help="How strong the motion is, from 0, the least, to 1.")] = 0.6
    sway: Annotated[
        str, typer.Option(metavar="X,Y,Z", help="Factor on the usual motion forward, left and up, 0 to 1.")
    ] = "1,1,1"
    turning: Annotated[float, typer.Option(help="Factor on the usual motion about the vertical, 0 to 1.")] = (
        1.0
    )

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        forward, left, up = numbers_of("--sway", self.sway, 3)
        return {
            "motion": self.motion.value,
            "flights": self.flights,
            "rest_seconds": self.rest,
            "motion_seconds": self.duration,
            "stops": self.stops,
            "stop_seconds": self.stop,
            "intensity": self.intensity,
            "sway": (forward, left, up),
            "turning": self.turning,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class VibrationOptions(Options):
    """Vibration of the units."""

    vibration: Annotated[
        float | None,
        typer.Option(help="Vibration while motors run, m/s^2 rms; 4 for a quadrotor, 0.4 for a vehicle."),
    ] = None
    angular_vibration: Annotated[
        float | None, typer.Option(help="The same, rad/s rms; 0.05 for a quadrotor, 0.005 for a vehicle.")
    ] = None
    vibration_at_rest: Annotated[
        float, typer.Option(help="Share of it at rest: 1 for vibration that never stops.")
    ] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightPlaceOptions(Options):
    """Where it flies or drives, and how the primary sits in it."""

    ground_tilt: Annotated[float, typer.Option(help="Tilt of the ground, deg.")] = 1.0
    uphill: Annotated[
        float, typer.Option(help="Uphill, deg counter-clockwise from forward at the start.")
    ] = 40.0
    mounting: Annotated[
        str, typer.Option(metavar="ROLL,PITCH,YAW", help="Mounting of the primary in the body, deg.")
    ] = "0,0,0"
    gravity: GravityOption = STANDARD_GRAVITY
    latitude: Annotated[
        float | None, typer.Option(help="Latitude in degrees, for the Earth's rate; none if not given.")
    ] = None
    warm_up: Annotated[float, typer.Option(help="Rise of the temperature in the long run, K.")] = 10.0

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        roll, pitch, yaw = numbers_of("--mounting", self.mounting, 3)
        return {
            "ground_tilt_deg": self.ground_tilt,
            "uphill_deg": self.uphill,
            "roll_deg": roll,
            "pitch_deg": pitch,
            "yaw_deg": yaw,
            "gravity": self.gravity,
            "latitude_deg": self.latitude,
            "warm_up_kelvin": self.warm_up,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightUnitOptions(Options):
    """Units on board, and their faults."""

    unit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="GRADE[:KEY=VALUE]...",
            help="An IMU on board, the primary first; repeatable. Grades: consumer, industrial, tactical, "
            "reference. Keys: lever-arm=X,Y,Z (m from the primary, in its case frame), mounting=X,Y,Z "
            "(rotation vector from the primary's case, deg), rate (Hz), ageing (bias moved since the "
            "factory, 1 sigma over the turn-on bias), phase (of the first sample, in periods), "
            "clock-offset (s), clock-skew (ppm), latency (s). Where none is given: an industrial primary "
            "and two consumer secondaries, one of them upside down.",
        ),
    ] = None
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="UNIT:KIND[:KEY=VALUE]...",
            help="Something wrong with a unit, such as primary:dead:start=60; may be repeated. "
            f"{FAULTS_HELP}",
        ),
    ] = None
    bias_instability: InstabilityOption = True
    quantisation: StepsOption = True
    g_sensitivity: ResponseOption = True

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        from tumble.tools.simulate import Fault

        return {
            "units": _with_faults(_units(self.unit), faults_by_unit(self.fault or [], Fault)),
            "bias_instability": self.bias_instability,
            "quantisation": self.quantisation,
            "g_sensitivity": self.g_sensitivity,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class VelocityOptions(Options):
    """A receiver of satellites on board."""

    velocity_rate: Annotated[
        float | None,
        typer.Option(
            metavar="HZ", help="Write velocity.csv as a satellite receiver would give it, for --aiding."
        ),
    ] = None
    velocity_sigma: Annotated[float, typer.Option(metavar="M/S", help="Noise of each of its axes.")] = 0.3


def flight_command(
    output: OutputFolder = None,
    *,
    moved: FlightMotionOptions,
    shaken: VibrationOptions,
    place: FlightPlaceOptions,
    units: FlightUnitOptions,
    receiver: VelocityOptions,
    shared: SimulationOptions,
) -> None:
    """Simulate a quadrotor or a vehicle with several IMUs on board: a primary and secondaries.

    Example: tumble simulate flight --motion vehicle --fault primary:dead:start=60 --seed 7 -o flight

    Writes primary.csv, secondary_1.csv ..., units.yaml for tumble redundancy and, to hold results against,
    ideal.csv of a unit without errors and truth.yaml; with --velocity-rate also velocity.csv. MCAP is one log
    with all units.
    """
    from tumble.cli.progress import sample_progress
    from tumble.tools.simulate import simulate_flight, write_flight

    flight = simulate_flight(
        seed=shared.seed,
        vibration=_vibration(moved.motion, shaken),
        **moved.stated(),
        **place.stated(),
        **units.stated(),
    )
    rate, sigma = receiver.velocity_rate, receiver.velocity_sigma
    velocity = None if rate is None else flight.velocity(rate, sigma)
    with sample_progress("writing") as advance:
        folder = output or folder_named_after("flight")
        paths = write_flight(flight, folder, shared.format_name.value, velocity=velocity, progress=advance)
    _show(flight, {name: str(path) for name, path in paths.items()}, shared.as_json)


def _units(specs: list[str] | None) -> Sequence[FlightUnit]:
    from tumble.tools.simulate import USUAL_UNITS

    return USUAL_UNITS if specs is None else [_unit(spec, first=spec is specs[0]) for spec in specs]


def _unit(spec: str, *, first: bool) -> FlightUnit:
    """Reads `consumer:lever-arm=0.03,0,0:rate=100`; the primary has not aged by default."""
    from tumble.tools.simulate import FlightUnit

    grade, *settings = spec.split(":")
    stated: dict[str, Any] = {"ageing": 0.0} if first else {}
    for setting in settings:
        key, _, value = setting.partition("=")
        option = f"--unit {spec}: {key}"
        if key in VECTORS:
            stated[VECTORS[key]] = tuple(numbers_of(option, value, 3))
        elif key in NUMBERS:
            (stated[NUMBERS[key]],) = numbers_of(option, value, 1)
        else:
            known = ", ".join([*VECTORS, *NUMBERS])
            raise TumbleError(f"--unit {spec}: unknown key {key!r}; known are {known}")
    return FlightUnit(grade=grade, **stated)


def _with_faults(
    units: Sequence[FlightUnit], faults: Mapping[str, Sequence[Fault]]
) -> tuple[FlightUnit, ...]:
    from dataclasses import replace

    from tumble.tools.simulate import unit_names

    names = unit_names(len(units))
    for name in faults:
        if name not in names:
            raise TumbleError(f"--fault {name}: unknown unit; there are {', '.join(names)}")
    return tuple(
        replace(unit, faults=tuple(faults.get(name, ()))) for name, unit in zip(names, units, strict=True)
    )


def _vibration(motion: Carrier, asked: VibrationOptions) -> Vibration:
    """Give the vibration of the carrier, but for what was typed of it."""
    from dataclasses import replace

    from tumble.tools.simulate import VIBRATIONS

    usual = VIBRATIONS[motion.value]
    return replace(
        usual,
        specific_force=usual.specific_force if asked.vibration is None else asked.vibration,
        angular_rate=usual.angular_rate if asked.angular_vibration is None else asked.angular_vibration,
        at_rest=asked.vibration_at_rest,
    )


def _show(flight: SimulatedFlight, paths: dict[str, str], as_json: bool) -> None:
    samples = {unit.name: len(unit.samples) for unit in flight.units}
    if as_json:
        content: dict[str, Any] = {
            "seed": flight.scenario.seed,
            "duration": flight.duration,
            "samples": samples,
            "rests": flight.rests.tolist(),
            "manoeuvres": flight.manoeuvres.tolist(),
            "files": paths,
        }
        print_simulation(content)
        return
    for unit in flight.units:
        print(unit_line(_source(unit.name, paths), unit))
    print(f"{_source('ideal', paths)}: a unit without errors, at the primary's place")
    print(f"{paths['units']}: mounting of the units, as their builder knows it")
    print(f"{paths['truth']}: the truth")
    if "velocity" in paths:
        print(f"{paths['velocity']}: velocity of the primary's place, x east, y north, z up")
    print(f"Next: {_next(flight, paths)}")


def _next(flight: SimulatedFlight, paths: dict[str, str]) -> str:
    """Command that makes use of what was written; without primary and secondary, to look at it."""
    log = paths.get("log")
    primary, *others = flight.units
    secondaries = [unit.name for unit in others if len(unit.samples)]
    if not secondaries or not len(primary.samples):
        return f"tumble inspect {log or paths['ideal']}"
    named = {unit.name: unit.name if log else paths.get(unit.name) for unit in flight.units}
    words = [*([log] if log else []), f"--primary {named[primary.name]}"]
    words += [f"--secondary {named[name]}" for name in secondaries]
    words += [f"--aiding {paths['velocity']}"] if "velocity" in paths else []
    return f"tumble redundancy {' '.join(words)} --settings {paths['units']} -o results"


def _source(name: str, paths: Mapping[str, str]) -> str:
    """Describes the place of a unit; a silent one has only its name."""
    return paths.get(name) or (f"{paths['log']}:{name}" if "log" in paths else name)
