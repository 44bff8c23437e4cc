"""A live source that is read by one procedure after another, each from where the last one stopped."""

from __future__ import annotations

from collections.abc import Iterator
from types import TracebackType
from typing import Any

from tumble.live.source import LiveChunk, Source


class ContinuedSource:
    """Whoever iterates it goes on where it was left; a `Source` in all else."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._chunks: Iterator[LiveChunk] | None = None

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever the source has
        return getattr(self._source, name)

    def __enter__(self) -> ContinuedSource:
        self._source.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._source.__exit__(kind, error, trace)

    def __iter__(self) -> Iterator[LiveChunk]:
        if self._chunks is None:
            self._chunks = iter(self._source)
        return self

    def __next__(self) -> LiveChunk:
        assert self._chunks is not None, "it is iterated before it is asked for more"
        return next(self._chunks)
