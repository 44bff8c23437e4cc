"""A simulated multi-pose session on disk: the log as any logger would write it, and the truth beside it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from tumble.foundation.documents import write_document
from tumble.foundation.files import BY_TUMBLE, HEAD_OF_OURS, FileKind, prepare_folder, write_text
from tumble.foundation.plain import plain
from tumble.logs import Facts, open_writer
from tumble.tools.simulate.files import TRUTH, LogFormat, pieces, triad_content
from tumble.tools.simulate.multipose.procedure import SimulatedMultipose

SECTIONS = FileKind("a section list", re.compile(rb"\A#[^\n]*\nlabel,start,end\r?\n"), BY_TUMBLE)
_HEADER = """\
The truth of this simulated session. SI units, angles in rad unless a key ends in _deg; frames as in
docs/conventions.md. y = M u + b + G f. own_axes is M in the frame of the accelerometer's own axes, faces
that in the frame of the box whose faces were laid down."""


def write_multipose(
    found: SimulatedMultipose,
    directory: str | Path,
    format: LogFormat = "csv",  # noqa: A002
) -> dict[str, Path]:
    """Writes the log, `truth.yaml` and, of six faces, `sections.csv`; returns the path of each by what it is.

    Raises `OutputError` where the folder cannot be written to.
    """
    folder = prepare_folder(directory)
    unit = found.unit
    paths = {"log": folder / f"multipose.{format}", "truth": folder / "truth.yaml"}
    with open_writer(paths["log"], format, Facts(serial=unit.recording.metadata.serial)) as writer:
        for chunk in pieces(unit.samples):
            writer.write(chunk)
    write_document(paths["truth"], _HEADER, multipose_truth(found))
    if found.on_faces:
        paths["sections"] = folder / "sections.csv"
        rows = [("label", "start", "end"), *found.sections]
        text = "".join([f"{HEAD_OF_OURS}\n", *(f"{label},{start},{end}\n" for label, start, end in rows)])
        write_text(paths["sections"], text, SECTIONS)
    return paths


def multipose_truth(found: SimulatedMultipose) -> dict[str, Any]:
    """Returns the truth as plain mappings, lists, numbers and text."""
    unit = found.unit
    content: dict[str, Any] = {
        "schema": TRUTH,
        "seed": found.session.scenario.seed,
        "gravity": found.session.scenario.gravity,
        "duration": found.session.duration,
        "grade": unit.grade.name,
        "faces" if found.on_faces else "own_axes": {
            "accelerometer": found.force_matrix,
            "gyroscope": found.rate_matrix,
        },
        "accelerometer": triad_content(unit.accelerometer),
        "gyroscope": triad_content(unit.gyroscope),
    }
    return {key: plain(value) for key, value in content.items()}
