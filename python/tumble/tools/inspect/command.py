"""`tumble inspect`: what logs hold, how good they are, and what they can serve."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Final

import typer

from tumble.cli.exit_code import ExitCode
from tumble.cli.read_options import ReadingOptions
from tumble.cli.screen import print_document, result_console
from tumble.cli.shared_options import JsonOption
from tumble.foundation.errors import TumbleError
from tumble.foundation.words import plain
from tumble.logs.options import ReadOptions

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.table import Table

    from tumble.tools.inspect.result import Inspection


INSPECTION: Final = "tumble-inspection/1"


def inspect_command(
    logs: Annotated[
        list[str],
        typer.Argument(metavar="LOG...", help="Logs: LOG for all IMUs of a file, LOG:NAME for one of them."),
    ],
    as_json: JsonOption = False,
    *,
    reading: ReadingOptions,
) -> None:
    """Show what logs hold and which procedures they are fit for.

    Example: tumble inspect drive.bag:/imu/data

    Shows rate, jitter, gaps and units, each channel, rests, and the procedures each log can serve.

    A log that cannot be read does not stop the others; the exit code is then 2.
    """
    read = reading.read()
    inspections, failed = [], []
    for source in logs:
        try:
            for inspection in _inspect(source, read):
                inspections.append(inspection)
                if not as_json:
                    _show(inspection)
        except TumbleError as error:
            failed.append({"log": source, "reason": str(error)})
            print(f"tumble: error: {error}", file=sys.stderr)
    if as_json:
        content = {"logs": [inspection.content() for inspection in inspections], "not_read": failed}
        print_document(INSPECTION, "partly read" if failed else "read", content)
    if failed:
        raise typer.Exit(ExitCode.USER_ERROR)


def _inspect(source: str, options: ReadOptions) -> Iterator[Inspection]:
    """Inspects the IMU that is named, or all IMUs of the file."""
    from tumble.cli.progress import sample_progress
    from tumble.logs import list_imus, open_recording, parse_spec
    from tumble.tools.inspect.procedure import inspect

    spec = parse_spec(source)
    wanted = spec.imu or options.topic
    imus = (wanted,) if wanted else list_imus(spec.path, options)
    for imu in imus:
        recording = open_recording(f"{spec.path}:{imu}" if imu and not options.topic else spec.path, options)
        with sample_progress(f"reading {recording.name}") as advance:
            yield inspect(recording, advance)


def _show(inspection: Inspection) -> None:
    from rich.text import Text

    from tumble.tools.inspect.result import head_lines, rest_lines, service_line

    console = result_console()

    def line(text: str, style: str = "") -> None:
        console.print(Text(f"  {text}", style), soft_wrap=True)

    console.print(Text(plain(inspection.metadata.source), "bold"), soft_wrap=True)
    for text in head_lines(inspection):
        line(text)
    console.print(_table(inspection))
    for text in rest_lines(inspection):
        line(text)
    for service in inspection.services:
        line(service_line(service), "green" if service.possible else "")
    for text in inspection.remarks:
        line(text, "yellow")
    console.print()


def _table(inspection: Inspection) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, caption="m/s^2 and rad/s; noise per sqrt(Hz)", caption_justify="left")
    table.add_column("channel", no_wrap=True)
    for title in ("low", "mean", "high", "step", "noise", "saturated"):
        table.add_column(title, justify="right", no_wrap=True)
    for channel in inspection.channels:
        table.add_row(
            channel.name + (" (stuck)" if channel.stuck else ""),
            f"{channel.low:.4g}",
            f"{channel.mean:.4g}",
            f"{channel.high:.4g}",
            "none" if channel.step is None else f"{channel.step:.3g}",
            f"{channel.noise_density:.3g}" if channel.noise_density > 0.0 else "",
            Text(str(channel.saturated) if channel.saturated else "", "yellow"),
        )
    return table
