"""One sensor logged under two names: no noise of two gyroscopes agrees to the bit."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Iterable, Iterator

import numpy as np

from tumble.foundation.recording import FloatArray

SAMPLES = 1000
"""Number of first samples of a log that are compared."""
FEWEST = 100
FEWEST_DIFFERENT = 10
"""Readings that differ, of those compared: a gyroscope that is coarse or dead reads as any other does."""


class GyroscopeHead:
    """The first readings of a gyroscope, as they come by."""

    __slots__ = ("_count", "_pieces")

    def __init__(self) -> None:
        self._pieces: list[FloatArray] = []
        self._count = 0

    def push(self, rates: FloatArray) -> None:
        """Adds (n, 3) successive readings, as logged."""
        if self._count < SAMPLES:
            self._pieces.append(np.array(rates[: SAMPLES - self._count]))
            self._count += len(self._pieces[-1])

    def digest(self) -> str:
        """Returns what no other gyroscope has; empty where too little was read to decide."""
        if self._count < FEWEST:
            return ""
        head = np.concatenate(self._pieces)
        if len(np.unique(head, axis=0)) < FEWEST_DIFFERENT or not np.isfinite(head).all():
            return ""
        return hashlib.sha256(head.tobytes()).hexdigest()


def duplicate_sensors(digests: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Yields a message on units with the same gyroscope, by their names and digests."""
    names: dict[str, list[str]] = defaultdict(list)
    for name, digest in digests:
        if digest:
            names[digest].append(name)
    for alike in names.values():
        if len(alike) > 1:
            yield (
                f"the gyroscopes of {', '.join(alike[:-1])} and {alike[-1]} read the same to the bit: they "
                "are one sensor, or one log is a copy of the other; name the log of each unit"
            )
