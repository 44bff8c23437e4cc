"""Limits that a user sets on top of the maker's: `rate=30,inner.rate=90,outer.angle=-90..90`, in deg."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from tumble.foundation.errors import TableError
from tumble.foundation.numbers import number_of
from tumble.tools.table.axes import FREE, Axis, AxisLimits

FORM = "[AXIS.]rate=DEG/S, [AXIS.]acceleration=DEG/S^2 or [AXIS.]angle=LOW..HIGH (deg), commas between"


def parse_limits(text: str, axes: Sequence[Axis]) -> Mapping[str, AxisLimits]:
    """Returns the limits of each axis by its name; what is not limited is infinite.

    Raises `TableError`, in one line, where an axis or a key is unknown, or a figure is none.
    """
    found = {axis.name: FREE for axis in axes}
    for part in filter(None, map(str.strip, text.split(","))):
        place, _, value = part.partition("=")
        axis, _, key = place.rpartition(".")
        if axis and axis not in found:
            raise TableError(f"--table-limits {part}: no axis {axis!r}; the table has {', '.join(found)}")
        for name in (axis,) if axis else tuple(found):
            found[name] = found[name].within(_limit(part, key, value))
    return found


def exceeded(axis: Axis, angle: float, rate: float, acceleration: float) -> Iterator[str]:
    """Returns the limits of an axis that a motion would exceed; an angle of NaN exceeds none.

    A billionth is what arithmetic leaves of a limit that is kept.
    """
    limits, slack = axis.limits, 1e-9
    low, high = limits.angle or (-math.inf, math.inf)
    if not (math.isnan(angle) or low - slack <= angle <= high + slack):
        yield (
            f"{axis.name} to {math.degrees(angle):.6g} deg, allowed are {math.degrees(low):.6g} to "
            f"{math.degrees(high):.6g}"
        )
    for what, value, largest, unit in (
        ("rate", abs(rate), limits.rate, "deg/s"),
        ("acceleration", acceleration, limits.acceleration, "deg/s^2"),
    ):
        if not value <= largest * (1.0 + slack):
            yield (
                f"{what} of {axis.name} {math.degrees(value):.6g} {unit}, allowed are "
                f"{math.degrees(largest):.6g}"
            )


def _limit(part: str, key: str, value: str) -> AxisLimits:
    if key == "angle":
        low, _, high = value.partition("..")
        span = tuple(map(number_of, (low, high)))
        if span[0] is not None and span[1] is not None and span[0] < span[1]:
            return replace(FREE, angle=(math.radians(span[0]), math.radians(span[1])))
    elif key in ("rate", "acceleration"):
        number = number_of(value)
        if number is not None and 0.0 < number < math.inf:
            radians = math.radians(number)
            return replace(FREE, rate=radians) if key == "rate" else replace(FREE, acceleration=radians)
    raise TableError(f"--table-limits {part}: expected {FORM}")
