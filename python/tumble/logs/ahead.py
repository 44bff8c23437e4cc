"""Parts of a log, of which one is read while that before it is used."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import wait
from typing import TypeVar

from tumble.foundation.executors import unjoined_executor

Part = TypeVar("Part")


def ahead(parts: Iterator[Part]) -> Iterator[Part]:
    """Yields the same parts; the next one is read in a thread of its own, whose errors come out here."""
    with unjoined_executor(1) as thread:
        coming = thread.submit(next, parts, None)
        try:
            while (part := coming.result()) is not None:
                coming = thread.submit(next, parts, None)
                yield part
        finally:
            # The file is closed next, and a library may crash that reads on.
            if not coming.cancel():
                wait([coming])
