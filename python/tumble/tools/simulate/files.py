"""Common files of all simulated recordings: samples in pieces, and the truth as text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tumble.foundation.documents import write_document
from tumble.foundation.files import prepare_folder
from tumble.foundation.plain import plain
from tumble.foundation.recording import Chunk, Recording, SampleProgress
from tumble.logs import Facts, open_writer
from tumble.poses.pose_list import PoseList
from tumble.tools.simulate.unit import TriadTruth

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

LogFormat = Literal["csv", "parquet", "mcap"]

TRUTH = "tumble-truth/1"
"""Schema of the truth of a simulation."""

ROWS = 65_536
"""Samples written at a time."""


def write_record(
    recording: Recording,
    samples: int,
    directory: str | Path,
    name: str,
    log_format: LogFormat,
    header: str,
    truth: Mapping[str, Any],
    progress: SampleProgress | None,
) -> dict[str, Path]:
    """Writes a log and `truth.yaml`, in constant memory; returns the path of each by what it is.

    Raises `OutputError` where the folder cannot be written to.
    """
    folder = prepare_folder(directory)
    paths = {"log": folder / f"{name}.{log_format}", "truth": folder / "truth.yaml"}
    done = 0
    with open_writer(paths["log"], log_format, Facts(serial=recording.metadata.serial)) as writer:
        for chunk in recording.chunks():
            writer.write(chunk)
            done += len(chunk)
            if progress is not None:
                progress(done, samples)
    write_document(paths["truth"], header, {key: plain(value) for key, value in truth.items()})
    return paths


def pieces(samples: Chunk) -> Iterator[Chunk]:
    """Cuts samples to what is written at a time."""
    for start in range(0, len(samples), ROWS):
        yield cut(samples, slice(start, start + ROWS))


def cut(samples: Chunk, rows: slice) -> Chunk:
    """Returns some of the samples."""
    temperature = None if samples.temperature is None else samples.temperature[rows]
    return Chunk(samples.time[rows], samples.accelerometer[rows], samples.gyroscope[rows], temperature)


def triad_content(triad: TriadTruth) -> dict[str, Any]:
    """Returns the truth of a triad as plain figures, angles in deg beside those in rad."""
    figures = {field.name: getattr(triad, field.name) for field in fields(triad)}
    angles = {
        "non_orthogonality_deg": np.degrees(triad.non_orthogonality),
        "mounting_deg": np.degrees(triad.mounting),
    }
    return figures | angles


def options(scenario: DataclassInstance) -> dict[str, object]:
    """Returns all fields of a scenario."""
    return {each.name: in_plain_words(getattr(scenario, each.name)) for each in fields(scenario)}


def in_plain_words(value: object) -> object:
    """Returns an option as mappings, lists, numbers and text."""
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
    """Omits fields that were not given."""
    return {key: value for key, value in content.items() if value is not None}
