"""Rests in a hand that trembles, beside those before: one alone may be a slow turn about the vertical."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

import numpy as np

from tumble import _core
from tumble.foundation.recording import Chunk, FloatArray
from tumble.tools.record.procedure import SHORTEST_REST

MOST_KEPT = 24
"""Rests beside which one is seen; more cost time and add nothing."""
Span = tuple[float, float]
"""s, from the first sample to the last."""


class HeldRests:
    """Finds since when a unit is held still, by its newest samples and the rests that counted."""

    def __init__(self) -> None:
        self._kept: deque[Chunk] = deque(maxlen=MOST_KEPT)

    def keep(self, rest: Chunk) -> None:
        """Adds the samples of a rest that counts, later than all before."""
        self._kept.append(rest)

    def since(self, newest: Chunk) -> float:
        """Returns when the rest that ends the newest samples began, s; their end where none does."""
        after = self._kept[-1].time[-1] if self._kept else -np.inf
        beside = joined([*self._kept, during(newest, (np.nextafter(after, np.inf), np.inf))])
        end = float(newest.time[-1])
        began, ended = next(reversed(held_spans(beside)), (end, end))
        return began if end - ended < SHORTEST_REST else end


def held_spans(samples: Chunk) -> list[Span]:
    """Returns where a unit kept its mean orientation for `SHORTEST_REST` or longer, trembling or not."""
    spans = _core.held_rests(samples.time, samples.accelerometer, samples.gyroscope, SHORTEST_REST)
    return [(float(samples.time[first]), float(samples.time[last])) for first, last in spans]


def rests_by_hand(samples: Chunk, lying: FloatArray) -> list[Span]:
    """Returns all rests in order of time: those (n, 2), s, that are still, and those that tremble.

    The longer of two overlapping rests is returned.
    """
    still: list[Span] = [(float(start), float(end)) for start, end in lying]
    found: list[Span] = []
    for start, end in sorted([*still, *held_spans(samples)], key=lambda span: span[0] - span[1]):
        if all(end <= other[0] or start >= other[1] for other in found):
            found.append((start, end))
    return sorted(found)


def during(samples: Chunk, span: Span) -> Chunk:
    """Returns the samples of a span, its ends included."""
    first, end = np.searchsorted(samples.time, span[0]), np.searchsorted(samples.time, span[1], side="right")
    which = slice(int(first), int(end))
    return Chunk(samples.time[which], samples.accelerometer[which], samples.gyroscope[which])


def joined(chunks: Iterable[Chunk]) -> Chunk:
    """Puts samples behind each other."""
    parts = list(chunks)
    return Chunk(
        np.concatenate([part.time for part in parts]),
        np.concatenate([part.accelerometer for part in parts]),
        np.concatenate([part.gyroscope for part in parts]),
    )
