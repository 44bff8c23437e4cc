"""Results on standard output, one way for all procedures: a summary for people, JSON for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import typer

from tumble.cli.exit_code import ExitCode
from tumble.cli.screen import print_json, print_json_line, print_summary

if TYPE_CHECKING:
    from rich.console import RenderableType

_FILES = {
    "settings": "Settings",
    "calibration": "Calibration",
    "kalibr": "Kalibr, OpenVINS, VINS",
    "report": "Report",
}
"""Names of files in the order in which they are listed."""
_Result = TypeVar("_Result", contravariant=True)


class Summary(Protocol[_Result]):
    """The module `summary` of a procedure."""

    def screen_summary(self, result: _Result, /) -> RenderableType:
        """Draw what a person wants to know at once."""

    def json_content(self, result: _Result, files: dict[str, Path], /) -> dict[str, Any]:
        """Give the result as finite numbers, text, lists and mappings."""


def show_results(
    summary: Summary[_Result], result: _Result, files: dict[str, Path], as_json: bool, *, live: bool = False
) -> None:
    """Print what was found and where it is; the JSON of a live session is an event on a line of its own."""
    if not as_json:
        print_summary(summary.screen_summary(result))
        _list_files(files)
    elif live:
        print_json_line({"event": "result", **summary.json_content(result, files)})
    else:
        print_json(summary.json_content(result, files))


def _list_files(files: Mapping[str, Path]) -> None:
    for key, what in _FILES.items():
        if key in files:
            print(f"{what}: {files[key]}")


def end_unless(all_well: bool) -> None:
    """End the command with `NOT_ALL_WELL` where something in the results is wrong or was not shown."""
    if not all_well:
        raise typer.Exit(ExitCode.NOT_ALL_WELL)
