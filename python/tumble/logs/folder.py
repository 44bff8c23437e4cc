"""A folder with one log a pose."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import entries, is_file
from tumble.foundation.log_formats import LOG_SUFFIXES, has_log_ending
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, Recording
from tumble.foundation.words import count_of
from tumble.logs.checks import ChunkStream, Counts
from tumble.logs.formats import FOLDER

_PAUSE = 1.0
"""Seconds put between parts whose clocks all start anew."""


def log_files(folder: Path) -> list[Path]:
    """Finds the logs of a folder, in the order of their names.

    Raises `LogError` where there are none.
    """
    files = [
        path
        for path in entries(folder)
        if is_file(path) and has_log_ending(path) and not path.name.startswith(".")
    ]
    if not files:
        known = " ".join(sorted(LOG_SUFFIXES))
        raise LogError(f"{folder}: a folder without logs; expected one file per pose, named {known}")
    return files


def open_folder(folder: Path, open_part: Callable[[Path], Recording]) -> Recording:
    """Opens every log of a folder; the whole is the parts one after another.

    In `parts` each keeps its own clock.
    """
    files = log_files(folder)
    parts = tuple(open_part(path) for path in files)
    ignored = sorted(path.name for path in entries(folder) if is_file(path) and path not in files)
    notices = [f"{count_of('file', len(parts))}, read one after another"]
    if ignored:
        notices.append(f"left out {', '.join(ignored)}")
    metadata = replace(
        parts[0].metadata,
        name=folder.name,
        source=str(folder),
        format=FOLDER,
        clock="",
        alone=True,
        remarks=(*notices, *dict.fromkeys(notice for part in parts for notice in part.metadata.remarks)),
    )
    has_all = all(part.has_magnetometer for part in parts)
    read_magnetic = (lambda: _magnetic(parts)) if has_all else None
    return Recording(metadata, lambda: FolderStream(parts), parts, read_magnetic)


def _magnetic(parts: tuple[Recording, ...]) -> MagneticTrack:
    """Reads the magnetometer of all parts, each shifted in time as its samples are."""
    end: float | None = None
    tracks = []
    for part in parts:
        track = part.magnetic
        assert track is not None
        # A part that holds a magnetometer alone has no samples.
        edges = [time for chunk in part.chunks() for time in chunk.time[[0, -1]].tolist()]
        edges = edges or track.time[[0, -1]].tolist() if len(track) else edges
        if edges:
            shift = _shift_of(edges[0], end)
            end = edges[-1] + shift
            tracks.append(replace(track, time=track.time + shift))
    joined = MagneticTrack.joined(tracks)
    return joined if joined is not None else MagneticTrack(np.empty(0), np.empty((0, 3)))


def _shift_of(start: float, end: float | None) -> float:
    """Returns s by which a part that starts at a time is shifted, to begin after the end of the last."""
    return 0.0 if end is None or start > end else end + _PAUSE - start


class FolderStream(Iterator[Chunk]):
    """One pass over all parts, each shifted in time only as far as time would otherwise run backwards."""

    expected: int | None = None

    def __init__(self, parts: tuple[Recording, ...]) -> None:
        self.counts = Counts()
        self._chunks = self._one_after_another(parts)

    def __next__(self) -> Chunk:
        return next(self._chunks)

    def _one_after_another(self, parts: tuple[Recording, ...]) -> Iterator[Chunk]:
        end: float | None = None
        for part in parts:
            shift: float | None = None
            stream = part.chunks()
            for chunk in stream:
                if shift is None:
                    start = float(chunk.time[0])
                    shift = _shift_of(start, end)
                shifted = replace(chunk, time=chunk.time + shift) if shift else chunk
                end = float(shifted.time[-1])
                yield shifted
            if isinstance(stream, ChunkStream):
                self.counts.add(stream.counts)
