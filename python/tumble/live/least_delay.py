"""The line below all delays: offset and skew of a sensor's clock, from arrivals that are only ever late.

Moon, Skelly and Towsley, "Estimation and removal of clock skew from network delay measurements", 1999, by the
convex hull of Zhang, Liu and Xia, "Clock synchronization algorithms for network measurements", 2002, over a
sliding window. Equations: docs/theory/clocks.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from statistics import median

from tumble.foundation.clock_skew import MOST_SKEW, add_corner, lower_hull

BLOCKS = 32
"""Blocks in a window; each keeps its hull."""
FIRST_BLOCK = 1.0 / 32.0
"""s of the first blocks; two are made one as long as the window grows."""
LAST_BLOCK = 4.0
"""s of a block of the whole window, which is 128 s: skew changes by 0.1 ppm or so while an IMU warms."""
MOST_CORNERS = 16
"""Corners of a block's hull; noise has about eight, and only a clock that bends has more."""
SLOTS = 64
"""Slots of a block, of each of which the quickest sample is kept: the others are hardly ever corners."""
PRIOR_SKEW = 0.01
"""1-sigma of skew before anything is known: that of an oscillator without a crystal."""
SUPPORT = 2.0
"""1-sigma of the line's end, in mean heights of block minima over the root of their number."""
FEW = 2.0
"""The same is so much larger, over the number of blocks that carry no line, where there are few of them."""
NEWEST = 3
"""Blocks that are the newest: what they all lie above the line may be its error."""


@dataclass(slots=True)
class _Block:
    """Arrivals of some successive seconds."""

    end: float
    """s of the sensor at which the next block begins."""
    slot: float
    """s of a slot."""
    corners: list[tuple[float, float]] = field(default_factory=list)
    """Corners of the lower hull, s of the sensor and s of delay."""
    count: int = 0
    sum: float = 0.0
    """s, of the sensor's times."""

    def add(self, stamp: float, delay: float, skew: float) -> None:
        """Adds a sample; by the skew of the line, the quickest of a slot is known."""
        self.count += 1
        self.sum += stamp
        corners = self.corners
        if corners:
            newest, least = corners[-1]
            if stamp // self.slot == newest // self.slot:
                if delay - least >= skew * (stamp - newest):
                    return
                corners.pop()
        add_corner(corners, (stamp, delay))
        self._thin()

    def joined(self, later: _Block) -> _Block:
        corners = lower_hull(self.corners + later.corners)
        count, total = self.count + later.count, self.sum + later.sum
        block = _Block(later.end, 2.0 * self.slot, corners, count, total)
        block._thin()
        return block

    def _thin(self) -> None:
        while len(self.corners) > MOST_CORNERS:
            del self.corners[1:-1:2]


@dataclass(slots=True)
class LeastDelay:
    """Line below the delays of a sliding window: `delay = level + skew (stamp - centre)`."""

    arrivals: int = 0
    """All that were taken in."""
    centre: float = 0.0
    """s of the sensor: mean of the window's stamps."""
    level: float = 0.0
    """s, of the line at its centre."""
    skew: float = 0.0
    """s of delay a second of the sensor."""
    skew_sigma: float = PRIOR_SKEW
    sigma: float = math.inf
    """s, of the line where the newest samples are, beyond the least delay of all."""
    _blocks: list[_Block] = field(default_factory=list)
    _length: float = FIRST_BLOCK
    _older: list[tuple[float, float]] = field(default_factory=list)
    """Hull of all blocks but the last."""
    _first: float = math.nan
    _due: float = -math.inf

    @property
    def span(self) -> float:
        """s, from the first to the last stamp of the window."""
        if not self._blocks:
            return 0.0
        return self._blocks[-1].corners[-1][0] - self._blocks[0].corners[0][0]

    def at(self, stamp: float) -> float:
        """Returns s of delay that the line has there."""
        return self.level + self.skew * (stamp - self.centre)

    def add(self, stamp: float, delay: float) -> None:
        """Adds a sample that arrived `delay` s after its `stamp`, s, which is no earlier than the last."""
        self.arrivals += 1
        if not self._blocks or stamp >= self._blocks[-1].end:
            self._begin_block(stamp)
        self._blocks[-1].add(stamp, delay, self.skew)
        if stamp >= self._due:
            self._fit()
            # The window's middle moves little meanwhile.
            self._due = stamp + 0.5 * self._length
        elif (below := delay - self.at(stamp)) < 0.0:
            self.level += below

    def _begin_block(self, stamp: float) -> None:
        blocks = self._blocks
        if len(blocks) >= BLOCKS and self._length < LAST_BLOCK:
            self._length *= 2.0
            blocks[:] = [one.joined(other) for one, other in zip(blocks[::2], blocks[1::2], strict=True)]
        oldest = stamp - BLOCKS * LAST_BLOCK
        blocks[:] = [block for block in blocks if block.end > oldest][-BLOCKS + 1 :]
        self._older = lower_hull([corner for block in blocks for corner in block.corners])
        # Blocks begin at multiples of their length, so that silence needs no empty ones.
        end = (math.floor(stamp / self._length) + 1.0) * self._length
        blocks.append(_Block(end, self._length / SLOTS))

    def _fit(self) -> None:
        """Fits the line with the least sum of distances that has no delay below it (eq. 3)."""
        count = sum(block.count for block in self._blocks)
        self.centre = sum(block.sum for block in self._blocks) / count
        corners = list(self._older)
        for corner in self._blocks[-1].corners:
            add_corner(corners, corner)
        slope, length, beyond = self._edge(corners)
        heights = self._heights(corners, slope)
        height = self._usual_height(heights)
        self._set_skew(slope, length, height)
        self.level = min(y - self.skew * (x - self.centre) for x, y in corners)
        self._set_sigma(height, beyond)

    def _edge(self, corners: list[tuple[float, float]]) -> tuple[float, float, float]:
        """Slope of the hull's edge over the centre, its length, and what lies to the right of it, s."""
        for (x0, y0), (x1, y1) in pairwise(corners):
            if x1 >= self.centre and x1 > x0:
                slope = (y1 - y0) / (x1 - x0)
                return max(-MOST_SKEW, min(slope, MOST_SKEW)), x1 - x0, corners[-1][0] - x1
        return 0.0, 0.0, 0.0

    def _heights(self, corners: list[tuple[float, float]], slope: float) -> list[float]:
        """Returns s by which the least delay of each block lies above the line of that slope (eq. 4)."""
        level = min(y - slope * x for x, y in corners)
        return [min(y - slope * x for x, y in block.corners) - level for block in self._blocks]

    def _usual_height(self, heights: list[float]) -> float:
        # The two that carry the line have none.
        free = sorted(heights)[2:]
        return (1.0 + FEW / len(free)) * median(free) / math.log(2.0) if free else math.inf

    def _set_skew(self, slope: float, length: float, height: float) -> None:
        if not math.isfinite(height) or length <= 0.0:
            self.skew, self.skew_sigma = 0.0, PRIOR_SKEW
            return
        found = (SUPPORT * height / math.sqrt(len(self._blocks)) / length) ** 2
        prior = PRIOR_SKEW**2
        self.skew = slope * prior / (prior + found)  # eq. 5
        self.skew_sigma = math.sqrt(found * prior / (prior + found))

    def _set_sigma(self, height: float, beyond: float) -> None:
        above = min(y - self.at(x) for block in self._blocks[-NEWEST:] for x, y in block.corners)
        level_sigma = SUPPORT * height / math.sqrt(len(self._blocks))
        self.sigma = math.hypot(level_sigma, self.skew_sigma * beyond, above)  # eq. 6
