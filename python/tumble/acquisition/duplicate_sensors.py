"""One sensor or axis logged under two names: no noise of two agrees to the bit."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Iterable, Iterator
from itertools import combinations

import numpy as np

from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.units import TRIADS, Triad

SAMPLES = 1000
"""Number of first samples of a log that are compared."""
FEWEST = 100
FEWEST_DIFFERENT = 10
"""Readings that differ, of those compared: a sensor that is coarse or dead reads as any other does."""


class SensorHead:
    """The first readings of a sensor, as they come by."""

    __slots__ = ("_count", "_pieces")

    def __init__(self) -> None:
        self._pieces: list[FloatArray] = []
        self._count = 0

    def push(self, readings: FloatArray) -> None:
        """Adds (n, 3) successive readings, as logged."""
        if self._count < SAMPLES:
            self._pieces.append(np.array(readings[: SAMPLES - self._count]))
            self._count += len(self._pieces[-1])

    def digest(self) -> str:
        """Returns what no other sensor has; empty where too little was read to decide."""
        head = self._read()
        decides = len(head) >= FEWEST and len(np.unique(head, axis=0)) >= FEWEST_DIFFERENT
        return hashlib.sha256(head.tobytes()).hexdigest() if decides else ""

    def has_axis_twice(self) -> bool:
        """Returns whether two axes read the same to the bit; false where too little was read to decide."""
        head = self._read()
        if len(head) < FEWEST:
            return False
        different = [len(np.unique(values)) for values in head.T]
        return any(
            different[i] >= FEWEST_DIFFERENT and bool((head[:, i] == head[:, j]).all())
            for i, j in combinations(range(3), 2)
        )

    def _read(self) -> FloatArray:
        """Returns the readings, (n, 3); none where one is no number."""
        head = np.concatenate([np.empty((0, 3)), *self._pieces])
        return head if np.isfinite(head).all() else np.empty((0, 3))


class UnitHeads:
    """The first readings of both sensors of a unit."""

    __slots__ = ("_heads",)

    def __init__(self, triads: tuple[Triad, ...] = TRIADS) -> None:
        self._heads = {triad: SensorHead() for triad in triads}

    def push(self, chunk: Chunk) -> None:
        """Adds successive samples, as logged."""
        for triad, head in self._heads.items():
            head.push(chunk.accelerometer if triad == "accelerometer" else chunk.gyroscope)

    def gyroscope_digest(self) -> str:
        """Returns the digest of the gyroscope; empty where there is none."""
        return self._heads["gyroscope"].digest() if "gyroscope" in self._heads else ""

    def digest(self) -> str:
        """Returns what no other log of the unit has; empty where too little was read to decide."""
        return "".join(head.digest() for head in self._heads.values())

    def twice(self) -> str:
        """Describes a sensor of which two axes are one column; empty where there is none."""
        found = (triad for triad, head in self._heads.items() if head.has_axis_twice())
        return next((f"two axes of the {triad} read the same; check the columns" for triad in found), "")


def refuse_copies(heads: Iterable[tuple[str, str]], about: str = "") -> None:
    """Raises `ProcedureError`, in one line, where two logs of one unit, by name and digest, are one."""
    names: dict[str, str] = {}
    for name, digest in heads:
        if digest and digest in names:
            raise ProcedureError(
                f"{names[digest]} and {name} read the same to the bit, and would count twice; leave one out",
                about=about,
            )
        names[digest] = name


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
