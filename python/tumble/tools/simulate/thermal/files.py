"""A simulated thermal session on disk: the log as any logger would write it, and the truth beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tumble.foundation.recording import SampleProgress
from tumble.tools.simulate.files import TRUTH, LogFormat, options, write_record
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
    truth: dict[str, Any] = {
        "schema": TRUTH,
        "seed": session.scenario.seed,
        **session.truth,
        "lag": session.scenario.lag,
        "options": options(session.scenario),
    }
    return write_record(
        session.recording, session.scenario.samples, directory, "thermal", format, _HEADER, truth, progress
    )
