"""A simulated spin on disk: the log as any logger would write it, and the truth beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tumble.foundation.documents import write_document
from tumble.foundation.files import prepare_folder
from tumble.foundation.plain import plain
from tumble.logs import Facts, open_writer
from tumble.tools.simulate.files import TRUTH, LogFormat, options, pieces, triad_content
from tumble.tools.simulate.spin.procedure import SimulatedSpin

_HEADER = """\
The truth of this simulated spin. SI units, angles in rad unless a key ends in _deg; frames as in
docs/conventions.md. y = M u + b, u in the case frame of the IMU; bias is the mean over the recording."""


def write_spin(
    spin: SimulatedSpin,
    directory: str | Path,
    format: LogFormat = "csv",  # noqa: A002
    name: str = "spin",
) -> dict[str, Path]:
    """Writes the log and `truth.yaml`; returns the path of each by what it is.

    Raises `OutputError` where the folder cannot be written to.
    """
    folder = prepare_folder(directory)
    paths = {"log": folder / f"{name}.{format}", "truth": folder / "truth.yaml"}
    with open_writer(paths["log"], format, Facts(serial=spin.recording.metadata.serial)) as writer:
        for chunk in pieces(spin.samples):
            writer.write(chunk)
    write_document(paths["truth"], _HEADER, spin_truth(spin))
    return paths


def spin_truth(spin: SimulatedSpin) -> dict[str, Any]:
    """Returns the truth as plain mappings, lists, numbers and text."""
    scenario = spin.scenario
    content: dict[str, Any] = {
        "schema": TRUTH,
        "seed": scenario.seed,
        "accelerometer_bias": spin.accelerometer_bias,
        "gyroscope_bias": spin.gyroscope_bias,
        "up": spin.up,
        "roll_deg": float(np.degrees(spin.roll)),
        "pitch_deg": float(np.degrees(spin.pitch)),
        "floor_tilt_deg": scenario.floor_tilt_deg,
        "uphill_bearing_deg": float(np.degrees(spin.uphill_bearing)),
        "lever_arm": spin.lever_arm,
        "gyroscope_scale": scenario.gyroscope_scale,
        "gravity": scenario.gravity,
        "rests": spin.rests,
        "turns": spin.turns,
        "turned": spin.turned,
        "accelerometer": triad_content(spin.accelerometer),
        "gyroscope": triad_content(spin.gyroscope),
        "options": options(scenario),
    }
    return {key: plain(value) for key, value in content.items()}
