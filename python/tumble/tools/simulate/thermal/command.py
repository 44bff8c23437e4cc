"""`tumble simulate thermal`: a unit that rests while it warms and cools, recorded, with its truth."""

from __future__ import annotations

from typing import Annotated

import typer

from tumble.cli.durations import seconds_of
from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.shared_options import RateOption
from tumble.foundation.errors import TumbleError
from tumble.tools.simulate.options import GradeOption, SimulationOptions, print_simulation

_POWERS = "Coefficients of T, T^2, T^3 from mid-range, with commas between"


def thermal_command(
    output: OutputFolder = None,
    duration: Annotated[str, typer.Option(metavar="TIME", help="Length, such as 20min or 3h.")] = "1h",
    rate: RateOption = 20.0,
    grade: GradeOption = "consumer",
    low: Annotated[float, typer.Option(help="Lowest temperature, degC.")] = -10.0,
    high: Annotated[float, typer.Option(help="Highest temperature, degC.")] = 60.0,
    cycles: Annotated[float, typer.Option(help="How often it warms and cools; 0.5 is warming alone.")] = 1.0,
    poses: Annotated[int, typer.Option(help="Poses it is laid in, turned by hand between them.")] = 1,
    accelerometer: Annotated[
        str | None, typer.Option(metavar="POWERS", help=f"{_POWERS}, SI; drawn of the grade if not given.")
    ] = None,
    gyroscope: Annotated[
        str | None, typer.Option(metavar="POWERS", help="Likewise, such as 2e-5,3e-7.")
    ] = None,
    scale: Annotated[
        str | None, typer.Option(metavar="POWERS", help="The same of the accelerometer's scale, 1/K.")
    ] = None,
    accelerometer_hysteresis: Annotated[
        float, typer.Option(help="How much more is read while warming than while cooling, m/s^2.")
    ] = 0.0,
    gyroscope_hysteresis: Annotated[float, typer.Option(help="The same, rad/s.")] = 0.0,
    lag: Annotated[float, typer.Option(help="Time by which the thermometer is behind the sensor, s.")] = 0.0,
    step: Annotated[
        float | None, typer.Option(help="Step of the thermometer, K; that of the grade if not given.")
    ] = None,
    *,
    shared: SimulationOptions,
) -> None:
    """Simulate a unit that rests while it warms and cools, with a drift that is known.

    Example: tumble simulate thermal --duration 1h --gyroscope 2e-5,3e-7 --seed 7 -o thermal

    Writes thermal.csv and, to hold results against, truth.yaml.
    """
    from tumble.cli.progress import sample_progress
    from tumble.tools.simulate import simulate_thermal, write_thermal

    session = simulate_thermal(
        seed=shared.seed,
        duration=seconds_of("--duration", duration),
        rate_hz=rate,
        grade=grade,
        low=low,
        high=high,
        cycles=cycles,
        poses=poses,
        accelerometer=_powers("--accelerometer", accelerometer),
        gyroscope=_powers("--gyroscope", gyroscope),
        scale=_powers("--scale", scale) or (),
        accelerometer_hysteresis=accelerometer_hysteresis,
        gyroscope_hysteresis=gyroscope_hysteresis,
        lag=lag,
        step=step,
    )
    folder = output or folder_named_after("thermal")
    with sample_progress("writing") as advance:
        paths = write_thermal(session, folder, shared.format_name.value, progress=advance)
    files = {name: str(path) for name, path in paths.items()}
    scenario = session.scenario
    if shared.as_json:
        print_simulation(
            {"seed": shared.seed, "samples": scenario.samples, "truth": session.truth, "files": files}
        )
        return
    print(f"{files['log']}: {scenario.unit_grade.name}, {scenario.samples} samples, {low:g} to {high:g} degC")
    print(f"{files['truth']}: the truth")
    print(f"Next: tumble thermal {files['log']} -o results")


def _powers(option: str, text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        return tuple(float(part) for part in text.split(",")) if text.strip() else ()
    except ValueError:
        raise TumbleError(f"{option} {text}: needs numbers with commas between, such as 2e-5,3e-7") from None
