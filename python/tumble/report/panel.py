"""The few things our figures are made of, drawn on bare axes.

Matplotlib's own ticks take three quarters of the time of a small figure, and a batch draws thousands of
them. Grid lines and labels here are one collection and a few texts.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation, Transform

from tumble.recording import FloatArray
from tumble.report.numbers import MINUS
from tumble.report.svg import GRID, INK, SOFT

Box: TypeAlias = tuple[float, float, float, float]
"""Left, bottom, width and height in inches."""

LABEL_SIZE = 7.5


def bare_axes(figure: Figure, box: Box) -> Axes:
    """Add axes without ticks or frame in a box measured in inches."""
    width, height = figure.get_size_inches()
    left, bottom, box_width, box_height = box
    axes = figure.add_axes((left / width, bottom / height, box_width / width, box_height / height))
    axes.set_axis_off()
    return axes


def span(*arrays: FloatArray, at_least: Sequence[float] = (), margin: float = 0.08) -> tuple[float, float]:
    """Return the lowest and highest finite number of all arrays and of `at_least`, with a margin."""
    numbers = np.concatenate([np.ravel(array) for array in (*arrays, np.asarray(at_least, dtype=float))])
    numbers = numbers[np.isfinite(numbers)]
    if numbers.size == 0:
        return -1.0, 1.0
    low, high = float(numbers.min()), float(numbers.max())
    room = (high - low) * margin or max(abs(high), 1.0) * margin
    return low - room, high + room


def ticks_between(low: float, high: float, most: int) -> list[float]:
    """Choose round numbers inside the interval, at most about `most` of them."""
    locations = MaxNLocator(nbins=most, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    return [float(tick) for tick in locations if low <= tick <= high]


def tick_texts(ticks: Sequence[float]) -> list[str]:
    """Print the ticks with as many decimals as it takes to tell them apart, and a true minus sign."""
    step = min((abs(b - a) for a, b in pairwise(ticks)), default=1.0)
    decimals = next((n for n in range(12) if abs(round(step, n) - step) < 1e-3 * step), 12)
    texts = [f"{0.0 if abs(tick) < 1e-9 * step else tick:.{decimals}f}" for tick in ticks]
    return [text.replace("-", MINUS) for text in texts]


def value_axis(axes: Axes, low: float, high: float, title: str, *, most: int = 5) -> None:
    """Set the vertical range, with grid lines, numbers at the left and the quantity and its unit above."""
    axes.set_ylim(low, high)
    ticks = ticks_between(low, high, most)
    grid = LineCollection(
        [((0.0, tick), (1.0, tick)) for tick in ticks],
        colors=[SOFT if tick == 0 else GRID for tick in ticks],
        linewidths=[0.7 if tick == 0 else 0.6 for tick in ticks],
        transform=axes.get_yaxis_transform(),
        zorder=0,
    )
    axes.add_collection(grid, autolim=False)
    beside = shifted(axes, axes.get_yaxis_transform(), -4, 0)
    for tick, text in zip(ticks, tick_texts(ticks), strict=True):
        axes.text(0, tick, text, transform=beside, ha="right", va="center", size=LABEL_SIZE, color=SOFT)
    above = shifted(axes, axes.transAxes, 0, 5)
    axes.text(0, 1, title, transform=above, ha="left", va="baseline", size=LABEL_SIZE + 0.5, color=INK)


def horizontal_axis(
    axes: Axes, low: float, high: float, title: str, *, most: int = 8, ticks: Sequence[float] = ()
) -> None:
    """Set the horizontal range, with grid lines, numbers below and the quantity and its unit below them.

    `ticks` are the numbers to write; where there are none, round ones are chosen, at most about `most`.
    """
    axes.set_xlim(low, high)
    ticks = ticks or ticks_between(low, high, most)
    grid = LineCollection(
        [((tick, 0.0), (tick, 1.0)) for tick in ticks],
        colors=[SOFT if tick == 0 else GRID for tick in ticks],
        linewidths=[0.7 if tick == 0 else 0.6 for tick in ticks],
        transform=axes.get_xaxis_transform(),
        zorder=0,
    )
    axes.add_collection(grid, autolim=False)
    below = shifted(axes, axes.get_xaxis_transform(), 0, -4)
    for tick, text in zip(ticks, tick_texts(ticks), strict=True):
        axes.text(tick, 0, text, transform=below, ha="center", va="top", size=LABEL_SIZE, color=SOFT)
    further_below = shifted(axes, axes.transAxes, 0, -15)
    axes.text(0.5, 0, title, transform=further_below, ha="center", va="top", size=LABEL_SIZE, color=INK)


def category_axis(axes: Axes, labels: Sequence[str], *, most: int = 14) -> None:
    """Name the places 0, 1, 2 ... along the bottom; of many names only every so-manyth is written."""
    axes.set_xlim(-0.6, len(labels) - 0.4)
    below = shifted(axes, axes.get_xaxis_transform(), 3, -4)
    stride = max(1, -(-len(labels) // most))
    for place, label in list(enumerate(labels))[::stride]:
        axes.text(
            place,
            0,
            label,
            transform=below,
            ha="right",
            va="top",
            rotation=35,
            rotation_mode="anchor",
            size=LABEL_SIZE,
            color=SOFT,
        )


def error_bars(axes: Axes, x: FloatArray, y: FloatArray, sigma: FloatArray, colour: str) -> None:
    """Draw vertical bars of one sigma, all in one path. Shapes (k,), units of the axes."""
    segments(axes, x, y - sigma, x, y + sigma, colour, 1.1)


def markers(
    axes: Axes, x: FloatArray, y: FloatArray, colour: str, marker: str, *, hollow: bool = False
) -> None:
    """Draw unconnected points. Shapes (k,)."""
    axes.plot(
        x,
        y,
        linestyle="none",
        marker=marker,
        markersize=4.2,
        markeredgewidth=1.0,
        markeredgecolor=colour,
        markerfacecolor="none" if hollow else colour,
    )


def log_axis(axes: Axes, low: float, high: float, title: str) -> None:
    """Set a horizontal axis of decadic logarithms that holds both ends, decades written as numbers."""
    first, last = np.floor(np.log10(low) + 0.05), np.ceil(np.log10(high) - 0.05)
    decades = np.arange(first, last + 1)
    axes.set_xlim(min(first, np.log10(low)) - 0.05, max(last, np.log10(high)) + 0.05)
    grid = LineCollection(
        [((decade, 0.0), (decade, 1.0)) for decade in decades],
        colors=GRID,
        linewidths=0.6,
        transform=axes.get_xaxis_transform(),
        zorder=0,
    )
    axes.add_collection(grid, autolim=False)
    below = shifted(axes, axes.get_xaxis_transform(), 0, -4)
    for decade in decades:
        text = f"{10.0**decade:.{max(0, -int(decade))}f}"
        axes.text(decade, 0, text, transform=below, ha="center", va="top", size=LABEL_SIZE, color=SOFT)
    further_below = shifted(axes, axes.transAxes, 0, -15)
    axes.text(0.5, 0, title, transform=further_below, ha="center", va="top", size=LABEL_SIZE, color=INK)


def row_labels(axes: Axes, labels: Sequence[str]) -> None:
    """Write the names of the rows 0, 1, 2 ... at the left."""
    beside = shifted(axes, axes.get_yaxis_transform(), -6, 0)
    for row, label in enumerate(labels):
        axes.text(0, row, label, transform=beside, ha="right", va="center", size=LABEL_SIZE, color=INK)


def segments(
    axes: Axes,
    x_from: FloatArray,
    y_from: FloatArray,
    x_to: FloatArray,
    y_to: FloatArray,
    colour: str,
    width: float,
) -> None:
    """Draw straight lines from point to point, all in one path. Shapes (k,)."""
    gap = np.full_like(x_from, np.nan)
    axes.plot(
        np.column_stack([x_from, x_to, gap]).ravel(),
        np.column_stack([y_from, y_to, gap]).ravel(),
        color=colour,
        linewidth=width,
        zorder=1.5,
    )


def shifted(axes: Axes, transform: Transform, right: float, up: float) -> Transform:
    """Return the transform, moved by that many points on paper."""
    return transform + ScaledTranslation(right / 72, up / 72, axes.figure.dpi_scale_trans)
