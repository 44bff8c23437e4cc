"""A simulated session on disk: recordings as any logger would write them, poses and truth beside them."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from tumble.foundation.documents import write_document
from tumble.foundation.files import prepare_folder
from tumble.foundation.plain import plain
from tumble.logs import Facts
from tumble.logs.writer_with_field import open_writer_with_field
from tumble.tools.simulate.files import TRUTH, LogFormat, options, pieces, triad_content, without_none
from tumble.tools.simulate.turntable.procedure import SimulatedTurntable
from tumble.tools.simulate.unit import SimulatedUnit

_HEADER = """\
The truth of this simulated session. SI units, angles in rad unless a key ends in _deg; frames as in
docs/conventions.md. y = M u + b + G f, M = K L Q; u is the truth in the case frame of the reference."""


def write_turntable(
    session: SimulatedTurntable,
    directory: str | Path,
    format: LogFormat = "csv",  # noqa: A002
) -> dict[str, Path]:
    """Writes one log a unit, `poses.yaml` and `truth.yaml`; returns the path of each by what it is.

    Raises `OutputError` where the folder cannot be written to.
    """
    folder = prepare_folder(directory)
    paths: dict[str, Path] = {}
    for unit in session.units:
        paths[unit.name] = folder / f"{unit.name}.{format}"
        facts = Facts(serial=unit.recording.metadata.serial)
        with open_writer_with_field(paths[unit.name], format, facts, unit.recording.magnetic) as write:
            for chunk in pieces(unit.samples):
                write(chunk)
    paths["poses"] = folder / "poses.yaml"
    session.scenario.poses.save(paths["poses"])
    paths["truth"] = folder / "truth.yaml"
    write_document(paths["truth"], _HEADER, truth_content(session))
    return paths


def truth_content(session: SimulatedTurntable) -> dict[str, Any]:
    """Returns the truth as plain mappings, lists, numbers and text."""
    content: dict[str, Any] = {
        "schema": TRUTH,
        "seed": session.scenario.seed,
        "duration": session.duration,
        "R_e": session.R_e,
        "mounting_deg": np.degrees(session.mounting),
        "earth_rate_level": session.earth_rate,
        "gravity": session.scenario.gravity,
        "rests": [without_none(asdict(rest)) for rest in session.rests],
        "units": {unit.name: _unit(unit) for unit in session.units},
        "options": options(session.scenario),
    }
    return {key: plain(value) for key, value in content.items()}


def _unit(unit: SimulatedUnit) -> dict[str, Any]:
    return {
        "serial": unit.recording.metadata.serial,
        "grade": unit.grade.name,
        "accelerometer": triad_content(unit.accelerometer),
        "gyroscope": triad_content(unit.gyroscope),
        "clock": {"offset": unit.clock.offset, "skew_ppm": unit.clock.skew, "phase": unit.clock.phase},
        **({"magnetometer": asdict(unit.magnetometer)} if unit.magnetometer else {}),
        "faults": [without_none(asdict(fault)) for fault in unit.faults],
    }
