"""`tumble compare`: reads calibrations, reports whether they are the same."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.results import end_unless, show_results, write_results
from tumble.cli.shared_options import MakerOptions, VoiceOptions


def compare_command(
    calibrations: Annotated[
        list[str],
        typer.Argument(
            metavar="CALIBRATION...",
            help="Two files or more: calibrations, or files of other programs that tumble import reads, as "
            "FILE:NAME where one holds several IMUs. The first is held against each of the others.",
        ),
    ],
    output: OutputFolder = None,
    turn_rate: Annotated[
        float,
        typer.Option(
            metavar="RAD/S", help="Largest rate of the turns at which an error of a gyroscope is told."
        ),
    ] = 1.0,
    *,
    maker: MakerOptions,
    voice: VoiceOptions,
) -> None:
    """Report whether calibrations are the same within their uncertainties.

    Three or more of one unit are also laid over time, with a straight line through each parameter.

    Example: tumble compare results/january.yaml results/june.yaml

    Writes a page. The exit code is 0 if all are the same within their uncertainty, 3 if one differs from the
    first or nothing shows whether it does, 2 if nothing could be done.
    """
    from tumble.tools.compare import summary
    from tumble.tools.compare.procedure import compare

    with maker.stated():
        result = compare(calibrations, largest_rate=turn_rate)
    files = write_results(result, output or folder_named_after(result.names[0]))
    for warning in result.warnings:
        print(f"tumble: warning: {warning}", file=sys.stderr)
    well = result.verdict == "same"
    show_results(summary, result, files, voice, well=well)
    end_unless(well)
