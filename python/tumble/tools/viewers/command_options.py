"""The options `--rerun` and `--mcap`: what a command found as files that viewers open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tumble.cli.options import Options, refuse_given

if TYPE_CHECKING:
    from tumble.tools.viewers.content import ViewerContent


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewerOptions(Options):
    """Files for viewers that a command writes beside its results."""

    rerun: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.rrd",
            help="Write readings, rests, events and parameters for Rerun, with a blueprint.",
            show_default=False,
        ),
    ] = None
    mcap: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.mcap",
            help="The same as MCAP for Foxglove, whose layout is written beside it, and PlotJuggler.",
            show_default=False,
        ),
    ] = None

    @property
    def are_wanted(self) -> bool:
        """Returns whether any file is to be written."""
        return self.rerun is not None or self.mcap is not None

    def check(self) -> None:
        """Raise `OutputError`, before any long work, where one of the files could not be written."""
        if self.are_wanted:
            from tumble.tools.viewers.writing import check_viewer_files

            check_viewer_files(self.rerun, self.mcap)

    def refuse_live(self) -> None:
        """Raise `ProcedureError` where a session is live, whose recording can be shown once it has ended."""
        refuse_given(
            {"--rerun": self.rerun, "--mcap": self.mcap},
            "is for recordings; type tumble view RESULTS with it once the session has ended",
        )

    def write(self, content: Callable[[], ViewerContent], *, quiet: bool) -> dict[str, Path]:
        """Write what is wanted of the content; give the path of each file by what it is."""
        if not self.are_wanted:
            return {}
        from tumble.cli.progress import sample_progress
        from tumble.tools.viewers.writing import write_viewer_files

        with sample_progress("writing for viewers", quiet=quiet) as advance:
            return write_viewer_files(content(), rerun=self.rerun, mcap=self.mcap, progress=advance)
