"""`tumble import`: calibration files from those of another program."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from tumble.cli.output import OutputFolder, folder_named_after
from tumble.cli.screen import print_document
from tumble.cli.shared_options import JsonOption, format_option
from tumble.foundation.units import UNITS

if TYPE_CHECKING:
    from tumble.calibration.document import Calibration

IMPORT: Final = "tumble-import/1"


def import_command(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="File of another program, or a log of PX4 or ArduPilot.")
    ],
    format_name: Annotated[
        str | None, format_option("FORMAT", "what the file tells, as tumble export --format list names it,")
    ] = None,
    output: OutputFolder = None,
    as_json: JsonOption = False,
) -> None:
    """Read a calibration that another program made.

    Example: tumble import vehicle.params -o results

    A flight log (.ulg, .bin) gives the calibration that the autopilot flew with at its end.

    Writes a calibration file for each IMU, to be applied, compared, or built on (--calibration).
    """
    from tumble.foundation.file_names import file_stem
    from tumble.foundation.files import prepare_folder
    from tumble.tools.exchange.procedure import import_calibrations

    found = import_calibrations(file, format_name)
    folder = prepare_folder(output or folder_named_after(file.stem))
    paths = [folder / f"{file_stem(each.name)}.yaml" for each in found]
    for calibration, path in zip(found, paths, strict=True):
        calibration.save(path)
    if as_json:
        calibrations = [
            {"file": str(path), "calibration": each.content()}
            for each, path in zip(found, paths, strict=True)
        ]
        print_document(IMPORT, "imported", {"calibrations": calibrations})
        return
    for calibration, path in zip(found, paths, strict=True):
        print(f"{path}\n{calibration}")
        for note in _notes(calibration):
            print(f"Note: {note}")


def _notes(calibration: Calibration) -> Iterator[str]:
    """Describes options for logs where a calibration corrects readings in another unit."""
    from tumble.foundation.words import short
    from tumble.tools.exchange.target import READINGS

    stated = None if calibration.method is None else calibration.method.options.get(READINGS)
    for triad, unit in UNITS.items():
        if isinstance(stated, dict) and triad in stated:
            yield (
                f"it corrects {triad} readings in {short(stated[triad])}: read logs with "
                f"--{triad}-unit {unit} --{triad}-scale 1"
            )
