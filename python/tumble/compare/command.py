"""`tumble compare`: reads calibrations, says whether they are the same."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from tumble.cli.exit_code import ExitCode
from tumble.cli.maker_options import with_maker
from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.screen import print_json, print_summary


@with_maker
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
    rate: Annotated[
        float,
        typer.Option(
            metavar="RAD/S", help="Largest rate of the turns at which an error of a gyroscope is told."
        ),
    ] = 1.0,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON instead of a table.")
    ] = False,
) -> None:
    """Say whether calibrations are the same within what is known of each.

    Three or more of one unit are also laid over time, with a straight line through each parameter.

    Example: tumble compare results/january.yaml results/june.yaml

    Writes a page. The exit code is 0 if all are the same within their uncertainty, 3 if one differs from the
    first or nothing shows whether it does, 2 if nothing could be done.
    """
    from tumble.compare.procedure import compare
    from tumble.compare.report.page import COMPARE_REPORT
    from tumble.compare.summary import json_content, screen_summary
    from tumble.file_names import COMPARE_PAGE
    from tumble.files import PAGE, check_output, prepare_folder

    result = compare(calibrations, largest_rate=rate)
    page = prepare_folder(output or folder_named_after(result.names[0])) / COMPARE_PAGE
    check_output(page, PAGE)
    COMPARE_REPORT.write(result, page)
    for warning in result.warnings:
        print(f"tumble: warning: {warning}", file=sys.stderr)
    if as_json:
        print_json(json_content(result, {"report": page}))
    else:
        print_summary(screen_summary(result))
        print(f"Report: {page}")
    if result.verdict != "same":
        raise typer.Exit(ExitCode.NOT_ALL_WELL)
