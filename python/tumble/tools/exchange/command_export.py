"""`tumble export`: a calibration in the file of another program."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from tumble.cli.output import OutputFile
from tumble.cli.screen import LISTED, print_document
from tumble.cli.shared_options import JsonOption, format_option
from tumble.foundation.errors import CommandError, ProcedureError
from tumble.foundation.words import count_of

if TYPE_CHECKING:
    from tumble.tools.exchange.target import Exported

LIST = "list"
EXPORT: Final = "tumble-export/1"
TARGET_LIST: Final = "tumble-export-formats/1"


def export_command(
    calibrations: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="CALIBRATION...",
            help="Calibration files; several where a format holds several IMUs, in their order.",
            show_default=False,
        ),
    ] = None,
    format_name: Annotated[str, format_option("FORMAT", "list, which shows all formats,")] = LIST,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="What the format has to be told and no calibration knows, such as accelerometer-id=2490378; "
            "with several calibrations a value for all, or one for each with commas between.",
            show_default=False,
        ),
    ] = None,
    write_all: Annotated[
        bool,
        typer.Option(
            "--all",
            help="Write every format that the calibration and --set suffice for, into the folder --output; "
            "report what each other lacks.",
        ),
    ] = False,
    output: OutputFile = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="Write nothing where the format cannot hold all of it.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a calibration for another program.

    Example: tumble export results/imu.yaml --format ardupilot -o imu.param

    Each loss of a format is reported, with the remaining error in the unit of the sensor. Names, units and
    formulas are those of each program's documentation; --format list shows what each holds and needs.
    """
    if write_all and format_name != LIST:
        raise CommandError(f"--all writes every format; leave out --format {format_name}")
    if format_name == LIST and not write_all:
        if calibrations:
            raise CommandError(
                "missing --format; tumble export --format list shows them, --all writes every one"
            )
        _list(as_json)
        return
    if not calibrations:
        raise CommandError("missing CALIBRATION; see tumble export --help")
    if write_all:
        from tumble.tools.exchange.command_export_all import write_all_formats

        write_all_formats(calibrations, _typed(settings or []), output, strict=strict, as_json=as_json)
        return
    from tumble.calibration.document import Calibration
    from tumble.foundation.file_names import file_stem
    from tumble.foundation.files import check_output, replacing
    from tumble.tools.exchange.procedure import export
    from tumble.tools.exchange.registry import target

    format_ = target(format_name)
    units = [Calibration.load(path) for path in calibrations]
    exported = export(units, format_name, _typed(settings or []))
    if strict and exported.losses:
        raise ProcedureError("; ".join(map(str, exported.losses)))
    path = output or Path(f"{file_stem(units[0].name)}-tumble{format_.ending}")
    check_output(path, format_.output_kind, inputs=calibrations)
    with replacing(path, format_.output_kind, inputs=calibrations) as file:
        file.write(exported.content)
    if as_json:
        print_document(EXPORT, _verdict(exported), printed(exported, path))
        return
    _warn(exported)
    print(f"{count_of('calibration', len(units))} written: {path}")
    for remark in exported.remarks:
        print(f"Note: {remark}")


def _typed(settings: list[str]) -> dict[str, str]:
    pairs = [setting.partition("=") for setting in settings]
    for name, sign, value in pairs:
        if not (name and sign and value):
            raise CommandError(f"--set {name}{sign}{value}: give NAME=VALUE")
    return {name: value for name, _, value in pairs}


def _verdict(exported: Exported) -> str:
    return "with losses" if exported.losses else "whole"


def printed(exported: Exported, path: Path) -> dict[str, object]:
    """Returns what `--json` prints of a file for another program."""
    losses = [
        {"unit": each.unit, "triad": each.triad, "part": each.part, "size": each.size, "at": each.condition}
        for each in exported.losses
    ]
    return {
        "file": str(path),
        "losses": losses,
        "remarks": list(exported.remarks),
        "warnings": list(exported.warnings),
    }


def _warn(exported: Exported) -> None:
    for warning in (*exported.warnings, *exported.losses):
        print(f"tumble: warning: {warning}", file=sys.stderr)


def _list(as_json: bool) -> None:
    from tumble.tools.exchange.registry import TARGETS

    if as_json:
        formats = {
            word: {
                "title": each.title,
                "ending": each.ending,
                "holds": {triad: list(parts) for triad, parts in each.holds.items()},
                "needs": {setting.name: setting.meaning for setting in each.settings},
                "imported": each.read is not None,
                "axes": each.axes_in_words,
                "source": each.source,
            }
            for word, each in TARGETS.items()
        }
        print_document(TARGET_LIST, LISTED, {"formats": formats})
        return
    from rich.table import Table

    from tumble.cli.screen import print_summary

    table = Table("--format", "format", "holds of accelerometer", "of gyroscope", "needs --set", "import")
    for word, each in TARGETS.items():
        needs = [setting.name for setting in each.settings if setting.default is None]
        accelerometer, gyroscope = (
            ", ".join(each.holds.get(triad, ())) for triad in ("accelerometer", "gyroscope")
        )
        imported = "yes" if each.read is not None else ""
        table.add_row(word, each.title, accelerometer, gyroscope, ", ".join(needs), imported)
    print_summary(table)
    print("All settings, with what they mean: tumble export --format list --json")
