"""A live source that is read by one procedure after another, each from where the last one stopped."""

from __future__ import annotations

from collections.abc import Iterator

from tumble.live.source import LiveChunk, Source
from tumble.live.wrapped import WrappedSource


class ResumableSource(WrappedSource):
    """Whoever iterates it goes on where it was left."""

    def __init__(self, source: Source) -> None:
        super().__init__(source)
        self._chunks: Iterator[LiveChunk] | None = None

    def __iter__(self) -> Iterator[LiveChunk]:
        if self._chunks is None:
            self._chunks = iter(self._source)
        return self

    def __next__(self) -> LiveChunk:
        assert self._chunks is not None, "it is iterated before it is asked for more"
        return next(self._chunks)
