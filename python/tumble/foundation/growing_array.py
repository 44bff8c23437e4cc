"""Rows of numbers that come piece by piece, and are held once; a list of pieces would be held twice."""

from __future__ import annotations

import numpy as np

from tumble.foundation.recording import FloatArray


class GrowingArray:
    """Rows of `width` numbers, (n,) or (n, width), in double precision."""

    def __init__(self, width: int = 1) -> None:
        self._width = width
        self._content = bytearray()

    def add(self, rows: FloatArray) -> None:
        """Appends rows, which are copied."""
        self._content += np.ascontiguousarray(rows, np.float64).data.cast("B")

    def whole(self) -> FloatArray:
        """Returns all rows; no more can be added while the array is in use."""
        numbers: FloatArray = np.frombuffer(self._content, np.float64)
        return numbers if self._width == 1 else numbers.reshape(-1, self._width)
