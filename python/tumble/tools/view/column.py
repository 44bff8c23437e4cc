"""A channel of a recording on disk, mapped into memory, with the extremes of each block of its samples.

Memory does not grow with the samples themselves: they lie in an unnamed file, which the system maps. Held are
two extremes a block, 32 bytes for every 256 samples, and one block.
"""

from __future__ import annotations

import tempfile
from threading import Lock
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.errors import LogError

if TYPE_CHECKING:
    from tumble.foundation.recording import FloatArray

Places = NDArray[np.int64]
"""(n,) numbers of samples."""

BLOCK = 256
"""Samples of a block."""


class GrowingColumn:
    """Numbers that are only ever appended."""

    def __init__(self) -> None:
        self._file: BinaryIO = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 - lives as long as the column
        self._length = 0
        self._mapped: FloatArray = np.empty(0)

    def __len__(self) -> int:
        return self._length

    def append(self, values: FloatArray) -> None:
        """Appends (n,) values; raises `LogError` where the disk is full."""
        try:
            self._file.write(np.ascontiguousarray(values).data)
        except OSError as error:
            raise LogError(
                f"{tempfile.gettempdir()}: holds the samples while they are shown, and cannot: "
                f"{error.strerror}; set TMPDIR to a folder with more room"
            ) from error
        self._length += len(values)

    def values(self) -> FloatArray:
        """Returns all values (n,), mapped."""
        length = self._length
        if len(self._mapped) != length:
            self._mapped = np.memmap(self._file, np.float64, "r", shape=(length,))
        return self._mapped[:length]

    def close(self) -> None:
        """Gives the disk free."""
        self._mapped = np.empty(0)
        self._file.close()


class Extremes:
    """Places and values of the lowest and the highest sample of each whole block of a column, in order."""

    def __init__(self) -> None:
        self._places: list[Places] = []
        self._values: list[FloatArray] = []
        self._waiting: FloatArray = np.empty(0)
        self._blocks = 0
        # One thread reads a log while others show it.
        self._lock = Lock()

    def append(self, values: FloatArray) -> None:
        """Takes in the (n,) values that follow; what fills no block waits."""
        joined = np.concatenate([self._waiting, values]) if len(self._waiting) else values
        whole = len(joined) // BLOCK
        if whole:
            self._add(joined[: whole * BLOCK].reshape(whole, BLOCK))
        self._waiting = joined[whole * BLOCK :].copy()

    def _add(self, blocks: FloatArray) -> None:
        at = np.sort(np.stack([blocks.argmin(axis=1), blocks.argmax(axis=1)], axis=1), axis=1)
        first = BLOCK * (self._blocks + np.arange(len(blocks)))
        with self._lock:
            self._places.append((first[:, None] + at).ravel())
            self._values.append(np.take_along_axis(blocks, at, axis=1).ravel())
            self._blocks += len(blocks)

    def between(self, first: int, last: int) -> tuple[Places, FloatArray]:
        """Returns places and values of the extremes of blocks `first` to `last`, the last excluded."""
        with self._lock:
            if len(self._places) > 1:
                self._places = [np.concatenate(self._places)]
                self._values = [np.concatenate(self._values)]
            if not self._places:
                return np.empty(0, np.int64), np.empty(0)
            window = slice(2 * first, 2 * last)
            return self._places[0][window], self._values[0][window]

    @property
    def blocks(self) -> int:
        """Number of whole blocks."""
        return self._blocks
