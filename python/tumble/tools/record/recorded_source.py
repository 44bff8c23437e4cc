"""A live source that records what it gives, for procedures that read one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import cast

from tumble.foundation.file_names import file_stem
from tumble.live import LiveChunk, Source
from tumble.live.source import LOG_CLOCK
from tumble.live.wrapped import WrappedSource
from tumble.logs.session import SessionClock
from tumble.tools.record.writer import RecordedUnit, SessionWriter


@contextmanager
def recorded_source(source: Source, folder: Path | None, *, typed: str, serial: str) -> Iterator[Source]:
    """Returns a source that records what it gives into `folder`, by its own clock; itself without a folder.

    Raises the errors of `SessionWriter`.
    """
    if folder is None:
        yield source
        return
    name = file_stem(source.name)
    clock: SessionClock = "log" if getattr(source, "clock", "") == LOG_CLOCK else "sensor"
    with SessionWriter(folder, {name: RecordedUnit(source, typed, serial)}, clock) as writer:
        yield cast("Source", RecordedSource(source, writer, name))
        writer.finish("done")


class RecordedSource(WrappedSource):
    """Gives what a source gives, and records it under `name`."""

    def __init__(self, source: Source, writer: SessionWriter, name: str) -> None:
        super().__init__(source)
        self._writer = writer
        self._unit = name

    def __iter__(self) -> Iterator[LiveChunk]:
        for chunk in self._source:
            if len(chunk):
                self._writer.take(self._unit, chunk)
            self._writer.flush()
            yield chunk
