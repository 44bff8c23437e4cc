"""The files of one unit while it is recorded: small ones soon on disk, joined into larger ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tumble.foundation.file_status import exists, is_file
from tumble.foundation.files import prepare_inner_folder, remove_folder, remove_made, replacing
from tumble.foundation.magnetic import MAGNETIC_CHANNELS
from tumble.foundation.recording import Chunk, FloatArray
from tumble.live import LiveChunk
from tumble.logs import Facts, open_writer
from tumble.logs.session import LAST_PART, joined_file, last_part, numbers_of, parts_folder, unit_files
from tumble.logs.writer_tables import join_parquet
from tumble.logs.writers import FORMATS

JOINED = 60
"""Parts of a kind that are joined into one: a day of parts of 1 s makes some hundred files."""
OPTIONAL = ("temperature", "moving", "field")
"""Columns that only some units have."""
COLUMN_OF = {"field": MAGNETIC_CHANNELS[0]}
"""Column by which a file shows that it has one of another name."""


@dataclass(frozen=True, slots=True)
class RecordedChunk(Chunk):
    """Samples as they are recorded, with all that is known of them."""

    sensor_time: FloatArray | None = None
    """(n,) s of the sensor's own clock."""
    arrival: FloatArray | None = None
    """(n,) s by the clock of `time` at which each came; NaN for a log that was read as fast as it can be."""
    moving: FloatArray | None = None
    """(n,) whether wheels turn, as in `LiveChunk`."""
    field: FloatArray | None = None
    """(n, 3) uT of a magnetometer, as in `LiveChunk`."""

    @property
    def mx(self) -> FloatArray:
        """(n,) uT."""
        return self._axis(0)

    @property
    def my(self) -> FloatArray:
        """(n,) uT."""
        return self._axis(1)

    @property
    def mz(self) -> FloatArray:
        """(n,) uT."""
        return self._axis(2)

    def _axis(self, axis: int) -> FloatArray:
        return np.full(len(self), np.nan) if self.field is None else self.field[:, axis]

    @property
    def further(self) -> tuple[str, ...]:
        """Names of columns that logs do not have."""
        own = ("sensor_time", "arrival", "moving")
        magnetic = MAGNETIC_CHANNELS if self.field is not None else ()
        return (*(name for name in own if getattr(self, name) is not None), *magnetic)


def optional_columns(chunk: LiveChunk) -> tuple[str, ...]:
    """Returns those of `OPTIONAL` that a unit has, by its first samples."""
    return tuple(name for name in OPTIONAL if getattr(chunk, name) is not None)


def recorded(chunks: Sequence[LiveChunk], optional: Sequence[str], shift: float) -> RecordedChunk:
    """Puts samples in one piece, with those of the optional columns, all times later by `shift`, s."""

    def joined(name: str) -> FloatArray | None:
        if name not in optional:
            return None
        unknown = (
            np.full((len(chunk), 3), np.nan) if name == "field" else _all(chunk, np.nan) for chunk in chunks
        )
        return np.concatenate(
            [
                nan if (column := getattr(chunk, name)) is None else column
                for chunk, nan in zip(chunks, unknown, strict=True)
            ]
        )

    return RecordedChunk(
        np.concatenate([chunk.time for chunk in chunks]) + shift,
        np.concatenate([chunk.accelerometer for chunk in chunks]),
        np.concatenate([chunk.gyroscope for chunk in chunks]),
        joined("temperature"),
        np.concatenate([chunk.time if chunk.sensor_time is None else chunk.sensor_time for chunk in chunks]),
        np.concatenate([_all(chunk, np.nan if chunk.arrival is None else chunk.arrival) for chunk in chunks])
        + shift,
        joined("moving"),
        joined("field"),
    )


def _all(chunk: LiveChunk, value: float) -> FloatArray:
    return np.full(len(chunk), value)


class UnitParts:
    """Writes the parts of one unit, and joins them."""

    def __init__(self, folder: Path, name: str, facts: Facts) -> None:
        self.name = name
        self._folder = folder
        self._parts_folder = parts_folder(folder, name)
        self._facts = facts
        self._parts = [
            numbers for file in unit_files(folder, name) if (numbers := numbers_of(file)) is not None
        ]
        there = [numbers[1] for file in self._parts_folder.glob("*") if (numbers := numbers_of(file))]
        self._last = max([_last_joined(folder, name), *there])
        """Number of the newest part there ever was."""

    @property
    def size(self) -> int:
        """Bytes on disk."""
        return sum(file.stat().st_size for file in unit_files(self._folder, self.name))

    def write(self, chunk: RecordedChunk) -> None:
        """Writes samples to disk; raises `OutputError` where that cannot be done."""
        if not exists(self._parts_folder):
            prepare_inner_folder(self._parts_folder)
        self._last += 1
        numbers = self._last, self._last
        facts = replace(self._facts, further=chunk.further)
        with open_writer(self._path(numbers), "parquet", facts, durable=True) as writer:
            writer.write(chunk)
        self._parts.append(numbers)
        self._join_some()

    def finish(self) -> None:
        """Joins all there is into one file; raises `OutputError` where that cannot be done."""
        files = unit_files(self._folder, self.name)
        whole = joined_file(self._folder, self.name)
        if files and files != [whole]:
            with replacing(whole, FORMATS["parquet"], renews=True, durable=True) as joined:
                join_parquet(files, joined, {LAST_PART: str(self._last)})
        remove_folder(self._parts_folder, FORMATS["parquet"])
        self._parts = []

    def _join_some(self) -> None:
        """Joins the last parts as soon as there are enough of one length."""
        length = 1
        while len(tail := self._tail(length)) >= JOINED:
            together = tail[0][0], tail[-1][1]
            paths = [self._path(numbers) for numbers in tail]
            with replacing(self._path(together), FORMATS["parquet"], durable=True) as joined:
                join_parquet(paths, joined, {})
            # Whoever reads from now on knows by its name that the new one holds these.
            remove_made(*paths, kind=FORMATS["parquet"])
            self._parts[-len(tail) :] = [together]
            length *= JOINED

    def _tail(self, length: int) -> list[tuple[int, int]]:
        tail: list[tuple[int, int]] = []
        for first, last in reversed(self._parts):
            if last - first + 1 != length:
                break
            tail.insert(0, (first, last))
        return tail

    def _path(self, numbers: tuple[int, int]) -> Path:
        first, last = numbers
        name = f"{first:06d}" if first == last else f"{first:06d}-{last:06d}"
        return self._parts_folder / f"{name}.parquet"


def _last_joined(folder: Path, name: str) -> int:
    whole = joined_file(folder, name)
    return last_part(whole) if is_file(whole) else 0
