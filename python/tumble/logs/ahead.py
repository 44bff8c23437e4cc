"""Parts of a log, of which one is read while that before it is used."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

from tumble.foundation.executors import unjoined_executor

Part = TypeVar("Part")


def ahead(parts: Iterator[Part]) -> Iterator[Part]:
    """Yields the same parts; the next one is read in a thread of its own, whose errors come out here."""
    with unjoined_executor(1) as thread:
        coming = thread.submit(next, parts, None)
        while (part := coming.result()) is not None:
            coming = thread.submit(next, parts, None)
            yield part
