"""Seconds of a rest that a unit has shown: samples that came while it was not frozen."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

import numpy as np

from tumble.acquisition.repetitions import FROZEN, frozen_stretches
from tumble.foundation.recording import Chunk, FloatArray
from tumble.tools.record.frozen import FROZEN_AFTER

TimeSpan: TypeAlias = tuple[float, float]
"""First and last time, s."""


def seconds_shown(time: FloatArray, span: TimeSpan, without: Iterable[TimeSpan] = ()) -> float:
    """Returns s of a span that samples at these times, (n,) s in order, cover.

    Two samples cover the time between them unless it is longer than `FROZEN`, or shares time with a span of
    `without`.
    """
    inside = time[np.searchsorted(time, span[0]) : np.searchsorted(time, span[1], side="right")]
    steps = np.diff(inside)
    counted = steps <= FROZEN
    for begin, last in without:
        counted &= (inside[1:] <= begin) | (inside[:-1] >= last)
    return float(steps[counted].sum())


def frozen_while_others_moved(samples: Chunk, rests: Sequence[TimeSpan]) -> Iterator[TimeSpan]:
    """Yields spans in which a unit repeats one reading and the table, at rest in `rests`, moves meanwhile.

    A coarse sensor may repeat a reading for a whole rest, but not from one rest into the next.
    """
    if not len(samples):
        return
    for first, last in frozen_stretches(samples):
        begin, end = float(samples.time[first]), float(samples.time[last])
        shared = [min(end, stop) - max(begin, start) for start, stop in rests]
        at_rest = [each for each in shared if each > 0.0]
        if len(at_rest) > 1 or end - begin - sum(at_rest) > FROZEN_AFTER:
            yield begin, end
