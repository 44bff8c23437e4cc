"""Bounds of what a page of recordings keeps and has computed, however often anybody clicks."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TypeVar

from nicegui import run
from nicegui.element import Element

Found = TypeVar("Found")

MOST_KEPT = 8
"""Curves, and verdicts, that a page keeps; each takes a quarter of a megabyte."""


def keep_newest(place: Element) -> None:
    """Deletes the oldest children of an element, so that `MOST_KEPT` are left."""
    for child in place.default_slot.children[:-MOST_KEPT]:
        child.delete()


class Turn:
    """Computes one thing at a time for all pages: others wait, and the run keeps its time."""

    def __init__(self) -> None:
        self._lock = asyncio.Lock()

    async def computed(self, compute: Callable[[], Found], is_wanted: Callable[[], bool]) -> Found | None:
        """Returns what was computed; None where nobody wanted it any more, or the server ends."""
        async with self._lock:
            return await run.io_bound(compute) if is_wanted() else None


class WatchedElement(Element):
    """An element that calls `on_end` once it is deleted, alone or with its page."""

    def __init__(self, tag: str, on_end: Callable[[], None]) -> None:
        super().__init__(tag)
        self._on_end = on_end

    def _handle_delete(self) -> None:
        self._on_end()
        super()._handle_delete()
