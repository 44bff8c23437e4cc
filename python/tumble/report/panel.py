"""Panels of all figures: axes with grid lines and labels, points, bars and lines in common measures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.report.canvas import Axes, AxisScale
from tumble.report.numbers import MINUS
from tumble.report.svg import GRID, INK, SOFT

LABEL_SIZE = 7.5
LONGEST_NAME = 16
"""Letters of a name for which figures have room."""

_MOST_LOG_TICKS = 9
_TICK_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)


def span(*arrays: FloatArray, at_least: Sequence[float] = (), margin: float = 0.08) -> tuple[float, float]:
    """Returns the lowest and highest finite number of all arrays and of `at_least`, with a margin."""
    numbers = np.concatenate([np.ravel(array) for array in (*arrays, np.asarray(at_least, dtype=float))])
    numbers = numbers[np.isfinite(numbers)]
    if numbers.size == 0:
        return -1.0, 1.0
    low, high = float(numbers.min()), float(numbers.max())
    room = (high - low) * margin or max(abs(high), 1.0) * margin
    return low - room, high + room


def ticks_between(low: float, high: float, most: int) -> list[float]:
    """Chooses round numbers inside the interval, at most about `most` of them."""
    raw = (high - low) / most
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(step * power for step in _TICK_STEPS if step * power >= raw * (1.0 - 1e-9))
    multiples = range(math.ceil(low / step), math.floor(high / step) + 1)
    return [multiple * step for multiple in multiples if low <= multiple * step <= high]


def tick_texts(ticks: Sequence[float]) -> list[str]:
    """Prints the ticks with as many decimals as distinguish them, and a true minus sign."""
    step = min((abs(b - a) for a, b in pairwise(ticks)), default=1.0)
    decimals = next((n for n in range(12) if abs(round(step, n) - step) < 1e-3 * step), 12)
    texts = [f"{0.0 if abs(tick) < 1e-9 * step else tick:.{decimals}f}" for tick in ticks]
    return [text.replace("-", MINUS) for text in texts]


def value_axis(axes: Axes, low: float, high: float, title: str, *, most: int = 5) -> None:
    """Sets the vertical range, with grid lines, numbers at the left and the quantity and its unit above."""
    axes.set_ylim(low, high)
    ticks = ticks_between(low, high, most)
    numbered_value_axis(axes, ticks, tick_texts(ticks), title)
    axes.grid(ticks, "y", GRID, zero=SOFT)


def numbered_value_axis(axes: Axes, ticks: Sequence[float], texts: Sequence[str], title: str) -> None:
    """Writes numbers at the left, and the quantity and its unit above."""
    axes.scales["y"] = AxisScale(ticks, texts, title)
    for tick, text in zip(ticks, texts, strict=True):
        axes.text(
            0,
            tick,
            text,
            frames=("panel", "data"),
            shift=(-4, 0),
            ha="right",
            va="center",
            size=LABEL_SIZE,
            color=SOFT,
            of_axis=True,
        )
    axes.text(
        0, 1, title, frames=("panel", "panel"), shift=(0, 5), size=LABEL_SIZE + 0.5, color=INK, of_axis=True
    )


def horizontal_axis(
    axes: Axes,
    low: float,
    high: float,
    title: str,
    *,
    most: int = 8,
    ticks: Sequence[float] = (),
    zero: str = "",
) -> None:
    """Sets the horizontal range, with grid lines, numbers below and the quantity and its unit below them.

    `ticks` are the numbers to write; where there are none, round ones are chosen, at most about `most`.
    `zero` is the colour of the line at zero, where that is more than any other number.
    """
    axes.set_xlim(low, high)
    ticks = ticks or ticks_between(low, high, most)
    axes.grid(ticks, "x", GRID, zero=zero)
    numbered_horizontal_axis(axes, ticks, tick_texts(ticks), title)


def log_axis(axes: Axes, low: float, high: float, title: str) -> None:
    """Sets a horizontal axis of decadic logarithms that holds both ends, decades written as numbers."""
    first, last = math.floor(math.log10(low) + 0.05), math.ceil(math.log10(high) - 0.05)
    decades = range(first, last + 1)
    axes.set_xlim(min(first, math.log10(low)) - 0.05, max(last, math.log10(high)) + 0.05)
    axes.grid(decades, "x", GRID)
    numbered_horizontal_axis(
        axes, decades, [f"{10.0**decade:.{max(0, -decade)}f}" for decade in decades], title
    )
    axes.scales["x"].logarithmic = True


def log_value_axis(axes: Axes, low: float, high: float, title: str) -> None:
    """Sets a vertical range of decadic logarithms, with grid lines at 1, 2 and 5 of each decade."""
    axes.set_ylim(low, high)
    decades = range(math.floor(low), math.ceil(high) + 1)
    numbers = [(digit, decade) for decade in decades for digit in (1, 2, 5)]
    inside = [each for each in numbers if low <= math.log10(each[0]) + each[1] <= high]
    if len(inside) > _MOST_LOG_TICKS:
        inside = [each for each in inside if each[0] == 1]
    ticks = [math.log10(digit) + decade for digit, decade in inside]
    texts = [f"{digit}e{decade}".replace("-", MINUS) for digit, decade in inside]
    axes.grid(ticks, "y", GRID)
    numbered_value_axis(axes, ticks, texts, title)
    axes.scales["y"].logarithmic = True


def numbered_horizontal_axis(axes: Axes, ticks: Sequence[float], texts: Sequence[str], title: str) -> None:
    """Writes numbers below, and the quantity and its unit below them."""
    axes.scales["x"] = AxisScale(ticks, texts, title)
    for tick, text in zip(ticks, texts, strict=True):
        axes.text(
            tick,
            0,
            text,
            frames=("data", "panel"),
            shift=(0, -4),
            ha="center",
            va="top",
            size=LABEL_SIZE,
            color=SOFT,
            of_axis=True,
        )
    axes.text(
        0.5,
        0,
        title,
        frames=("panel", "panel"),
        shift=(0, -15),
        ha="center",
        va="top",
        size=LABEL_SIZE,
        color=INK,
        of_axis=True,
    )


def category_axis(axes: Axes, labels: Sequence[str], *, most: int = 14) -> None:
    """Names the places 0, 1, 2 ... along the bottom; of many names only every so-manyth is written."""
    axes.set_xlim(-0.6, len(labels) - 0.4)
    stride = max(1, -(-len(labels) // most))
    shown = list(enumerate(labels))[::stride]
    axes.scales["x"] = AxisScale([place for place, _ in shown], [label for _, label in shown])
    for place, label in shown:
        axes.text(
            place,
            0,
            short(label),
            frames=("data", "panel"),
            shift=(3, -4),
            ha="right",
            va="top",
            rotation=35,
            size=LABEL_SIZE,
            color=SOFT,
            of_axis=True,
        )


def short(name: str, longest: int = LONGEST_NAME) -> str:
    """Cuts a name that has no room in a figure."""
    return name if len(name) <= longest else f"{name[: longest - 1]}…"


def row_labels(axes: Axes, labels: Sequence[str]) -> None:
    """Writes the names of the rows 0, 1, 2 ... at the left."""
    for row, label in enumerate(labels):
        row_label(axes, row, label, LABEL_SIZE)


def row_label(axes: Axes, height: float, label: str, size: float) -> None:
    """Writes a name at the left, at that height."""
    axes.text(
        0,
        height,
        label,
        frames=("panel", "data"),
        shift=(-6, 0),
        ha="right",
        va="center",
        size=size,
        color=INK,
    )


def error_bars(axes: Axes, x: FloatArray, y: FloatArray, sigma: FloatArray, colour: str) -> None:
    """Draws vertical bars of one sigma, all in one path. Shapes (k,), units of the axes."""
    segments(axes, x, y - sigma, x, y + sigma, colour, 1.1)


def segments(
    axes: Axes,
    x_from: FloatArray,
    y_from: FloatArray,
    x_to: FloatArray,
    y_to: FloatArray,
    colour: str,
    width: float,
) -> None:
    """Draws straight lines from point to point, all in one path. Shapes (k,)."""
    gap = np.full_like(x_from, np.nan)
    across = np.column_stack([x_from, x_to, gap]).ravel()
    up = np.column_stack([y_from, y_to, gap]).ravel()
    axes.line(across, up, colour, width, order=1.5)
