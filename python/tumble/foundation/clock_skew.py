"""Lower convex hull of clock delays, and the range of a clock line below it, for live and recorded clocks.

Andrew, "Another efficient algorithm for convex hulls in two dimensions", Information Processing Letters
9, 1979.
"""

from __future__ import annotations

from collections.abc import Iterable

MOST_SKEW = 0.05
"""Largest skew; beyond it stamps are no seconds. Rates of counting sensors are known within 5 %."""


def lower_hull(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Returns the corners of the lower convex hull of points in order of their first coordinate."""
    corners: list[tuple[float, float]] = []
    for point in points:
        add_corner(corners, point)
    return corners


def add_corner(corners: list[tuple[float, float]], point: tuple[float, float]) -> None:
    """Adds a point to the right of a lower hull, and drops the corners that lie above it by now."""
    x, y = point
    while len(corners) > 1:
        (x0, y0), (x1, y1) = corners[-2:]
        if (y1 - y0) * (x - x0) < (y - y0) * (x1 - x0):
            break
        corners.pop()
    corners.append(point)
