"""`tumble apply --live`: samples come in, and go on corrected."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

from tumble.cli.live_screen import print_listening
from tumble.foundation.words import count_of

if TYPE_CHECKING:
    from tumble.calibration.document import Calibration
    from tumble.foundation.log_reading import LogReading
    from tumble.live import Source
    from tumble.live.outputs import Output
    from tumble.logs.options import ReadOptions


def apply_source(
    calibration: Path,
    source: str,
    to: str,
    read_options: ReadOptions,
    *,
    sender: str | None,
    force: bool,
    as_json: bool,
) -> None:
    """Corrects what comes from `source` until it ends, or Control-C; raises `TumbleError` as `apply` does."""
    from tumble.calibration.document import Calibration
    from tumble.live import open_source
    from tumble.live.outputs import parse_output

    found = Calibration.load(calibration)
    output = parse_output(to, as_json=as_json)
    stream = open_source(source, read_options, sender=sender)
    with stream:
        correct(
            found,
            stream,
            output,
            serial=read_options.serial,
            reading=read_options.reading,
            force=force,
            as_json=as_json,
        )


def correct(
    calibration: Calibration,
    source: Source,
    output: Output,
    *,
    serial: str = "",
    reading: LogReading | None = None,
    force: bool = False,
    as_json: bool = False,
) -> None:
    """Corrects until the source ends, or a signal comes, and reports on standard error.

    With `as_json` the event `listening` is printed on standard output, or on standard error where samples go
    to standard output.
    """
    from tumble.foundation.ending import stopped_by_signals
    from tumble.live.outputs import STDOUT
    from tumble.tools.apply.live import LiveApply

    live = LiveApply(calibration, source, output, serial=serial, reading=reading, force=force)
    over = Event()
    with stopped_by_signals(over.set):
        print(f"Correcting {source.name} to {output.name}. Ctrl-C ends.", file=sys.stderr, flush=True)
        if as_json:
            with redirect_stdout(sys.stderr if output.name == STDOUT else sys.stdout):
                print_listening([source.name])
        applied = live.run(over.is_set)
    for warning in applied.warnings:
        print(f"tumble: warning: {warning}", file=sys.stderr)
    delays = applied.delays
    half, most = (f"{1e3 * delays.quantile(share):.2g} ms" for share in (0.5, 0.99))
    late = f", {half} after they came (99 % within {most})" if delays.largest else ""
    print(f"{count_of('sample', applied.samples)} corrected: {output.name}{late}", file=sys.stderr)
