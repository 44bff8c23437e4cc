"""A live source that records what it gives, for procedures that read one."""

from __future__ import annotations

from collections.abc import Iterator
from types import TracebackType
from typing import Any

from tumble.live import LiveChunk, Source
from tumble.record.writer import SessionWriter


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
