"""Arrays that stand in a file as in memory, one number after another."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from math import prod
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

BLOCK = 1 << 13
"""Samples that are read at a time: those of an IMU fit in the cache of a core."""


@dataclass(frozen=True, slots=True)
class StoredArray:
    """An array as it stands in a file."""

    name: str
    open: Callable[[], IO[bytes]]
    """Its bytes, and those before them."""
    shape: tuple[int, ...]
    column_major: bool
    dtype: np.dtype[Any]
    offset: int
    """Bytes before its numbers."""

    def pieces(self, axis: int) -> Iterator[NDArray[Any]]:
        """Reads it along an axis: as the bytes stand, or one stream for each line along that axis."""
        if len(self.shape) == 1 or self.column_major == (axis == 1):
            return self._in_order(axis)
        return self._side_by_side(axis)

    def _in_order(self, axis: int) -> Iterator[NDArray[Any]]:
        length, across = self.shape[axis], prod(self.shape) // self.shape[axis]
        with self.open() as stream:
            stream.seek(self.offset)
            for start in range(0, length, BLOCK):
                count = min(BLOCK, length - start)
                numbers = self._numbers(stream, count * across)
                shape = tuple(count if each == axis else size for each, size in enumerate(self.shape))
                yield numbers.reshape(shape, order="F" if self.column_major else "C")
            stream.read(1)  # by which an archive sees the end, and that its checksum is right

    def _side_by_side(self, axis: int) -> Iterator[NDArray[Any]]:
        length, lines = self.shape[axis], self.shape[1 - axis]
        with ExitStack() as stack:
            streams = [stack.enter_context(self.open()) for _ in range(lines)]
            for line, stream in enumerate(streams):
                stream.seek(self.offset + line * length * self.dtype.itemsize)
            for start in range(0, length, BLOCK):
                count = min(BLOCK, length - start)
                yield np.stack([self._numbers(stream, count) for stream in streams], axis=1 - axis)
            streams[-1].read(1)

    def _numbers(self, stream: IO[bytes], count: int) -> NDArray[Any]:
        wanted = count * self.dtype.itemsize
        data = stream.read(wanted)
        if len(data) != wanted:
            raise EOFError(f"{self.name or 'the array'} ends {wanted - len(data)} bytes too early")
        return np.frombuffer(data, self.dtype)
