"""Samples of a unit on their way: when they were taken, the stamps of its clock, and its readings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FloatArray
from tumble.tools.simulate.live.fault import LiveFault


@dataclass(frozen=True, slots=True)
class Samples:
    """Samples in the order they were taken."""

    taken: FloatArray
    """(n,) s of the bench's clock."""
    time: FloatArray
    """(n,) s of the unit's own clock."""
    accelerometer: FloatArray
    """(n, 3) m/s^2."""
    gyroscope: FloatArray
    """(n, 3) rad/s."""

    def __len__(self) -> int:
        return len(self.taken)

    def where(self, kept: NDArray[np.bool_] | slice) -> Samples:
        """Returns some of them."""
        return Samples(*(getattr(self, each.name)[kept] for each in fields(self)))

    def then(self, later: Samples) -> Samples:
        """Puts later ones behind these."""
        pairs = ((getattr(self, each.name), getattr(later, each.name)) for each in fields(self))
        return Samples(*(np.concatenate(pair) for pair in pairs))


NONE = Samples(np.empty(0), np.empty(0), np.empty((0, 3)), np.empty((0, 3)))


class Feed(Protocol):
    """Source of the readings of a unit, as time goes on."""

    def until(self, now: float) -> Samples:
        """Returns the samples taken since the last call, up to `now`, s of the bench's clock."""


def disturbed(samples: Samples, faults: tuple[LiveFault, ...], last: Samples) -> Samples:
    """Returns samples with what is wrong with them; `last` is the one before, if there was any.

    Faults of the line are that of the line; a unit that slips does so where it is moved.
    """
    for fault in faults:
        start, end = fault.span
        hit = (samples.taken >= start) & (samples.taken < end)
        if fault.kind in ("clock-jump", "time-backwards"):
            jump = fault.bad if fault.kind == "clock-jump" else -fault.bad
            samples = _timed(samples, samples.time + np.where(hit, jump, 0.0))
        elif fault.kind == "restart":
            after = samples.taken >= end
            samples = _timed(samples, np.where(after, samples.taken - end, samples.time)).where(~hit)
        elif fault.kind in ("gap", "unplugged"):
            samples = samples.where(~hit)
        elif fault.kind == "frozen" and hit.any():
            samples = _frozen(samples, hit, last)
    return samples


def delays(samples: Samples, faults: tuple[LiveFault, ...]) -> FloatArray:
    """Returns how much later than usual each sample is, (n,) s."""
    late: FloatArray = np.zeros(len(samples))
    for start, end, size in _late(faults):
        late += np.where((samples.taken >= start) & (samples.taken < end), size, 0.0)
    return late


def _late(faults: tuple[LiveFault, ...]) -> Iterator[tuple[float, float, float]]:
    for fault in faults:
        if fault.kind == "late":
            yield (*fault.span, fault.bad)


def shown(samples: Samples, uptime: float) -> Samples:
    """Returns samples of a clock that shows `uptime` s more: no device counts from below zero."""
    return _timed(samples, samples.time + uptime)


def _timed(samples: Samples, time: FloatArray) -> Samples:
    return Samples(samples.taken, time, samples.accelerometer, samples.gyroscope)


def _frozen(samples: Samples, hit: NDArray[np.bool_], last: Samples) -> Samples:
    """Repeats the last reading before those that are hit."""
    first = int(np.argmax(hit))
    before = last.then(samples.where(slice(0, first)))
    held = before.where(slice(-1, None)) if len(before) else samples.where(slice(first, first + 1))
    rows = hit[:, np.newaxis]
    return Samples(
        samples.taken,
        samples.time,
        np.where(rows, held.accelerometer, samples.accelerometer),
        np.where(rows, held.gyroscope, samples.gyroscope),
    )
