"""`tumble simulate spin`: a robot that turns on the spot, recorded, with its truth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tumble.cli.options import Options
from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.shared_options import RateOption
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import TumbleError
from tumble.tools.simulate.options import (
    GradeOption,
    GravityOption,
    InstabilityOption,
    SimulationOptions,
    StepsOption,
    fault_of,
    numbers_of,
    print_simulation,
)

if TYPE_CHECKING:
    from tumble.tools.simulate import Fault, SimulatedDisturbance, SimulatedSpin, Step

DISTURBANCES = ("picked-up", "sill", "lifted")


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedTurnOptions(Options):
    """Motion of the robot."""

    plan: Annotated[
        str | None,
        typer.Option(
            metavar="STEP,...",
            help="What the robot does, instead of --still, --turns, --both-ways: `rest S`, `N turns` "
            "(counter-clockwise positive), `drive S [tilt DEG] [uphill DEG] [bend DEG]` to another floor; "
            "such as 'rest 6, 3 turns, -3 turns, drive 8 tilt 2'.",
        ),
    ] = None
    still: Annotated[float, typer.Option(help="Time at rest before it turns, s.")] = 6.0
    turns: Annotated[float, typer.Option(help="Turns, counter-clockwise positive.")] = 3.0
    both_ways: Annotated[bool, typer.Option(help="Turn back again, or turn one way only.")] = True
    pause: Annotated[float, typer.Option(help="Rest between the two, s; none where 0.")] = 0.0
    turn_rate: Annotated[float, typer.Option(help="Speed of the turns, rad/s.")] = 1.0
    turn_acceleration: Annotated[
        float, typer.Option(help="Largest acceleration as a turn begins and ends, rad/s^2.")
    ] = 2.0
    unevenness: Annotated[float, typer.Option(help="Share by which the speed goes up and down.")] = 0.0
    slips: Annotated[float, typer.Option(help="Slips of the wheels per turn.")] = 0.0
    slow_turn: Annotated[
        float, typer.Option(help="Rate it turns with while it seems to stand at the start, rad/s.")
    ] = 0.0
    vibration: Annotated[float, typer.Option(help="Vibration while the motors run, m/s^2.")] = 0.0
    disturb: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND@S",
            help="What happens to the robot: picked-up, sill or lifted, and when; repeatable.",
        ),
    ] = None

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        from tumble.tools.simulate import parse_plan

        return {
            "plan": _steps(self) if self.plan is None else parse_plan(self.plan),
            "turn_rate": self.turn_rate,
            "turn_acceleration": self.turn_acceleration,
            "unevenness": self.unevenness,
            "slips": self.slips,
            "slow_turn": self.slow_turn,
            "vibration": self.vibration,
            "disturbances": [_disturbance(text) for text in self.disturb or []],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class SpinPlaceOptions(Options):
    """Where it turns, and how the IMU sits in it."""

    floor_tilt: Annotated[float, typer.Option(help="Tilt of the floor, deg.")] = 1.0
    uphill: Annotated[
        float, typer.Option(help="Uphill, deg counter-clockwise from forward at the start.")
    ] = 40.0
    mounting: Annotated[
        str, typer.Option(metavar="ROLL,PITCH,YAW", help="Mounting of the IMU in the robot, deg.")
    ] = "3,-2,0"
    lever_arm: Annotated[
        str, typer.Option(metavar="X,Y", help="IMU from the turning axis, forward and left, m.")
    ] = "0.10,-0.06"
    gravity: GravityOption = STANDARD_GRAVITY
    latitude: Annotated[
        float | None, typer.Option(help="Latitude in degrees, for the Earth's rate; none if not given.")
    ] = None

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        roll, pitch, yaw = numbers_of("--mounting", self.mounting, 3)
        forward, left = numbers_of("--lever-arm", self.lever_arm, 2)
        return {
            "floor_tilt_deg": self.floor_tilt,
            "uphill_deg": self.uphill,
            "roll_deg": roll,
            "pitch_deg": pitch,
            "yaw_deg": yaw,
            "lever_arm_m": (forward, left, 0.0),
            "gravity": self.gravity,
            "latitude_deg": self.latitude,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class SpinUnitOptions(Options):
    """The IMU, and its faults."""

    grade: GradeOption = "consumer"
    accelerometer_bias: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="m/s^2; drawn from the grade if not given.")
    ] = None
    gyroscope_bias: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="rad/s; drawn from the grade if not given.")
    ] = None
    accelerometer_noise: Annotated[
        float | None, typer.Option(help="Of one sample, m/s^2; that of the grade if not given.")
    ] = None
    gyroscope_noise: Annotated[
        float | None, typer.Option(help="Of one sample, rad/s; that of the grade if not given.")
    ] = None
    accelerometer_range: Annotated[
        float | None, typer.Option(help="Largest reading, m/s^2; that of the grade if not given.")
    ] = None
    gyroscope_scale: Annotated[float, typer.Option(help="Scale error of the gyroscope, 0.01 for 1 %.")] = 0.0
    matrix_errors: Annotated[
        float,
        typer.Option(
            help="Share of the grade's scale, non-orthogonality and alignment errors; 0 is a unit calibrated "
            "before."
        ),
    ] = 0.0
    rate: RateOption = 100.0
    bias_instability: InstabilityOption = True
    quantisation: StepsOption = True
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND[:KEY=VALUE]...",
            help="Something wrong with the log, such as gap:start=20:end=99; repeatable. Kinds and keys as "
            "of tumble simulate turntable.",
        ),
    ] = None

    def stated(self) -> dict[str, Any]:
        """Give them as the simulation takes them."""
        return {
            "grade": self.grade,
            "accelerometer_bias": _vector("--accelerometer-bias", self.accelerometer_bias),
            "gyroscope_bias": _vector("--gyroscope-bias", self.gyroscope_bias),
            "accelerometer_noise": self.accelerometer_noise,
            "gyroscope_noise": self.gyroscope_noise,
            "accelerometer_range": self.accelerometer_range,
            "gyroscope_scale": self.gyroscope_scale,
            "matrix_errors": self.matrix_errors,
            "rate_hz": self.rate,
            "bias_instability": self.bias_instability,
            "quantisation": self.quantisation,
            "faults": _faults(self.fault or []),
        }


def spin_command(
    output: OutputFolder = None,
    *,
    turn: SimulatedTurnOptions,
    place: SpinPlaceOptions,
    unit: SpinUnitOptions,
    shared: SimulationOptions,
) -> None:
    """Simulate a wheeled robot that stands still, then turns on the spot.

    Example: tumble simulate spin --floor-tilt 2 --turns 3 --seed 7 -o spin

    Writes spin.csv and, to hold results against, truth.yaml.
    """
    from tumble.tools.simulate import simulate_spin, write_spin

    spin = simulate_spin(seed=shared.seed, **place.stated(), **turn.stated(), **unit.stated())
    paths = write_spin(spin, output or folder_named_after("spin"), shared.format_name.value)
    _show(spin, {name: str(path) for name, path in paths.items()}, shared.as_json)


def _steps(asked: SimulatedTurnOptions) -> tuple[Step, ...]:
    from tumble.tools.simulate import Step

    between = [Step("rest", asked.pause)] if asked.pause else []
    back = [*between, Step("turn", turns=-asked.turns)] if asked.both_ways else []
    return (Step("rest", asked.still), Step("turn", turns=asked.turns), *back, Step("rest", 2.0))


def _vector(option: str, text: str | None) -> tuple[float, float, float] | None:
    if text is None:
        return None
    x, y, z = numbers_of(option, text, 3)
    return x, y, z


def _disturbance(text: str) -> SimulatedDisturbance:
    from tumble.tools.simulate import SimulatedDisturbance

    kind, _, when = text.partition("@")
    kinds = (
        SimulatedDisturbance.picked_up,
        SimulatedDisturbance.over_a_sill,
        SimulatedDisturbance.lifted,
    )
    makers = dict(zip(DISTURBANCES, kinds, strict=True))
    try:
        return makers[kind](float(when))
    except (KeyError, ValueError):
        raise TumbleError(
            f"--disturb {text}: write {', '.join(DISTURBANCES)} with a time in s, such as sill@8.5"
        ) from None


def _faults(specs: list[str]) -> list[Fault]:
    from tumble.tools.simulate import Fault

    return [fault_of(f"--fault {spec}", spec, "KIND[:KEY=VALUE]...", Fault) for spec in specs]


def _show(spin: SimulatedSpin, paths: dict[str, str], as_json: bool) -> None:
    turned = [float(angle) for angle in spin.turned]
    if as_json:
        content: dict[str, Any] = {
            "seed": spin.scenario.seed,
            "samples": len(spin.samples),
            "turned": turned,
            "rests": spin.rests.tolist(),
            "files": paths,
        }
        print_simulation(content)
        return
    angles = ", ".join(f"{angle / math.tau:+.3f}" for angle in turned) or "none"
    print(f"{paths['log']}: {spin.scenario.unit_grade.name}, {len(spin.samples)} samples, turns {angles}")
    print(f"{paths['truth']}: the truth")
    print(f"Next: tumble spin {paths['log']} -o results")
