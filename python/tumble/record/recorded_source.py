"""A live source that records what it gives, for procedures that read one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, cast

from tumble.file_names import file_stem
from tumble.live import LiveChunk, Source
from tumble.live.source import LOG_CLOCK
from tumble.logs.session import SessionClock
from tumble.record.writer import RecordedUnit, SessionWriter


@contextmanager
def recorded_source(source: Source, folder: Path | None, *, typed: str, serial: str) -> Iterator[Source]:
    """Give a source that records what it gives into `folder`, by its own clock; itself without a folder.

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


class RecordedSource:
    """Gives what a source gives, and records it under `name`; a `Source` in all else."""

    def __init__(self, source: Source, writer: SessionWriter, name: str) -> None:
        self._source = source
        self._writer = writer
        self._unit = name

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever the source has
        return getattr(self._source, name)

    def __enter__(self) -> RecordedSource:
        self._source.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._source.__exit__(kind, error, trace)

    def __iter__(self) -> Iterator[LiveChunk]:
        for chunk in self._source:
            if len(chunk):
                self._writer.take(self._unit, chunk)
            self._writer.flush()
            yield chunk
