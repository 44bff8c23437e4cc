"""Readings of a magnetometer that come on a way of their own, put beside the samples of an IMU."""

from __future__ import annotations

import numpy as np

from tumble.foundation.recording import FloatArray

NO_MAGNETOMETER = "none"
"""Setting `magnetometer=` of an address by which that beside an IMU is not read."""
APART = 1.0
"""s between a reading and the newest sample beyond which their stamps are of two clocks."""


class FieldPairing:
    """Puts each reading beside the first sample at its time or after it, each sample having one at most.

    Times are s of one clock. Readings of another clock, or without a stamp, go to the sample that comes next.
    """

    def __init__(self) -> None:
        self.clocks_differ = False
        """Indicates whether a reading had a stamp of another clock, or none."""
        self._time = np.empty(0)
        self._field = np.empty((0, 3))

    def add(self, time: FloatArray, field: FloatArray) -> None:
        """Adds readings, (n,) s and (n, 3), that have come."""
        self._time = np.concatenate([self._time, time])
        self._field = np.concatenate([self._field, field])

    def beside(self, time: FloatArray) -> FloatArray:
        """Returns the readings of the next samples, (n, 3), NaN beside those that have none."""
        found = np.full((len(time), 3), np.nan)
        if not len(time) or not len(self._time):
            return found
        apart = np.abs(self._time - time[-1]) > APART
        self.clocks_differ = self.clocks_differ or bool(apart.any())
        # An order that never runs back keeps readings in the order in which they came.
        stamps = np.maximum.accumulate(np.where(apart, -np.inf, self._time))
        wanted = np.searchsorted(time, stamps)
        order = np.arange(len(wanted))
        rows = np.maximum.accumulate(wanted - order) + order
        given = int(np.searchsorted(rows, len(time)))
        found[rows[:given]] = self._field[:given]
        self._time, self._field = self._time[given:], self._field[given:]
        return found
