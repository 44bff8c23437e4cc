"""A simulated record at rest on disk: the log as any logger would write it, and the truth beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tumble.foundation.noise_terms import TERM_UNITS
from tumble.foundation.plain import plain
from tumble.foundation.recording import SampleProgress
from tumble.tools.simulate.files import TRUTH, LogFormat, options, write_record
from tumble.tools.simulate.static.procedure import SimulatedStatic

_HEADER = """\
The truth of this simulated record at rest: the coefficient of each term of its noise, alike for the three
axes of a triad: Q, N, B, K and R of docs/theory/noise.md, in their order."""


def write_static(
    static: SimulatedStatic,
    directory: str | Path,
    format: LogFormat = "csv",  # noqa: A002
    name: str = "static",
    progress: SampleProgress | None = None,
) -> dict[str, Path]:
    """Writes the log and `truth.yaml`, in constant memory; returns the path of each by what it is.

    Raises `OutputError` where the folder cannot be written to.
    """
    return write_record(
        static.recording,
        static.scenario.samples,
        directory,
        name,
        format,
        _HEADER,
        static_truth(static),
        progress,
    )


def static_truth(static: SimulatedStatic) -> dict[str, Any]:
    """Returns the truth as plain mappings, lists, numbers and text."""
    content: dict[str, Any] = {
        "schema": TRUTH,
        "seed": static.scenario.seed,
        **static.truth,
        "units": {triad: dict(units) for triad, units in TERM_UNITS.items()},
        "gaps": static.scenario.gaps,
        "options": options(static.scenario),
    }
    return {key: plain(value) for key, value in content.items()}
