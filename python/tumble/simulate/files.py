"""A simulated session on disk: recordings as any logger would write them, poses and truth beside them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tumble.documents import write_document
from tumble.files import prepare_folder
from tumble.logs import Facts, open_writer
from tumble.plain import plain
from tumble.recording import Chunk
from tumble.simulate.session import SimulatedTurntable, SimulatedUnit, TriadTruth
from tumble.turntable.poses import PoseList

LogFormat = Literal["csv", "parquet", "mcap"]

ROWS = 65_536
"""Samples written at a time."""

_HEADER = """\
The truth of this simulated session. SI units, angles in rad unless a key ends in _deg; frames as in
docs/conventions.md. y = M u + b + G f, M = K L Q; u is the truth in the case frame of the reference."""


def write_turntable(
    session: SimulatedTurntable,
    directory: str | Path,
    format: LogFormat = "csv",  # noqa: A002
) -> dict[str, Path]:
    """Write one log a unit, `poses.yaml` and `truth.yaml`; give the path of each by what it is.

    Raises `OutputError` where the folder cannot be written to.
    """
    folder = prepare_folder(directory)
    paths: dict[str, Path] = {}
    for unit in session.units:
        paths[unit.name] = folder / f"{unit.name}.{format}"
        with open_writer(paths[unit.name], format, Facts(serial=unit.recording.metadata.serial)) as writer:
            for chunk in pieces(unit.samples):
                writer.write(chunk)
    paths["poses"] = folder / "poses.yaml"
    session.scenario.poses.save(paths["poses"])
    paths["truth"] = folder / "truth.yaml"
    write_document(paths["truth"], _HEADER, truth_content(session))
    return paths


def truth_content(session: SimulatedTurntable) -> dict[str, Any]:
    """Give the truth as plain mappings, lists, numbers and text."""
    content: dict[str, Any] = {
        "seed": session.scenario.seed,
        "duration": session.duration,
        "R_e": session.R_e,
        "mounting_deg": np.degrees(session.mounting),
        "earth_rate_level": session.earth_rate,
        "gravity": session.scenario.gravity,
        "rests": [without_none(asdict(rest)) for rest in session.rests],
        "units": {unit.name: _unit(unit) for unit in session.units},
        "options": _options(session),
    }
    return {key: plain(value) for key, value in content.items()}


def pieces(samples: Chunk) -> Iterator[Chunk]:
    """Cut samples to what is written at a time."""
    for start in range(0, len(samples), ROWS):
        yield cut(samples, slice(start, start + ROWS))


def cut(samples: Chunk, rows: slice) -> Chunk:
    """Give some of the samples."""
    temperature = None if samples.temperature is None else samples.temperature[rows]
    return Chunk(samples.time[rows], samples.accelerometer[rows], samples.gyroscope[rows], temperature)


def _unit(unit: SimulatedUnit) -> dict[str, Any]:
    return {
        "serial": unit.recording.metadata.serial,
        "grade": unit.grade.name,
        "accelerometer": triad_content(unit.accelerometer),
        "gyroscope": triad_content(unit.gyroscope),
        "clock": {"offset": unit.clock.offset, "skew_ppm": unit.clock.skew, "phase": unit.clock.phase},
        "faults": [without_none(asdict(fault)) for fault in unit.faults],
    }


def triad_content(triad: TriadTruth) -> dict[str, Any]:
    """Give the truth of a triad as plain figures, angles in deg beside those in rad."""
    figures = {field.name: getattr(triad, field.name) for field in fields(triad)}
    angles = {
        "non_orthogonality_deg": np.degrees(triad.non_orthogonality),
        "mounting_deg": np.degrees(triad.mounting),
    }
    return figures | angles


def _options(session: SimulatedTurntable) -> dict[str, Any]:
    scenario = session.scenario
    return {field.name: in_plain_words(getattr(scenario, field.name)) for field in fields(scenario)}


def in_plain_words(value: object) -> object:
    """Give an option as mappings, lists, numbers and text."""
    if isinstance(value, PoseList):
        return {pose.name: pose.up for pose in value}
    if is_dataclass(value) and not isinstance(value, type):
        return without_none(asdict(value))
    if isinstance(value, Mapping):
        return {key: in_plain_words(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [in_plain_words(item) for item in value]
    return value


def without_none(content: Mapping[str, Any]) -> dict[str, Any]:
    """Leave out what was not given."""
    return {key: value for key, value in content.items() if value is not None}
