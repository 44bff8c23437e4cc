"""A dot with its 95 % interval, between its limits, as small as a table cell.

These stand in table rows beside the numbers they picture, thousands in a batch; a figure each would not
be aligned.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from dataclasses import dataclass

from markupsafe import Markup

WIDTH, HEIGHT = 320, 20
_EDGE = 6.0
_SHORTEST_HALF = 1.5
_ROUND_STEPS = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)


@dataclass(frozen=True, slots=True)
class Ruler:
    """The stretch of numbers a row of pictures shares."""

    low: float
    high: float

    @classmethod
    def about_zero(cls, numbers: Iterable[float]) -> Ruler:
        """Span from minus to plus the next round number above every finite one of `numbers`."""
        reach = round_up(numbers)
        return cls(-reach, reach)

    @classmethod
    def from_zero(cls, numbers: Iterable[float]) -> Ruler:
        """Span from zero to the next round number above every finite one of `numbers`."""
        return cls(0.0, round_up(numbers))

    def place(self, number: float) -> float:
        """Returns the horizontal place in pixels; numbers outside stand at the edge."""
        inside = min(max((number - self.low) / (self.high - self.low), 0.0), 1.0)
        return _EDGE + inside * (WIDTH - 2 * _EDGE)


def whisker(
    ruler: Ruler, value: float, low: float, high: float, limit: float | None, *, alarm: bool
) -> Markup:
    """Draws a value and its interval; `limit` is the largest magnitude allowed, all in one unit.

    Empty where the value or an end of the interval is not finite.
    """
    if not all(map(math.isfinite, (value, low, high))):
        return Markup("")
    middle = ruler.place(value)
    left = min(ruler.place(low), middle - _SHORTEST_HALF)
    right = max(ruler.place(high), middle + _SHORTEST_HALF)
    kind = "alarm" if alarm else "calm"
    limits = [] if limit is None else [end for end in (-limit, limit) if ruler.low <= end <= ruler.high]
    body = (
        _vertical("wz", ruler.place(0.0), 2)
        + _horizontal("wb", _EDGE, WIDTH - _EDGE)
        + "".join(_vertical("wl", ruler.place(end), 3) for end in limits)
        + _horizontal(f"wi {kind}", left, right)
        + f'<circle class="wd {kind}" cx="{middle:.1f}" cy="{HEIGHT / 2:g}" r="3.2"/>'
    )
    opening = f'<svg class="whisker" viewBox="0 0 {WIDTH} {HEIGHT}" aria-hidden="true">'
    return Markup(f"{opening}{body}</svg>")


def round_up(numbers: Iterable[float]) -> float:
    """Finds the smallest of our round numbers that no finite one of `numbers` exceeds; 1 for none."""
    largest = max((abs(number) for number in numbers if math.isfinite(number)), default=0.0)
    # The power of ten is unknown for numbers too small to keep all their digits.
    if largest < sys.float_info.min:
        return 1.0
    power = 10.0 ** math.floor(math.log10(largest))
    return next((step * power for step in _ROUND_STEPS if step * power >= largest), 20.0 * power)


def _vertical(kind: str, place: float, inset: int) -> str:
    return f'<line class="{kind}" x1="{place:.1f}" x2="{place:.1f}" y1="{inset}" y2="{HEIGHT - inset}"/>'


def _horizontal(kind: str, left: float, right: float) -> str:
    return f'<line class="{kind}" x1="{left:.1f}" x2="{right:.1f}" y1="{HEIGHT / 2:g}" y2="{HEIGHT / 2:g}"/>'
