"""Figures of a triad that was calibrated by a vector of constant length: directions, lengths, influence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FloatArray
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import (
    CALIBRATED,
    COMPENSATED,
    FULL_WIDTH,
    HALF_WIDTH,
    UNCOMPENSATED,
    box,
    largest,
    value_axis_in,
)
from tumble.report.numbers import readable_scale
from tumble.report.panel import LABEL_SIZE, category_axis, error_bars, value_axis
from tumble.report.svg import ALARM, GRID, INK, SOFT, X_AXIS

_SIDE = 2.5
"""Inches, of one half of the sphere."""
_RINGS = (30.0, 60.0, 90.0)
"""Degrees from the pole."""


@dataclass(frozen=True, slots=True)
class LengthErrors:
    """Length of a vector minus its known length, of each reading."""

    unit: str
    known: str
    """Name of the known length: `gravity`."""
    before: FloatArray
    """(k,) raw, in `unit`."""
    after: FloatArray
    """(k,) calibrated."""
    sigma: FloatArray
    """(k,) 1-sigma of it from noise."""
    held_out: FloatArray
    """(k,) by a fit without that direction, NaN where the others do not carry one."""


def sphere(
    directions: FloatArray, strong: NDArray[np.bool_], advised: FloatArray | None, titles: tuple[str, str]
) -> Figure:
    """Draws unit vectors (k, 3) on both halves of the sphere, `strong` ones apart, and the one to add."""
    figure = Figure(HALF_WIDTH, _SIDE + 0.75)
    gap = (HALF_WIDTH - 2 * _SIDE) / 3
    for side, sign in enumerate((1.0, -1.0)):
        axes = figure.add_axes((gap + side * (_SIDE + gap), 0.3, _SIDE, _SIDE))
        _draw_half(axes, titles[side])
        chosen = directions[:, 2] * sign >= 0.0
        places = flattened(directions[chosen])
        marked = strong[chosen]
        axes.points(places[~marked, 0], places[~marked, 1], X_AXIS, "o", 4.0)
        axes.points(places[marked, 0], places[marked, 1], INK, "s", 4.5)
        if advised is not None and advised[2] * sign >= 0.0:
            place = flattened(advised.reshape(1, 3))
            axes.points(place[:, 0], place[:, 1], ALARM, "D", 7.0, hollow=True)
    return figure


def length_errors(errors: LengthErrors) -> Figure:
    """Draws lengths minus the known one: raw above; calibrated, and by a fit without each, below."""
    figure = Figure(FULL_WIDTH, 4.2)
    upper = figure.add_axes(box(FULL_WIDTH, bottom=2.5, height=1.35))
    lower = figure.add_axes(box(FULL_WIDTH, bottom=0.55, height=1.4))
    place = np.arange(len(errors.before), dtype=float)
    scale = readable_scale(errors.unit, largest(errors.before))
    value_axis_in(upper, scale, f"raw, |y| minus {errors.known}", errors.before)
    upper.set_xlim(-0.6, len(place) - 0.4)
    upper.points(place, scale.factor * errors.before, UNCOMPENSATED, "o", hollow=True)
    after, sigma = errors.after, errors.sigma
    known = errors.held_out[np.isfinite(errors.held_out)]
    scale = readable_scale(errors.unit, largest(after, known))
    value_axis_in(lower, scale, f"calibrated, |u| minus {errors.known}", after - sigma, after + sigma, known)
    error_bars(lower, place - 0.1, scale.factor * after, scale.factor * sigma, COMPENSATED)
    lower.points(place - 0.1, scale.factor * after, COMPENSATED, "D")
    lower.points(place + 0.1, scale.factor * errors.held_out, CALIBRATED, "o", hollow=True)
    category_axis(lower, _labels(len(place)), most=40)
    return figure


def influence_bars(influence: FloatArray) -> Figure:
    """Draws by how many sigmas a parameter would change without each of (k,) readings.

    A bar of one without which a parameter is not known at all ends at the upper edge.
    """
    figure = Figure(HALF_WIDTH, _SIDE + 0.75)
    axes = figure.add_axes(box(HALF_WIDTH, bottom=0.6, height=_SIDE - 0.1))
    high = max(1.2, 1.08 * largest(influence))
    value_axis(axes, 0.0, high, "largest change without it, sigmas")
    category_axis(axes, _labels(len(influence)), most=20)
    for place, height in enumerate(np.minimum(influence, high)):
        if not np.isnan(height):
            axes.bars([(place - 0.35, place + 0.35)], 0.0, float(height), INK if height > 1.0 else X_AXIS)
    return figure


def flattened(ups: FloatArray) -> FloatArray:
    """Projects directions (k, 3) of a half sphere to a disk (k, 2) of equal areas; its edge is level.

    Lambert's azimuthal projection, scaled to 1 at 90 deg from the pole.
    """
    height = np.abs(ups[:, 2:])
    return np.asarray(ups[:, :2] / np.sqrt(1.0 + height))


def _draw_half(axes: Axes, title: str) -> None:
    axes.set_xlim(-1.15, 1.15)
    axes.set_ylim(-1.15, 1.15)
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    for ring in _RINGS:
        radius = np.sqrt(2.0) * np.sin(np.radians(ring) / 2.0)
        axes.line(radius * np.cos(angle), radius * np.sin(angle), SOFT if ring == 90.0 else GRID, 0.8)
    axes.line(np.array([-1.0, 1.0]), np.zeros(2), GRID, 0.6)
    axes.line(np.zeros(2), np.array([-1.0, 1.0]), GRID, 0.6)
    for x, y, label in ((1.08, 0.0, "x"), (0.0, 1.08, "y")):
        axes.text(x, y, label, frames=("data", "data"), ha="center", va="center", size=LABEL_SIZE, color=SOFT)
    axes.text(0, 1, title, frames=("panel", "panel"), shift=(0, 5), size=LABEL_SIZE + 0.5, color=INK)


def _labels(count: int) -> list[str]:
    return [str(number) for number in range(1, count + 1)]
