"""`tumble simulate spin`: a robot that turns on the spot, recorded, with its truth."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tumble.cli.json_option import JsonOption
from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.screen import print_json
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import TumbleError
from tumble.tools.simulate.options import Format, fault_of, numbers_of

if TYPE_CHECKING:
    from tumble.tools.simulate import Disturbance, Fault, SimulatedSpin, Step

DISTURBANCES = ("picked-up", "sill", "lifted")


def spin_command(
    output: OutputFolder = None,
    plan: Annotated[
        str | None,
        typer.Option(
            metavar="STEP,...",
            help="What the robot does, instead of --still, --turns, --both-ways: `rest S`, `N turns` "
            "(counter-clockwise positive), `drive S [tilt DEG] [uphill DEG] [bend DEG]` to another floor; "
            "such as 'rest 6, 3 turns, -3 turns, drive 8 tilt 2'.",
        ),
    ] = None,
    still: Annotated[float, typer.Option(help="Time at rest before it turns, s.")] = 6.0,
    turns: Annotated[float, typer.Option(help="Turns, counter-clockwise positive.")] = 3.0,
    both_ways: Annotated[bool, typer.Option(help="Turn back again, or turn one way only.")] = True,
    pause: Annotated[float, typer.Option(help="Rest between the two, s; none where 0.")] = 0.0,
    rate: Annotated[float, typer.Option(help="Speed of the turns, rad/s.")] = 1.0,
    turn_acceleration: Annotated[
        float, typer.Option(help="Largest acceleration as a turn begins and ends, rad/s^2.")
    ] = 2.0,
    unevenness: Annotated[float, typer.Option(help="Share by which the speed goes up and down.")] = 0.0,
    slips: Annotated[float, typer.Option(help="Slips of the wheels per turn.")] = 0.0,
    slow_turn: Annotated[
        float, typer.Option(help="Rate it turns with while it seems to stand at the start, rad/s.")
    ] = 0.0,
    vibration: Annotated[float, typer.Option(help="Vibration while the motors run, m/s^2.")] = 0.0,
    floor_tilt: Annotated[float, typer.Option(help="Tilt of the floor, deg.")] = 1.0,
    uphill: Annotated[
        float, typer.Option(help="Uphill, deg counter-clockwise from forward at the start.")
    ] = 40.0,
    mounting: Annotated[
        str, typer.Option(metavar="ROLL,PITCH,YAW", help="Mounting of the IMU in the robot, deg.")
    ] = "3,-2,0",
    lever_arm: Annotated[
        str, typer.Option(metavar="X,Y", help="IMU from the turning axis, forward and left, m.")
    ] = "0.10,-0.06",
    grade: Annotated[str, typer.Option(help="consumer, industrial, tactical or reference.")] = "consumer",
    accelerometer_bias: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="m/s^2; drawn from the grade if not given.")
    ] = None,
    gyroscope_bias: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="rad/s; drawn from the grade if not given.")
    ] = None,
    accelerometer_noise: Annotated[
        float | None, typer.Option(help="Of one sample, m/s^2; that of the grade if not given.")
    ] = None,
    gyroscope_noise: Annotated[
        float | None, typer.Option(help="Of one sample, rad/s; that of the grade if not given.")
    ] = None,
    accelerometer_range: Annotated[
        float | None, typer.Option(help="Largest reading, m/s^2; that of the grade if not given.")
    ] = None,
    gyroscope_scale: Annotated[float, typer.Option(help="Scale error of the gyroscope, 0.01 for 1 %.")] = 0.0,
    matrix_errors: Annotated[
        float,
        typer.Option(
            help="Share of the grade's scale, non-orthogonality and alignment errors; 0 is a unit calibrated "
            "before."
        ),
    ] = 0.0,
    sample_rate: Annotated[float, typer.Option(help="Samples a second, Hz.")] = 100.0,
    disturb: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND@S",
            help="What happens to the robot: picked-up, sill or lifted, and when; repeatable.",
        ),
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND[:KEY=VALUE]...",
            help="Something wrong with the log, such as gap:start=20:end=99; repeatable. Kinds and keys as "
            "of tumble simulate turntable.",
        ),
    ] = None,
    gravity: Annotated[float, typer.Option(help="Local gravity in m/s^2.")] = STANDARD_GRAVITY,
    latitude: Annotated[
        float | None, typer.Option(help="Latitude in degrees, for the Earth's rate; none if not given.")
    ] = None,
    bias_instability: Annotated[
        bool, typer.Option(help="Noise with bias instability, or white noise alone.")
    ] = True,
    quantisation: Annotated[bool, typer.Option(help="Readings in steps, or unrounded.")] = True,
    seed: Annotated[int, typer.Option(help="All random numbers follow from it.")] = 1,
    format_name: Annotated[Format, typer.Option("--format", help="Format of the log.")] = Format.CSV,
    as_json: JsonOption = False,
) -> None:
    """Simulate a wheeled robot that stands still, then turns on the spot.

    Example: tumble simulate spin --floor-tilt 2 --turns 3 --seed 7 -o spin

    Writes spin.csv and, to hold results against, truth.yaml.
    """
    from tumble.tools.simulate import parse_plan, simulate_spin, write_spin

    roll, pitch, yaw = numbers_of("--mounting", mounting, 3)
    forward, left = numbers_of("--lever-arm", lever_arm, 2)
    steps = _steps(still, turns, both_ways, pause) if plan is None else parse_plan(plan)
    spin = simulate_spin(
        seed=seed,
        plan=steps,
        turn_rate=rate,
        turn_acceleration=turn_acceleration,
        unevenness=unevenness,
        slips=slips,
        slow_turn=slow_turn,
        vibration=vibration,
        disturbances=[_disturbance(text) for text in disturb or []],
        floor_tilt_deg=floor_tilt,
        uphill_deg=uphill,
        roll_deg=roll,
        pitch_deg=pitch,
        yaw_deg=yaw,
        lever_arm_m=(forward, left, 0.0),
        grade=grade,
        accelerometer_bias=_vector("--accelerometer-bias", accelerometer_bias),
        gyroscope_bias=_vector("--gyroscope-bias", gyroscope_bias),
        accelerometer_noise=accelerometer_noise,
        gyroscope_noise=gyroscope_noise,
        accelerometer_range=accelerometer_range,
        gyroscope_scale=gyroscope_scale,
        matrix_errors=matrix_errors,
        rate_hz=sample_rate,
        faults=_faults(fault or []),
        gravity=gravity,
        latitude_deg=latitude,
        bias_instability=bias_instability,
        quantisation=quantisation,
    )
    paths = write_spin(spin, output or folder_named_after("spin"), format_name.value)
    _show(spin, {name: str(path) for name, path in paths.items()}, as_json)


def _steps(still: float, turns: float, both_ways: bool, pause: float) -> tuple[Step, ...]:
    from tumble.tools.simulate import Step

    between = [Step("rest", pause)] if pause else []
    back = [*between, Step("turn", turns=-turns)] if both_ways else []
    return (Step("rest", still), Step("turn", turns=turns), *back, Step("rest", 2.0))


def _vector(option: str, text: str | None) -> tuple[float, float, float] | None:
    if text is None:
        return None
    x, y, z = numbers_of(option, text, 3)
    return x, y, z


def _disturbance(text: str) -> Disturbance:
    from tumble.tools.simulate import Disturbance

    kind, _, when = text.partition("@")
    makers = dict(
        zip(DISTURBANCES, (Disturbance.picked_up, Disturbance.over_a_sill, Disturbance.lifted), strict=True)
    )
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
        print_json(content)
        return
    angles = ", ".join(f"{angle / math.tau:+.3f}" for angle in turned) or "none"
    print(f"{paths['log']}: {spin.scenario.unit_grade.name}, {len(spin.samples)} samples, turns {angles}")
    print(f"{paths['truth']}: the truth")
    print(f"Next: tumble spin {paths['log']} -o results")
