"""Levels of detail: as few samples as a screen can show, among them the lowest and highest of every bin.

Downsampling by extremes and largest triangles: Van Der Donckt et al., "MinMaxLTTB: Leveraging MinMax-
Preselection to Scale LTTB", IEEE VIS 2023. It may drop an extreme, so those of each bin are added.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tumble.tools.view.column import BLOCK, Extremes, GrowingColumn, Places

if TYPE_CHECKING:
    from tumble.foundation.recording import FloatArray

DIRECT = 1 << 20
"""Samples up to which bins are looked through sample by sample; beyond it block by block."""
POINTS_OF_A_BIN = 3
"""Most samples that a bin is shown by, in the mean."""


def shown(values: FloatArray, bins: int) -> Places:
    """Returns the places, in order, of those of (n,) values that show them in so many bins of equal count.

    All are shown where there are no more than the bins would show. The first and last always are, and so are
    the lowest and the highest of each bin. Values that are not finite are not looked at.
    """
    if len(values) <= POINTS_OF_A_BIN * bins:
        return np.arange(len(values))
    from tsdownsample import MinMaxDownsampler, MinMaxLTTBDownsampler

    extremes = MinMaxDownsampler().downsample(values, n_out=2 * bins)  # type: ignore[no-untyped-call]
    shape = MinMaxLTTBDownsampler().downsample(values, n_out=max(bins, 3))  # type: ignore[no-untyped-call]
    return np.union1d(extremes, shape).astype(np.int64)


def level(column: GrowingColumn, extremes: Extremes, first: int, last: int, bins: int) -> Places:
    """Returns the places of samples that show samples `first` to `last`, the last excluded, as `shown` does.

    Where there are many, bins are of whole blocks, and their extremes are as exact.
    """
    values = column.values()
    if last - first <= DIRECT:
        return first + shown(values[first:last], bins)
    begin, end = first // BLOCK + 1, min((last - 1) // BLOCK, extremes.blocks)
    places, of_blocks = extremes.between(begin, end)
    head, tail = _ends(values, first, begin * BLOCK), _ends(values, end * BLOCK, last)
    among = np.concatenate([head, places, tail])
    found = np.concatenate([values[head], of_blocks, values[tail]])
    return among[shown(found, bins)]


def _ends(values: FloatArray, first: int, last: int) -> Places:
    """Returns the places of the first, lowest, highest and last of samples `first` to `last`, excluded."""
    part = values[first:last]
    return np.unique([first, first + int(part.argmin()), first + int(part.argmax()), last - 1])
