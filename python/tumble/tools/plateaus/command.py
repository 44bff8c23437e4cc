"""`tumble plateaus`: reads calibrations at several temperatures, writes one over temperature."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.results import end_unless, show_results, write_results
from tumble.cli.shared_options import MakerOptions, VoiceOptions


def plateaus_command(
    calibrations: Annotated[
        list[Path],
        typer.Argument(
            metavar="CALIBRATION...",
            help="Calibrations of one unit, each at its own temperature, in the order of their recording.",
        ),
    ],
    output: OutputFolder = None,
    temperature: Annotated[
        list[float] | None,
        typer.Option(
            metavar="DEGC",
            help="Temperature of a calibration, once for each in their order; the mean that each states if "
            "not given.",
        ),
    ] = None,
    reference_temperature: Annotated[
        float | None,
        typer.Option(metavar="DEGC", help="Temperature at which M and b hold; the middle if not given."),
    ] = None,
    *,
    maker: MakerOptions,
    voice: VoiceOptions,
) -> None:
    """Make one calibration over temperature of several, each made at its own temperature.

    A rate table in a climate chamber takes the same session at several plateaus: three or more, up and back.

    Example: tumble plateaus results/cold.yaml results/room.yaml results/hot.yaml -o results

    Writes a calibration file and a page. The exit code is 0 if bias, scale and hysteresis of all axes were
    found, 3 if hysteresis is not known or the model was not met, 2 if nothing could be done.
    """
    from tumble.calibration.unit_files import prepare_unit_files
    from tumble.tools.plateaus import summary
    from tumble.tools.plateaus.procedure import plateaus

    with maker.stated():
        result = plateaus(calibrations, temperatures=temperature, reference=reference_temperature)
    folder = output or folder_named_after(result.name)
    prepare_unit_files(folder, result.name, "plateaus")
    well = result.verdict == "measured"
    show_results(summary, result, write_results(result, folder), voice, well=well)
    end_unless(well)
