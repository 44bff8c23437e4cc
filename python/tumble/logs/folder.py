"""A folder with one log a pose, or with the files into which one log was split."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
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
from tumble.logs.split_log import Files, split_logs

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

    In `parts` each keeps its own clock. Files into which one log was split are one part, or the whole, which
    then has no parts.
    """
    paths = log_files(folder)
    files = tuple(open_part(path) for path in paths)
    ignored = sorted(path.name for path in entries(folder) if is_file(path) and path not in paths)
    logs = split_logs(files)
    notices = [_on_files(files, logs)] if len(files) > 1 else []
    if ignored:
        notices.append(f"left out {', '.join(ignored)}")
    whole = _joined(files if len(logs) > 1 else logs[0], tuple(map(_log, logs)) if len(logs) > 1 else ())
    metadata = replace(
        whole.metadata,
        name=folder.name,
        source=str(folder),
        format=FOLDER,
        clock="",
        alone=True,
        remarks=(*notices, *whole.metadata.remarks),
    )
    return replace(whole, metadata=metadata)


def _on_files(files: Files, logs: Sequence[Files]) -> str:
    """Describes how the files of a folder are read."""
    seen = count_of("file", len(files))
    if len(logs) == len(files):
        return f"{seen}, read one after another"
    if len(logs) == 1:
        return f"{seen}, read as one log: the stamps of each follow on those of the one before"
    return (
        f"{seen}, read as {count_of('log', len(logs))} one after another: stamps follow on from file to file "
        "within each"
    )


def _log(files: Files) -> Recording:
    """Returns a log that was split into files, or the one file that is a log."""
    return files[0] if len(files) == 1 else _joined(files)


def _joined(files: Files, parts: Files = ()) -> Recording:
    """Returns files one after another, under the name of the first."""
    remarks = dict.fromkeys(remark for file in files for remark in file.metadata.remarks)
    metadata = replace(files[0].metadata, remarks=tuple(remarks))
    has_all = all(file.has_magnetometer for file in files)
    read_magnetic = (lambda: _magnetic(files)) if has_all else None
    return Recording(metadata, lambda: FolderStream(files), parts, read_magnetic, files)


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


class FolderStream(ChunkStream):
    """One pass over all parts, each shifted in time only as far as time would otherwise run backwards."""

    def __init__(self, parts: tuple[Recording, ...]) -> None:
        self.counts, self.expected = Counts(), None
        self._chunks = self._one_after_another(parts)

    def _one_after_another(self, parts: tuple[Recording, ...]) -> Generator[Chunk, None, None]:
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
