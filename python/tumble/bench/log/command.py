"""`tumble view`: charts of any recording, session or result, in the browser."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from tumble.cli.read_options import ReadingOptions
from tumble.cli.results import list_files
from tumble.cli.screen import print_event
from tumble.cli.shared_options import JsonOption
from tumble.cli.standard_output import drawing
from tumble.foundation.errors import CommandError
from tumble.logs.optional import install_command
from tumble.tools.viewers.command_options import ViewerOptions

if TYPE_CHECKING:
    from tumble.tools.view.viewing import Viewing

_NEEDED: Final = ("nicegui", "tsdownsample")


def view_command(
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="LOG|RESULT|SESSION...",
            help="Logs, LOG:NAME for one IMU of several; recorded sessions; calibration files, JSON and "
            "folders of results. Several are shown together.",
        ),
    ],
    calibration: Annotated[
        list[Path] | None,
        typer.Option(
            "--calibration",
            metavar="FILE",
            help="Calibration file of a unit, which is then shown corrected beside raw; repeatable.",
            show_default=False,
        ),
    ] = None,
    log: Annotated[
        str | None,
        typer.Option(
            "--log", metavar="LOG", help="Log of a RESULT, if it is not beside it.", show_default=False
        ),
    ] = None,
    port: Annotated[
        int, typer.Option("--port", metavar="N", help="Port of the page; any free one if not given.")
    ] = 0,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Only print the address of the page.")
    ] = False,
    as_json: JsonOption = False,
    *,
    viewers: ViewerOptions,
    reading: ReadingOptions,
) -> None:
    """Show recordings as charts in the browser: zoom, rests and turns, spectra, calibrated beside raw.

    Example: tumble view drive.bag:/imu/data

    Serves a page on this computer until Ctrl-C. Charts zoom by wheel, drag and keys, and save as PNG and SVG.
    With a result its recording is shown, with the rests that were used and the residuals. With --rerun or
    --mcap a file for another viewer is written instead of a page served.
    """
    from tumble.tools.view.viewing import open_viewing

    viewers.check()
    if not viewers.are_wanted:
        _need_extra()
    viewing = open_viewing(sources, calibrations=calibration or (), log=log, read=reading.read())
    if viewers.are_wanted:
        _write(viewing, viewers, as_json)
        return
    from tumble.bench.log.serving import serve

    def tell(address: str) -> None:
        # Here the token is to be read: it is the way in.
        if as_json:
            with drawing():
                print_event("serving", {"address": address}, keeps_secrets=True)
            return
        print(f"{viewing.title}: ", end="")
        with drawing():
            print(address)
        print("Ctrl-C ends it.", flush=True)

    serve(viewing, port, opens_browser=not no_browser, tell=tell)


def _write(viewing: Viewing, viewers: ViewerOptions, as_json: bool) -> None:
    from tumble.tools.view.viewer_content import content_of

    try:
        viewing.gather()
        files = viewers.write(lambda: content_of(viewing), quiet=as_json)
    finally:
        viewing.close()
    if as_json:
        print_event("written", {"files": {key: str(path) for key, path in files.items()}})
    else:
        list_files(files)


def _need_extra() -> None:
    """Raises `CommandError` where what the page needs is not installed."""
    for package in _NEEDED:
        if find_spec(package) is None:
            raise CommandError(
                f"the page needs the Python package {package}, which is not installed; "
                f"type: {install_command('bench')}"
            )
