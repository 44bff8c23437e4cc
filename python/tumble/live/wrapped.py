"""A live source around another one, which stays what it is in all that is not overridden."""

from __future__ import annotations

from types import TracebackType
from typing import Any, TypeVar

from tumble.live.source import Source

Wrapped = TypeVar("Wrapped", bound="WrappedSource")


class WrappedSource:
    """Opens and closes the source within, and has all that it has; a `Source` once it is iterated."""

    def __init__(self, source: Source) -> None:
        self._source = source

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever the source has
        return getattr(self._source, name)

    def __enter__(self: Wrapped) -> Wrapped:
        self._source.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._source.__exit__(kind, error, trace)
