"""`tumble simulate multipose`: a unit held still in many orientations, recorded, with its truth."""

from __future__ import annotations

from typing import Annotated

import typer

from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.shared_options import RateOption
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.tools.simulate.options import (
    GradeOption,
    GravityOption,
    InstabilityOption,
    ResponseOption,
    SimulationOptions,
    StepsOption,
    print_simulation,
)


def multipose_command(
    output: OutputFolder = None,
    orientations: Annotated[int, typer.Option(help="Orientations, all over the sphere.")] = 18,
    faces: Annotated[
        bool,
        typer.Option("--faces", help="A box on its six faces with full turns, and a list of its sections."),
    ] = False,
    still: Annotated[float, typer.Option(help="Time at rest in each, s.")] = 4.0,
    grade: GradeOption = "consumer",
    rate: RateOption = 100.0,
    gravity: GravityOption = STANDARD_GRAVITY,
    bias_instability: InstabilityOption = True,
    quantisation: StepsOption = True,
    g_sensitivity: ResponseOption = True,
    *,
    shared: SimulationOptions,
) -> None:
    """Simulate an IMU that is held still in many orientations and turned by hand in between.

    Example: tumble simulate multipose --orientations 18 --seed 7 -o hand

    Writes multipose.csv and, to hold results against, truth.yaml; with --faces sections.csv as well.
    """
    from tumble.tools.simulate import simulate_multipose, write_multipose

    found = simulate_multipose(
        seed=shared.seed,
        orientations=orientations,
        faces=faces,
        rest_seconds=still,
        grade=grade,
        rate_hz=rate,
        gravity=gravity,
        bias_instability=bias_instability,
        quantisation=quantisation,
        g_sensitivity=g_sensitivity,
    )
    folder = output or folder_named_after("multipose")
    paths = {
        name: str(path) for name, path in write_multipose(found, folder, shared.format_name.value).items()
    }
    if shared.as_json:
        print_simulation({"seed": shared.seed, "samples": len(found.unit.samples), "files": paths})
        return
    held = "six faces" if faces else f"{orientations} orientations"
    about = f"{found.unit.grade.name}, {len(found.unit.samples)} samples, {held}"
    print(f"{paths['log']}: {about}")
    print(f"{paths['truth']}: the truth")
    if faces:
        print(f"{paths['sections']}: what its samples show")
    option = f" --sections {paths['sections']}" if faces else ""
    print(f"Next: tumble multipose {paths['log']}{option} -o results")
