"""A folder with one log a pose."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from tumble.foundation.errors import LogError
from tumble.foundation.log_formats import LOG_SUFFIXES, has_log_ending
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
        for path in sorted(folder.iterdir())
        if path.is_file() and has_log_ending(path) and not path.name.startswith(".")
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
    ignored = sorted(path.name for path in folder.iterdir() if path.is_file() and path not in files)
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
    return Recording(metadata, lambda: FolderStream(parts), parts)


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
                    shift = 0.0 if end is None or start > end else end + _PAUSE - start
                shifted = replace(chunk, time=chunk.time + shift) if shift else chunk
                end = float(shifted.time[-1])
                yield shifted
            if isinstance(stream, ChunkStream):
                self.counts.add(stream.counts)
