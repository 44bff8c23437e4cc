"""`tumble simulate magnetometer`: a unit turned by hand in the Earth's field, recorded, with its truth."""

from __future__ import annotations

from typing import Annotated

import typer

from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.shared_options import JsonOption, RateOption
from tumble.tools.simulate.options import SeedOption, print_simulation


def magnetometer_command(
    output: OutputFolder = None,
    orientations: Annotated[int, typer.Option(help="Orientations, all over the sphere.")] = 18,
    still: Annotated[float, typer.Option(help="Time at rest in each, s; 0 turns it without a rest.")] = 4.0,
    rate: RateOption = 100.0,
    strength: Annotated[float, typer.Option(help="Strength of the Earth's field, uT.")] = 48.0,
    dip: Annotated[float, typer.Option(help="Its angle below the horizon, deg.")] = 65.0,
    current: Annotated[bool, typer.Option("--current", help="Motors run at several currents.")] = False,
    disturbed: Annotated[
        int, typer.Option(metavar="REST", help="Rest near which a magnet lies, from 1; 0 for none.")
    ] = 0,
    seed: SeedOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Simulate a unit with a magnetometer that is turned by hand in the Earth's field.

    Example: tumble simulate magnetometer --seed 7 -o compass

    Writes magnetometer.csv and, to hold results against, truth.yaml.
    """
    from tumble.tools.simulate import simulate_magnetometer, write_magnetometer

    found = simulate_magnetometer(
        seed=seed,
        orientations=orientations,
        still=still,
        rate=rate,
        strength=strength,
        dip=dip,
        current=current,
        disturbed=disturbed,
    )
    folder = output or folder_named_after("magnetometer")
    paths = {name: str(path) for name, path in write_magnetometer(found, folder).items()}
    if as_json:
        print_simulation({"seed": seed, "samples": len(found.samples), "files": paths})
        return
    print(f"{paths['log']}: {len(found.samples)} samples, {orientations} orientations")
    print(f"{paths['truth']}: the truth")
    option = " --current" if current else ""
    print(f"Next: tumble magnetometer {paths['log']} --field {strength:g}{option} -o results")
