"""Readings of a magnetometer at the end of its range, which no longer follow the field."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from tumble import _core
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of, join

if TYPE_CHECKING:
    from numpy.typing import NDArray

FEWEST_OF_REST = 4
"""Readings at the end of the range from which on a rest has no mean: those of noise alone are fewer.

Three of 200 readings of a rest shift its mean by 2 % of their scatter at most.
"""


def within_range(
    raw: MagneticTrack, track: MagneticTrack, spans: Iterable[tuple[float, float]] = ()
) -> tuple[MagneticTrack, str]:
    """Returns the readings of a track that follow the field, and a remark on those left out, if any.

    `raw` has the readings of the sensor, uT, and `track` those that are used, which may be corrected.
    A rest, of `spans` in s, is left out as a whole. Method: docs/theory/magnetometer.md, section 6.
    """
    ends = _core.magnetometer_range_ends(np.ascontiguousarray(raw.field))
    at_end = (raw.field[:, :, None] == ends).any(axis=2)
    clipped = at_end.any(axis=1)
    if not clipped.any():
        return track, ""
    rests, without = 0, clipped.copy()
    for start, end in spans:
        within = (raw.time >= start) & (raw.time <= end)
        if (clipped & within).sum() >= FEWEST_OF_REST:
            rests += 1
            without |= within
    where = f" in {count_of('rest', rests)}" if rests else ""
    are = "is the end" if at_end.any(axis=0).sum() == 1 else "are ends"
    remark = (
        f"{join(list(_ends(ends, at_end)))} {are} of the magnetometer's range: left out "
        f"{count_of('reading', int(clipped.sum()))} there{where}, as the field was beyond it; set a larger "
        "range, or move magnets and iron away"
    )
    return track.chosen(~without), remark


def _ends(ends: FloatArray, at_end: NDArray[np.bool_]) -> Iterator[str]:
    for place, axis in enumerate("xyz"):
        if at_end[:, place].any():
            values = ends[place][np.isfinite(ends[place])]
            yield f"{axis} of {' and '.join(f'{value:.4g}' for value in values)} uT"
