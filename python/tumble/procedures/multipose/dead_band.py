"""A dead band of a gyroscope: rates that it never reads between those at rest and those of turns.

Method: docs/theory/multipose.md, section 13.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.procedures.multipose.turn_bias import Samples, turn_span

BEYOND_REST = 6.0
"""Scatters at rest from the bias, beyond which a reading is not one at rest."""
WIDE = 3.0
"""Such a limit by which a dead band is wider than the readings at rest."""
COARSE = 4.0
"""Steps of a channel up to which a gap is the channel's own."""
CHANCE = 1e-6
"""Chance of such a gap in readings of a gyroscope without a dead band."""


@dataclass(frozen=True, slots=True)
class DeadBand:
    """An axis whose readings near its bias are those at rest, whatever turns it."""

    axis: int
    half_width: float
    """rad/s from the bias."""

    def sentence(self) -> str:
        """Names the axis and the band."""
        return (
            f"the gyroscope has a dead band: about {'xyz'[self.axis]} it reads no rate below "
            f"{1e3 * self.half_width:.2g} mrad/s in any turn; its bias cannot be found from rests"
        )


def dead_band(figures: _core.MultiposeFigures, time: FloatArray, samples: Samples) -> DeadBand | None:
    """Returns the widest dead band; None where there is none. `time` are the stamps of the fit, s."""
    gyroscope = figures["gyroscope"]
    if gyroscope is None:
        return None
    bias, noise = _at_rest(figures, time, samples)
    halves: list[FloatArray] = []
    for before, _ in gyroscope["turns"]:
        first, last = turn_span(figures, before, time)
        halves += np.array_split(np.abs(samples(first, last + 1).gyroscope - bias), 2)
    found = [
        DeadBand(axis, _half_width([rates[:, axis] for rates in halves], noise[axis])) for axis in range(3)
    ]
    widest = max(found, key=lambda each: each.half_width)
    return widest if widest.half_width > 0.0 else None


def _at_rest(
    figures: _core.MultiposeFigures, time: FloatArray, samples: Samples
) -> tuple[FloatArray, FloatArray]:
    """Returns mean and scatter (3,) of the readings at all rests, rad/s."""
    count, sums, squares = 0, np.zeros(3), np.zeros(3)
    origin = None
    for start, end in figures["acquired"].rest_times:
        first, last = np.searchsorted(time, [start - 1e-6, end - 1e-6])
        rates = samples(int(first), int(last)).gyroscope
        if not len(rates):
            continue
        origin = rates[0].copy() if origin is None else origin
        count += len(rates)
        sums += (rates - origin).sum(axis=0)
        squares += ((rates - origin) ** 2).sum(axis=0)
    if origin is None:
        return np.zeros(3), np.full(3, math.inf)
    mean = sums / count
    return origin + mean, np.sqrt(np.maximum(squares / count - mean**2, 0.0))


def _half_width(halves: list[FloatArray], noise: float) -> float:
    """Returns half the band in which absolute rates of halves of turns never are, rad/s; 0 without one.

    A turn leaves zero and comes back to it, and passes each small rate as often as the next. So by chance one
    half in two that are seen within an octave of rates is seen below it first.
    """
    limit = BEYOND_REST * noise
    beyond = [rates[rates > limit] for rates in halves]
    edge = min((float(rates.min()) for rates in beyond if len(rates)), default=0.0)
    if edge <= WIDE * limit:
        return 0.0
    near = [rates[rates < 2.0 * edge] for rates in beyond]
    passing = sum(len(rates) > 0 for rates in near)
    readings = np.unique(np.concatenate(near))
    # Readings of a channel of few digits leave gaps everywhere.
    widest_gap = float(np.diff(readings).max()) if len(readings) > 1 else edge
    by_chance = (edge / (2.0 * edge - limit)) ** passing  # eq. 45
    return edge if edge > COARSE * widest_gap and by_chance < CHANCE else 0.0
