"""Files for viewers, all of one content."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Final

from tumble.foundation.errors import OutputError
from tumble.foundation.files import check_output
from tumble.foundation.recording import SampleProgress
from tumble.logs.optional import install_command
from tumble.logs.writers import FORMATS
from tumble.tools.viewers.content import ViewerContent

RERUN: Final = "rerun"


def check_viewer_files(rerun: Path | None, mcap: Path | None) -> None:
    """Raises `OutputError`, before any long work, where one of the files could not be written."""
    if rerun is not None:
        if find_spec("rerun") is None:
            raise OutputError(
                f"{rerun}: writing it needs the Python package rerun-sdk, which is not installed; type: "
                f"{install_command(RERUN)}"
            )
        from tumble.tools.viewers.rerun_file import RRD

        _check_ending(rerun, ".rrd", "--rerun")
        check_output(rerun, RRD)
    if mcap is not None:
        from tumble.tools.viewers.mcap_file import LAYOUT, layout_path

        _check_ending(mcap, ".mcap", "--mcap")
        check_output(mcap, FORMATS["mcap"])
        check_output(layout_path(mcap), LAYOUT)


def _check_ending(path: Path, ending: str, option: str) -> None:
    if path.suffix.lower() != ending:
        raise OutputError(f"{option} {path}: give a name that ends in {ending}, by which viewers know it")


def write_viewer_files(
    content: ViewerContent,
    *,
    rerun: Path | None = None,
    mcap: Path | None = None,
    progress: SampleProgress | None = None,
) -> dict[str, Path]:
    """Writes content as `.rrd`, as MCAP with a layout beside it, or both; returns each path by what it is.

    Raises `OutputError` where a file cannot be written, `LogError` where a recording cannot be read to its
    end.
    """
    check_viewer_files(rerun, mcap)
    files: dict[str, Path] = {}
    if rerun is not None:
        from tumble.tools.viewers.rerun_file import write_rerun

        write_rerun(content, rerun, progress)
        files[RERUN] = rerun
    if mcap is not None:
        from tumble.tools.viewers.mcap_file import layout_path, write_mcap

        write_mcap(content, mcap, progress)
        files |= {"mcap": mcap, "layout": layout_path(mcap)}
    return files
