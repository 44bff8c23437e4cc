"""Samples whose temperature is beyond the range of the calibration, or was not recorded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS, CalibratedTriad
from tumble.foundation.words import count_of, join

if TYPE_CHECKING:
    from tumble.calibration.document import Calibration
    from tumble.calibration.temperature_drift import TemperatureDrift


SCATTER = 0.01
"""Share of the range by which a thermometer that scatters about its ends may be beyond."""


class TemperatureCounts:
    """Counts samples, chunk by chunk, at whose temperature a calibration does not cover its triads."""

    def __init__(self, calibration: Calibration | None, triads: Sequence[CalibratedTriad] = TRIADS) -> None:
        drifts = {} if calibration is None else calibration.temperature_drifts(triads)
        self._ranges = [_RangeCounts(drift, names) for drift, names in _alike(drifts)]

    def add(self, samples: int, temperature: FloatArray | None) -> None:
        """Counts samples at temperatures (n,), degC, NaN where one was not recorded."""
        for each in self._ranges:
            each.add(samples, temperature)

    def notices(self) -> tuple[str, ...]:
        """Yields notices, a line each, on the temperatures assumed for samples."""
        several = len(self._ranges) > 1
        return tuple(
            f"{join(each.triads)}: {line}" if several else line
            for each in self._ranges
            for line in each.notices()
        )


def _alike(
    drifts: dict[CalibratedTriad, TemperatureDrift],
) -> Iterator[tuple[TemperatureDrift, list[CalibratedTriad]]]:
    """Joins triads of one reference and one range."""
    groups: dict[tuple[float, ...], list[CalibratedTriad]] = {}
    for triad, drift in drifts.items():
        groups.setdefault((drift.reference, *drift.range), []).append(triad)
    for names in groups.values():
        yield drifts[names[0]], names


class _RangeCounts:
    """Samples by where they are of one range."""

    def __init__(self, drift: TemperatureDrift, triads: list[CalibratedTriad]) -> None:
        self.triads = triads
        self._drift = drift
        self._samples = self._unknown = self._beyond = 0
        self._lowest, self._highest = np.inf, -np.inf

    def add(self, samples: int, temperature: FloatArray | None) -> None:
        self._samples += samples
        if temperature is None:
            self._unknown += samples
            return
        known = temperature[np.isfinite(temperature)]
        self._unknown += samples - len(known)
        low, high = self._drift.range
        slack = SCATTER * (high - low)
        beyond = known[(known < low - slack) | (known > high + slack)]
        self._beyond += len(beyond)
        self._lowest = beyond.min(initial=self._lowest)
        self._highest = beyond.max(initial=self._highest)

    def notices(self) -> Iterator[str]:
        low, high = self._drift.range
        if self._unknown:
            missing = count_of("sample", self._unknown)
            which = "" if self._unknown == self._samples else f" for {missing} of {self._samples}"
            yield (
                f"the calibration depends on temperature, which was not recorded{which}: "
                f"{self._drift.reference:g} degC, its reference, is assumed"
            )
        if self._beyond:
            yield (
                f"{count_of('sample', self._beyond)} of {self._samples} beyond the temperatures of the "
                f"calibration, {low:g} to {high:g} degC, at {self._lowest:g} to {self._highest:g}: the drift "
                "at the edge is held for them"
            )
