"""`tumble simulate multipose`: a unit held still in many orientations, recorded, with its truth."""

from __future__ import annotations

from typing import Annotated

import typer

from tumble.cli.json_option import JsonOption
from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.screen import print_json
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.tools.simulate.options import Format


def multipose_command(
    output: OutputFolder = None,
    orientations: Annotated[int, typer.Option(help="Orientations, all over the sphere.")] = 18,
    faces: Annotated[
        bool,
        typer.Option("--faces", help="A box on its six faces with full turns, and a list of its sections."),
    ] = False,
    still: Annotated[float, typer.Option(help="Time at rest in each, s.")] = 4.0,
    grade: Annotated[str, typer.Option(help="consumer, industrial, tactical or reference.")] = "consumer",
    sample_rate: Annotated[float, typer.Option(help="Samples a second, Hz.")] = 100.0,
    gravity: Annotated[float, typer.Option(help="Local gravity in m/s^2.")] = STANDARD_GRAVITY,
    bias_instability: Annotated[
        bool, typer.Option(help="Noise with bias instability, or white noise alone.")
    ] = True,
    quantisation: Annotated[bool, typer.Option(help="Readings in steps, or unrounded.")] = True,
    g_sensitivity: Annotated[
        bool, typer.Option(help="A gyroscope that responds to specific force, or one that does not.")
    ] = True,
    seed: Annotated[int, typer.Option(help="All random numbers follow from it.")] = 1,
    format_name: Annotated[Format, typer.Option("--format", help="Format of the log.")] = Format.CSV,
    as_json: JsonOption = False,
) -> None:
    """Simulate an IMU that is held still in many orientations and turned by hand in between.

    Example: tumble simulate multipose --orientations 18 --seed 7 -o hand

    Writes multipose.csv and, to hold results against, truth.yaml; with --faces sections.csv as well.
    """
    from tumble.tools.simulate import simulate_multipose, write_multipose

    found = simulate_multipose(
        seed=seed,
        orientations=orientations,
        faces=faces,
        rest_seconds=still,
        grade=grade,
        rate_hz=sample_rate,
        gravity=gravity,
        bias_instability=bias_instability,
        quantisation=quantisation,
        g_sensitivity=g_sensitivity,
    )
    folder = output or folder_named_after("multipose")
    paths = {name: str(path) for name, path in write_multipose(found, folder, format_name.value).items()}
    if as_json:
        print_json({"seed": seed, "samples": len(found.unit.samples), "files": paths})
        return
    held = "six faces" if faces else f"{orientations} orientations"
    about = f"{found.unit.grade.name}, {len(found.unit.samples)} samples, {held}"
    print(f"{paths['log']}: {about}")
    print(f"{paths['truth']}: the truth")
    if faces:
        print(f"{paths['sections']}: what its samples show")
    option = f" --sections {paths['sections']}" if faces else ""
    print(f"Next: tumble multipose {paths['log']}{option} -o results")
