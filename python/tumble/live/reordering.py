"""Samples that overtook each other on the way, put back in order."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FEW_SAMPLES, FloatArray
from tumble.live.clock import RESTARTED
from tumble.live.readings import Readings, joined
from tumble.logs.track import RawSamples

MISSING = 1.5
"""Usual steps between two samples beyond which one is missing between them."""
_SHORT = 0.6
"""Usual steps between two samples below which the sender was late with the first."""
_CAUGHT_UP = 0.6
"""Usual steps by which a sender may still be late: what is left makes the next step a short one."""
_STEPS_KEPT = 64
"""Newest steps, from which the usual one is found."""
_STEPS_BETWEEN = 16
"""Steps between two such medians."""


class ReorderBuffer:
    """Holds samples back while one before them is missing, for `window` s at most.

    Samples in order pass at once, and so do those of a sender that was held up and has caught up. One that
    comes after its window passes too, behind those it should have preceded: whoever takes them counts it as
    late.
    """

    def __init__(self, window: float) -> None:
        self.sorted = 0
        """Samples that were put before others that came earlier."""
        self._window = window
        self._held: Readings | None = None
        self._arrivals = np.empty(0)
        """s of `clock.now()` at which each held sample came."""
        self._last = np.nan
        """Stamp of the newest sample that was given, s."""
        self._usual = np.nan
        """s between two samples."""
        self._steps: deque[float] = deque(maxlen=_STEPS_KEPT)
        self._new_steps = 0

    def push(self, readings: Readings, arrival: float) -> tuple[Readings, float]:
        """Adds samples with stamps in s; returns those that are ready, and the arrival of the last.

        `arrival` is s of `clock.now()`.
        """
        stamps = _stamps(readings)
        if self._held is None and self._is_in_order(stamps):
            self._note(stamps)
            return readings, arrival
        if not self._can_be_sorted(stamps):
            held, _ = self._release(len(self._arrivals))
            self._last = float(stamps[-1])
            return joined([held, readings]) if len(held) else readings, arrival
        self._insert(readings, arrival)
        return self.due(arrival)

    def due(self, now: float) -> tuple[Readings, float]:
        """Returns samples that have waited long enough at `now`, s of `clock.now()`; perhaps none."""
        if self._held is None:
            return NONE, now
        stamps = _stamps(self._held)
        steps = np.diff(stamps, prepend=self._last if np.isfinite(self._last) else stamps[0])
        # A sample waits where one is missing before it and none behind it has waited long enough.
        oldest_behind = np.minimum.accumulate(self._arrivals[::-1])[::-1]
        waits = (steps > MISSING * self._usual) & (now - oldest_behind < self._window)
        waits &= ~self._made_up(steps)
        return self._release(int(np.argmax(waits)) if waits.any() else len(stamps))

    def _made_up(self, steps: FloatArray) -> NDArray[np.bool_]:
        """Finds the (n,) steps, s, that are long as the sender was held up: short ones behind make up for it.

        Where a sample is missing, those behind it keep the usual step. One that came twice shows neither.
        """
        is_usual = (steps >= _SHORT * self._usual) & (steps <= MISSING * self._usual)
        excess = np.where(is_usual | (steps <= 0.0), 0.0, steps - self._usual)
        late = np.cumsum(excess)
        least_behind = np.minimum.accumulate(late[::-1])[::-1]
        made_up: NDArray[np.bool_] = least_behind - (late - excess) <= _CAUGHT_UP * self._usual
        return made_up & (least_behind < late)

    def _is_in_order(self, stamps: FloatArray) -> bool:
        if not np.isfinite(self._usual):
            return False
        last, longest = self._last, MISSING * self._usual
        if len(stamps) > FEW_SAMPLES:
            steps = np.diff(stamps, prepend=last)
            return bool(steps.min() > 0.0 and steps.max() <= longest)
        for stamp in stamps.tolist():
            if not 0.0 < stamp - last <= longest:
                return False
            last = stamp
        return True

    def _can_be_sorted(self, stamps: FloatArray) -> bool:
        """Returns False for stamps of a clock that leapt or began anew: their order is that of arrival."""
        if not np.isfinite(stamps).all():
            return False
        newest = self._last if self._held is None else _stamps(self._held)[-1]
        return not np.isfinite(newest) or bool(np.all(np.abs(stamps - newest) < RESTARTED))

    def _insert(self, readings: Readings, arrival: float) -> None:
        both = readings if self._held is None else joined([self._held, readings])
        arrivals = np.concatenate([self._arrivals, np.full(len(readings), arrival)])
        stamps = _stamps(both)
        order = np.argsort(stamps, kind="stable")
        # Each sample that is newer than one behind it in the order of arrival was overtaken by none.
        self.sorted += int(np.count_nonzero(stamps < np.maximum.accumulate(stamps)))
        self._held, self._arrivals = both.part(order), arrivals[order]
        if not np.isfinite(self._usual) and len(both) > 1:
            self._usual = float(np.median(np.diff(stamps[order])))

    def _release(self, count: int) -> tuple[Readings, float]:
        if self._held is None or count == 0:
            return NONE, 0.0
        given, arrival = self._held.part(slice(count)), float(self._arrivals[:count].max())
        is_rest = count < len(self._arrivals)
        self._held = self._held.part(slice(count, None)) if is_rest else None
        self._arrivals = self._arrivals[count:]
        self._note(_stamps(given))
        return given, arrival

    def _note(self, stamps: FloatArray) -> None:
        """Keeps the newest stamp, and lets the usual step follow the rate, whatever single steps do."""
        last = self._last
        for stamp in stamps.tolist():
            # Those after samples that came too late, or after none, are no steps.
            if stamp > last:
                self._steps.append(stamp - last)
                self._new_steps += 1
            last = stamp
        if self._new_steps >= _STEPS_BETWEEN:
            self._usual, self._new_steps = _usual_of(self._steps), 0
        self._last = float(stamps[-1]) if not stamps[-1] < self._last else self._last


NONE = Readings(RawSamples(np.empty(0), np.empty((0, 3)), np.empty((0, 3))))


def _usual_of(steps: Collection[float]) -> float:
    """Returns the median step, which lost samples do not move; the mean where most samples were sent late."""
    median, mean = sorted(steps)[len(steps) // 2], sum(steps) / len(steps)
    return median if median > 0.5 * mean else mean


def _stamps(readings: Readings) -> FloatArray:
    assert readings.samples.time is not None, "every sample was stamped"
    return readings.samples.time
