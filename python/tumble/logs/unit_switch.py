"""The length of gravity at rest over a log: a factor between two units shows that its unit changed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import Chunk, FloatArray

_WINDOW: Final = 32
"""Samples of a mean."""
_STILL: Final = 0.05
"""Share of the length by which readings scatter at most where a unit stands still."""
_FACTORS: Final = (STANDARD_GRAVITY, 1000.0, 1000.0 * STANDARD_GRAVITY)
"""Ratios of the units of accelerometers: g to m/s^2, mg to g, mg to m/s^2."""
_NEAR: Final = 0.25
"""Share by which the length at rest differs at most, by bias and scale, from that of another rest."""
_FEWEST: Final = 4
"""Windows that show another unit; a blow may be one."""


@dataclass(slots=True)
class UnitSwitch:
    """Length of gravity at the first rest of a pass, and where it is that of another unit."""

    first: float = 0.0
    """Length at the first rest, m/s^2; 0 before there was one."""
    other: float = 0.0
    """Length in the first window that another unit fits; 0 where none does."""
    since: float = 0.0
    """s of the log at which that begins."""
    windows: int = 0

    def add(self, chunk: Chunk) -> None:
        """Looks at the next chunk."""
        count = len(chunk) // _WINDOW
        if not count:
            return
        pieces = chunk.accelerometer[: count * _WINDOW].reshape(count, _WINDOW, 3)
        means = np.stack([pieces[:, :, axis].mean(axis=1) for axis in range(3)], axis=1)
        lengths = np.linalg.norm(means, axis=1)
        if not self.first:
            still = np.flatnonzero(_are_still(pieces, lengths))
            if not len(still):
                return
            self.first = float(lengths[still[0]])
        ratios = lengths / self.first
        fits = np.zeros(count, bool)
        for factor in _FACTORS:
            for ratio in (factor, 1.0 / factor):
                fits |= np.abs(ratios / ratio - 1.0) < _NEAR
        places = np.flatnonzero(fits)
        places = places[_are_still(pieces[places], lengths[places])]
        if len(places) and not self.windows:
            self.other = float(lengths[places[0]])
            self.since = float(chunk.time[places[0] * _WINDOW])
        self.windows += len(places)

    def join(self, other: UnitSwitch) -> None:
        """Takes over what another pass has met."""
        if not self.windows:
            self.first, self.other, self.since = other.first, other.other, other.since
        self.windows += other.windows

    def notices(self) -> tuple[str, ...]:
        """Reports the change; empty where there is none."""
        if self.windows < _FEWEST:
            return ()
        return (
            f"the accelerometer reads {self.other:.4g} m/s^2 at rest from {self.since:.6g} s on, and "
            f"{self.first:.4g} before: its unit seems to change there; split the log, and state "
            "the unit of each",
        )


def _are_still(pieces: FloatArray, lengths: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    scatter = np.sqrt(sum(pieces[:, :, axis].var(axis=1) for axis in range(3)))
    still: np.ndarray[tuple[int], np.dtype[np.bool_]] = (scatter < _STILL * lengths) & (lengths > 0.0)
    return still
