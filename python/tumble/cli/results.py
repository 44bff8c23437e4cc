"""Results on standard output, one way for all procedures: a summary for people, JSON for other programs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import typer

from tumble.cli.errors import print_notice
from tumble.cli.exit_code import ExitCode
from tumble.cli.screen import print_document, print_event, print_summary
from tumble.foundation.translation import translated

if TYPE_CHECKING:
    from rich.console import RenderableType

    from tumble.cli.shared_options import VoiceOptions

_FILES = {
    "settings": "Settings",
    "calibration": "Calibration",
    "kalibr": "Kalibr, OpenVINS, VINS",
    "events": "Events",
    "report": "Report",
    "store": "Store",
    "output": "Output",
    "rerun": "Rerun",
    "mcap": "Foxglove, PlotJuggler",
    "layout": "Layout of Foxglove",
}
"""Titles of files that are not named after a unit."""


class Found(Protocol):
    """Result of a procedure."""

    @property
    def verdict(self) -> str:
        """The unit, or a set of them, in a word."""

    def save(self, folder: Path | str, /) -> dict[str, Path]:
        """Write all files into a folder; give the path of each by what it is."""


_Found = TypeVar("_Found", bound=Found)
_Shown = TypeVar("_Shown", bound=Found, contravariant=True)


class Summary(Protocol[_Shown]):
    """The module `summary` of a procedure."""

    @property
    def SCHEMA(self) -> str:  # noqa: N802 - a constant of the module
        """Schema of what `json_content` gives."""

    def screen_summary(self, result: _Shown, /) -> RenderableType:
        """Draw what a person wants to know at once."""

    def json_content(self, result: _Shown, files: Mapping[str, Path], /) -> dict[str, Any]:
        """Give the result as finite numbers, text, lists and mappings."""


def write_results(result: Found, folder: Path) -> dict[str, Path]:
    """Write all that a procedure writes into a folder; give the path of each file by what it is."""
    return result.save(folder)


def list_files(files: Mapping[str, Path]) -> None:
    """Print a line for each file."""
    for key, path in files.items():
        print(f"{translated(_FILES.get(key, key))}: {path}")


def show_results(
    summary: Summary[_Found],
    result: _Found,
    files: Mapping[str, Path],
    voice: VoiceOptions,
    *,
    well: bool,
    live: bool = False,
    draw: Callable[[_Found], RenderableType] | None = None,
    list_files: Callable[[Mapping[str, Path]], None] = list_files,
    failures: Iterable[str] | None = None,
) -> None:
    """Print what was found and where it is; the JSON of a live session is an event on a line of its own.

    `draw` takes the place of the summary's own table. If quiet, only failures are printed, on standard error:
    the `failures`, or the verdict where not all is `well`.
    """
    if voice.as_json:
        content = summary.json_content(result, files)
        if live:
            print_event("result", {"schema": summary.SCHEMA, "verdict": result.verdict, **content})
        else:
            print_document(summary.SCHEMA, result.verdict, content)
    elif voice.quiet:
        verdict = () if well else (f"{result.verdict}; see {files['report']}",)
        for line in verdict if failures is None else failures:
            print_notice(line)
    else:
        print_summary((draw or summary.screen_summary)(result))
        list_files(files)


def end_unless(all_well: bool) -> None:
    """Ends the command with `NOT_ALL_WELL` where something in the results is wrong or was not shown."""
    if not all_well:
        raise typer.Exit(ExitCode.NOT_ALL_WELL)
