"""The figures of a multi-pose calibration: orientations on the sphere, gravity at rests and after turns."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from tumble.procedures.multipose.result import MultiposeResult
from tumble.report.canvas import Figure
from tumble.report.directions import LengthErrors, influence_bars, length_errors, sphere
from tumble.report.figures import COMPENSATED, FULL_WIDTH, UNCOMPENSATED, box, largest, value_axis_in
from tumble.report.numbers import readable_scale
from tumble.report.panel import category_axis
from tumble.report.svg import inline_svg


def sphere_figure(result: MultiposeResult, prefix: str) -> Markup:
    """Draws which direction was up at each rest, on both halves of the sphere, and the next to add."""
    ups = np.array([pose.up for pose in result.poses]).reshape(-1, 3)
    influence = np.array([pose.influence for pose in result.poses])
    found = result.advised_orientation
    return inline_svg(
        sphere(ups, influence > 1.0, None if found is None else found.up, ("+z up", "-z up")),
        prefix,
        f"Orientations of {len(result.poses)} rests on both halves of the sphere, and the next",
    )


def norm_figure(result: MultiposeResult, prefix: str) -> Markup:
    """Draws |specific force| minus gravity at each rest: raw, calibrated, and by a fit without it."""
    before, after, held_out, sigma = (
        np.array([getattr(pose, name) for pose in result.poses])
        for name in ("before", "after", "held_out", "sigma")
    )
    figure = length_errors(LengthErrors("m/s^2", "gravity", before, after, sigma, held_out))
    return inline_svg(figure, prefix, "Length of specific force minus gravity at each rest, before and after")


def influence_figure(result: MultiposeResult, prefix: str) -> Markup:
    """Draw by how much the result would change without each rest."""
    figure = influence_bars(np.array([pose.influence for pose in result.poses]))
    return inline_svg(figure, prefix, "Largest change of a parameter without each rest, in sigmas")


def turn_figure(result: MultiposeResult, prefix: str) -> Markup:
    """Draws the angle between predicted and measured gravity after each turn, raw and calibrated."""
    figure = Figure(FULL_WIDTH, 2.5)
    axes = figure.add_axes(box(FULL_WIDTH, bottom=0.6, height=1.55))
    place = np.arange(len(result.turns), dtype=float)
    before, after = (
        np.degrees([getattr(turn, name) for turn in result.turns]) for name in ("angle_before", "angle")
    )
    scale = readable_scale("deg", largest(before))
    value_axis_in(axes, scale, "gravity as turned against gravity as found", before, after)
    axes.points(place - 0.1, scale.factor * before, UNCOMPENSATED, "o", hollow=True)
    axes.points(place + 0.1, scale.factor * after, COMPENSATED, "D")
    category_axis(axes, [f"{turn.before + 1}-{turn.after + 1}" for turn in result.turns], most=40)
    return inline_svg(figure, prefix, "Angle between gravity as turned and as found after each turn")
