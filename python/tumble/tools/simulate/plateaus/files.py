"""Simulated sessions over temperature on disk: a folder each, and the truth beside them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tumble.foundation.documents import write_document
from tumble.foundation.files import prepare_folder, prepare_inner_folder
from tumble.foundation.plain import plain
from tumble.logs import Facts
from tumble.logs.writer_with_field import open_writer_with_field
from tumble.tools.simulate.files import TRUTH, LogFormat, options, pieces
from tumble.tools.simulate.plateaus.procedure import SimulatedPlateaus

_HEADER = """\
The truth of these simulated sessions: M and b of the unit in each, SI units, in the order of the sessions.
y = M u + b; `options` has the powers of temperature from the reference."""


def write_plateaus(
    plateaus: SimulatedPlateaus,
    directory: str | Path,
    format: LogFormat = "csv",  # noqa: A002
) -> dict[str, Path]:
    """Writes a folder for each session and `truth.yaml`; returns the path of each by what it is.

    Raises `OutputError` where a folder cannot be written to.
    """
    folder = prepare_folder(directory)
    paths: dict[str, Path] = {}
    for number, session in enumerate(plateaus.sessions(), start=1):
        name = f"session_{number}"
        paths[name] = prepare_inner_folder(folder / name)
        for unit in session.units:
            facts = Facts(serial=unit.recording.metadata.serial)
            path = paths[name] / f"{unit.name}.{format}"
            with open_writer_with_field(path, format, facts, unit.recording.magnetic) as write:
                for chunk in pieces(unit.samples):
                    write(chunk)
    paths["truth"] = folder / "truth.yaml"
    write_document(paths["truth"], _HEADER, _truth(plateaus))
    return paths


def _truth(plateaus: SimulatedPlateaus) -> dict[str, Any]:
    scenario = plateaus.scenario
    content: dict[str, Any] = {
        "schema": TRUTH,
        "seed": scenario.seed,
        "reference": scenario.reference,
        "temperatures": scenario.temperatures,
        "options": options(scenario),
    }
    for triad in scenario.triads:
        found = [plateaus.triad_at(triad, session) for session in range(len(scenario.temperatures))]
        content[triad] = [{"M": matrix, "b": bias} for matrix, bias in found]
    return {key: plain(value) for key, value in content.items()}
