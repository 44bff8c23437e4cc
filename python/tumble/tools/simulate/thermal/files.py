"""A simulated thermal session on disk: the log as any logger would write it, and the truth beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tumble.foundation.documents import write_document
from tumble.foundation.files import prepare_folder
from tumble.foundation.plain import plain
from tumble.foundation.recording import SampleProgress
from tumble.logs import Facts, open_writer
from tumble.tools.simulate.files import TRUTH, LogFormat, options
from tumble.tools.simulate.thermal.procedure import SimulatedThermal

_HEADER = """\
The truth of this simulated thermal session: drift of each triad as a calibration file keeps it, a row of x, y
and z for each power of the temperature minus the reference: SI units and K."""


def write_thermal(
    session: SimulatedThermal,
    directory: str | Path,
    format: LogFormat = "csv",  # noqa: A002
    progress: SampleProgress | None = None,
) -> dict[str, Path]:
    """Writes the log and `truth.yaml`, in constant memory; returns the path of each by what it is.

    Raises `OutputError` where the folder cannot be written to.
    """
    folder = prepare_folder(directory)
    paths = {"log": folder / f"thermal.{format}", "truth": folder / "truth.yaml"}
    done = 0
    with open_writer(paths["log"], format, Facts(serial=session.recording.metadata.serial)) as writer:
        for chunk in session.recording.chunks():
            writer.write(chunk)
            done += len(chunk)
            if progress is not None:
                progress(done, session.scenario.samples)
    content: dict[str, Any] = {
        "schema": TRUTH,
        "seed": session.scenario.seed,
        **session.truth,
        "lag": session.scenario.lag,
        "options": options(session.scenario),
    }
    write_document(paths["truth"], _HEADER, {key: plain(value) for key, value in content.items()})
    return paths
