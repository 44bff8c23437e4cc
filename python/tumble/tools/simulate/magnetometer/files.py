"""A simulated session of a magnetometer on disk: the log as any logger would write it, and its truth."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from tumble.foundation.documents import write_document
from tumble.foundation.files import BY_TUMBLE, HEAD_OF_OURS, FileKind, prepare_folder, write_text
from tumble.foundation.plain import plain
from tumble.tools.simulate.files import TRUTH
from tumble.tools.simulate.magnetometer.procedure import SimulatedMagnetometer

LOG = FileKind("a simulated log", re.compile(rb"\A#[^\n]*\ntime_s,"), BY_TUMBLE)
_HEADER = """\
The truth of this simulated session, in the case frame of the accelerometer's own axes: y = M u + b + c I, in
uT and A; the dip of the field in deg, positive down."""
_COLUMNS = ("time_s", "ax_m/s^2", "ay_m/s^2", "az_m/s^2", "gx_rad/s", "gy_rad/s", "gz_rad/s")
_MAGNETIC = ("mx_uT", "my_uT", "mz_uT")


def write_magnetometer(found: SimulatedMagnetometer, directory: str | Path) -> dict[str, Path]:
    """Writes the log and `truth.yaml`; returns the path of each by what it is.

    Raises `OutputError` where the folder cannot be written to.
    """
    folder = prepare_folder(directory)
    paths = {"log": folder / "magnetometer.csv", "truth": folder / "truth.yaml"}
    samples, track = found.samples, found.track
    table = np.column_stack([samples.time, samples.accelerometer, samples.gyroscope, track.field])
    names = [*_COLUMNS, *_MAGNETIC]
    if track.current is not None:
        table, names = np.column_stack([table, track.current]), [*names, "current_A"]
    rows = (",".join(f"{value:.9g}" for value in row) for row in table)
    write_text(paths["log"], "\n".join([HEAD_OF_OURS, ",".join(names), *rows, ""]), LOG)
    write_document(paths["truth"], _HEADER, magnetometer_truth(found))
    return paths


def magnetometer_truth(found: SimulatedMagnetometer) -> dict[str, Any]:
    """Returns the truth as plain mappings, lists, numbers and text."""
    scenario = found.scenario
    M, b = found.model
    force_M, force_b = found.force_model
    content = {
        "schema": TRUTH,
        "seed": scenario.seed,
        "field": scenario.strength,
        "dip": scenario.dip,
        "magnetometer": {"M": M, "b": b, "current": found.response},
        "accelerometer": {"M": force_M, "b": force_b},
    }
    return {key: plain(value) for key, value in content.items()}
