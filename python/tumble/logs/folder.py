"""A folder with one log a pose."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from tumble.errors import LogError
from tumble.logs.formats import LOG_SUFFIXES
from tumble.recording import Chunk, Recording

_PAUSE = 1.0
"""Seconds put between parts whose clocks all start anew."""


def log_files(folder: Path) -> list[Path]:
    """Find the logs of a folder, in the order of their names.

    Raises `LogError` where there are none.
    """
    files = [
        path
        for path in sorted(folder.iterdir())
        if path.is_file() and path.suffix.lower() in LOG_SUFFIXES and not path.name.startswith(".")
    ]
    if not files:
        known = " ".join(sorted(LOG_SUFFIXES))
        raise LogError(f"{folder}: a folder without logs; expected one file a pose, named {known}")
    return files


def open_folder(folder: Path, open_part: Callable[[Path], Recording]) -> Recording:
    """Open every log of a folder; the whole is the parts one after another.

    In `parts` each keeps its own clock.
    """
    files = log_files(folder)
    parts = tuple(open_part(path) for path in files)
    first = parts[0].metadata
    ignored = sorted(path.name for path in folder.iterdir() if path.is_file() and path not in files)
    remarks = [f"{len(parts)} files, read one after another"]
    if ignored:
        remarks.append(f"passed over {', '.join(ignored)}")
    metadata = replace(
        first,
        name=folder.name,
        source=str(folder),
        format="folder",
        clock="",
        remarks=(*remarks, *dict.fromkeys(remark for part in parts for remark in part.metadata.remarks)),
    )
    return Recording(metadata, lambda: _one_after_another(parts), parts)


def _one_after_another(parts: tuple[Recording, ...]) -> Iterator[Chunk]:
    """Shift a part only as far as time would otherwise run backwards."""
    end: float | None = None
    for part in parts:
        shift: float | None = None
        for chunk in part.chunks():
            if shift is None:
                start = float(chunk.time[0])
                shift = 0.0 if end is None or start > end else end + _PAUSE - start
            chunk = replace(chunk, time=chunk.time + shift) if shift else chunk
            end = float(chunk.time[-1])
            yield chunk
