"""`tumble simulate plateaus`: turntable sessions of one unit at several temperatures, with their truth."""

from __future__ import annotations

from typing import Annotated

import typer

from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.shared_options import RateOption
from tumble.foundation.errors import TumbleError
from tumble.tools.simulate.options import GradeOption, InstabilityOption, SimulationOptions, print_simulation

_POWERS = "Coefficients of T, T^2, T^3 from mid-range, with commas between"


def plateaus_command(
    output: OutputFolder = None,
    temperatures: Annotated[
        str, typer.Option(metavar="DEGC,...", help="Temperature of each session, in their order.")
    ] = "-20,10,40,70,10",
    grade: GradeOption = "consumer",
    rate: RateOption = 100.0,
    rest: Annotated[float, typer.Option(help="Time at each pose in s.")] = 5.0,
    accelerometer: Annotated[
        str, typer.Option(metavar="POWERS", help=f"{_POWERS}, of the bias, SI.")
    ] = "1e-3,1e-5",
    gyroscope: Annotated[
        str, typer.Option(metavar="POWERS", help="The same of the gyroscope.")
    ] = "2e-5,3e-7",
    accelerometer_scale: Annotated[
        str, typer.Option(metavar="POWERS", help="The same of the accelerometer's scale, 1/K.")
    ] = "3e-5",
    gyroscope_scale: Annotated[
        str, typer.Option(metavar="POWERS", help="The same of the gyroscope's scale, 1/K.")
    ] = "5e-5",
    accelerometer_hysteresis: Annotated[
        float, typer.Option(help="Bias after warming minus that after cooling, m/s^2.")
    ] = 0.0,
    gyroscope_hysteresis: Annotated[float, typer.Option(help="The same, rad/s.")] = 0.0,
    magnetometer: Annotated[
        str, typer.Option(metavar="POWERS", help="Give the units a magnetometer; the same of its bias, uT.")
    ] = "",
    magnetometer_scale: Annotated[
        str, typer.Option(metavar="POWERS", help="The same of its scale, 1/K.")
    ] = "",
    mounting_change: Annotated[
        float, typer.Option(help="Turn of the unit about x from the coldest to the hottest session, deg.")
    ] = 0.0,
    bias_instability: InstabilityOption = True,
    *,
    shared: SimulationOptions,
) -> None:
    """Simulate a turntable in a climate chamber: the same session of one unit at several temperatures.

    Example: tumble simulate plateaus --temperatures=-20,10,40,70,10 --seed 7 -o chamber

    Writes session_1, session_2 ..., each with reference.csv and target_1.csv, and truth.yaml.
    """
    from tumble.tools.simulate import simulate_plateaus, write_plateaus

    plateaus = simulate_plateaus(
        seed=shared.seed,
        temperatures=_numbers("--temperatures", temperatures),
        grade=grade,
        rate_hz=rate,
        rest_seconds=rest,
        accelerometer=_numbers("--accelerometer", accelerometer),
        gyroscope=_numbers("--gyroscope", gyroscope),
        accelerometer_scale=_numbers("--accelerometer-scale", accelerometer_scale),
        gyroscope_scale=_numbers("--gyroscope-scale", gyroscope_scale),
        magnetometer=_numbers("--magnetometer", magnetometer),
        magnetometer_scale=_numbers("--magnetometer-scale", magnetometer_scale),
        accelerometer_hysteresis=accelerometer_hysteresis,
        gyroscope_hysteresis=gyroscope_hysteresis,
        mounting_change_deg=mounting_change,
        bias_instability=bias_instability,
    )
    paths = write_plateaus(plateaus, output or folder_named_after("plateaus"), shared.format_name.value)
    files = {name: str(path) for name, path in paths.items()}
    if shared.as_json:
        print_simulation({"seed": shared.seed, "truth": paths["truth"], "files": files})
        return
    truth = files.pop("truth")
    for path, degrees in zip(files.values(), plateaus.scenario.temperatures, strict=True):
        print(f"{path}: {degrees:g} degC")
    print(f"{truth}: the truth")
    first = files["session_1"]
    logs = f"{first}/reference.{shared.format_name.value} {first}/target_1.{shared.format_name.value}"
    print(f"Next, for each: tumble turntable {logs} -o results/session_1")


def _numbers(option: str, text: str) -> tuple[float, ...]:
    try:
        return tuple(float(word) for word in text.split(",") if word.strip())
    except ValueError:
        raise TumbleError(f"{option} {text}: needs numbers with commas between, such as 2e-5,3e-7") from None
