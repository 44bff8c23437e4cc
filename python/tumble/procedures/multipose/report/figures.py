"""The figures of a multi-pose calibration: orientations on the sphere, gravity at rests and after turns."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from tumble.foundation.recording import FloatArray
from tumble.procedures.multipose.result import MultiposeResult
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import (
    CALIBRATED,
    COMPENSATED,
    FULL_WIDTH,
    HALF_WIDTH,
    UNCOMPENSATED,
    box,
    value_axis_in,
)
from tumble.report.numbers import readable_scale
from tumble.report.panel import LABEL_SIZE, category_axis, error_bars, value_axis
from tumble.report.svg import ALARM, GRID, INK, SOFT, X_AXIS, inline_svg

_SIDE = 2.5
"""Inches, of one half of the sphere."""
_RINGS = (30.0, 60.0, 90.0)
"""Degrees from the pole."""


def sphere_figure(result: MultiposeResult, prefix: str) -> Markup:
    """Draws which direction was up at each rest, on both halves of the sphere, and the next to add."""
    figure = Figure(HALF_WIDTH, _SIDE + 0.75)
    gap = (HALF_WIDTH - 2 * _SIDE) / 3
    ups = np.array([pose.up for pose in result.poses]).reshape(-1, 3)
    influence = np.array([pose.influence for pose in result.poses])
    for side, sign in enumerate((1.0, -1.0)):
        axes = figure.add_axes((gap + side * (_SIDE + gap), 0.3, _SIDE, _SIDE))
        _draw_half(axes, "+z up" if sign > 0 else "-z up")
        chosen = ups[:, 2] * sign >= 0.0
        places = flattened(ups[chosen])
        strong = influence[chosen] > 1.0
        axes.points(places[~strong, 0], places[~strong, 1], X_AXIS, "o", 4.0)
        axes.points(places[strong, 0], places[strong, 1], INK, "s", 4.5)
        found = result.advised_orientation
        if found is not None and found.up[2] * sign >= 0.0:
            place = flattened(found.up.reshape(1, 3))
            axes.points(place[:, 0], place[:, 1], ALARM, "D", 7.0, hollow=True)
    return inline_svg(
        figure,
        prefix,
        f"Orientations of {len(result.poses)} rests on both halves of the sphere, and the next",
    )


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


def norm_figure(result: MultiposeResult, prefix: str) -> Markup:
    """Draws |specific force| minus gravity at each rest: raw, calibrated, and by a fit without it."""
    figure = Figure(FULL_WIDTH, 4.2)
    upper = figure.add_axes(box(FULL_WIDTH, bottom=2.5, height=1.35))
    lower = figure.add_axes(box(FULL_WIDTH, bottom=0.55, height=1.4))
    place = np.arange(len(result.poses), dtype=float)
    before, after, held_out, sigma = (
        np.array([getattr(pose, name) for pose in result.poses])
        for name in ("before", "after", "held_out", "sigma")
    )
    scale = readable_scale("m/s^2", float(np.abs(before).max()))
    value_axis_in(upper, scale, "raw, |y| minus gravity", before)
    upper.set_xlim(-0.6, len(place) - 0.4)
    upper.points(place, scale.factor * before, UNCOMPENSATED, "o", hollow=True)
    known = held_out[np.isfinite(held_out)]
    scale = readable_scale("m/s^2", float(np.abs(np.concatenate([after, known])).max()))
    value_axis_in(lower, scale, "calibrated, |u| minus gravity", after - sigma, after + sigma, known)
    error_bars(lower, place - 0.1, scale.factor * after, scale.factor * sigma, COMPENSATED)
    lower.points(place - 0.1, scale.factor * after, COMPENSATED, "D")
    lower.points(place + 0.1, scale.factor * held_out, CALIBRATED, "o", hollow=True)
    category_axis(lower, _labels(len(place)), most=40)
    return inline_svg(figure, prefix, "Length of specific force minus gravity at each rest, before and after")


def influence_figure(result: MultiposeResult, prefix: str) -> Markup:
    """Draw by how much the result would change without each rest."""
    figure = Figure(HALF_WIDTH, _SIDE + 0.75)
    axes = figure.add_axes(box(HALF_WIDTH, bottom=0.6, height=_SIDE - 0.1))
    influence = np.array([pose.influence for pose in result.poses])
    value_axis(axes, 0.0, max(1.2, 1.08 * float(influence.max())), "largest change without it, sigmas")
    category_axis(axes, _labels(len(influence)), most=20)
    for place, height in enumerate(influence):
        axes.bars([(place - 0.35, place + 0.35)], 0.0, float(height), INK if height > 1.0 else X_AXIS)
    return inline_svg(figure, prefix, "Largest change of a parameter without each rest, in sigmas")


def turn_figure(result: MultiposeResult, prefix: str) -> Markup:
    """Draws the angle between predicted and measured gravity after each turn, raw and calibrated."""
    figure = Figure(FULL_WIDTH, 2.5)
    axes = figure.add_axes(box(FULL_WIDTH, bottom=0.6, height=1.55))
    place = np.arange(len(result.turns), dtype=float)
    before, after = (
        np.degrees([getattr(turn, name) for turn in result.turns]) for name in ("angle_before", "angle")
    )
    scale = readable_scale("deg", float(before.max()))
    value_axis_in(axes, scale, "gravity as turned against gravity as found", before, after)
    axes.points(place - 0.1, scale.factor * before, UNCOMPENSATED, "o", hollow=True)
    axes.points(place + 0.1, scale.factor * after, COMPENSATED, "D")
    category_axis(axes, [f"{turn.before + 1}-{turn.after + 1}" for turn in result.turns], most=40)
    return inline_svg(figure, prefix, "Angle between gravity as turned and as found after each turn")


def _labels(count: int) -> list[str]:
    return [str(number) for number in range(1, count + 1)]
