"""Two pictures of where things are: the robot from above, and the biases of several spins side by side."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from tumble.foundation.recording import FloatArray
from tumble.procedures.spin.report.parameters import parameter_named
from tumble.procedures.spin.result import BiasEstimate, Spin, SpinResult
from tumble.report.canvas import Axes, Figure, Side
from tumble.report.figures import HALF_WIDTH, LABEL_ROOM, box, largest, value_axis_in
from tumble.report.numbers import measurement, readable_scale
from tumble.report.panel import category_axis, error_bars
from tumble.report.svg import (
    ALARM,
    AXIS_COLOURS,
    AXIS_MARKERS,
    INK,
    PANEL,
    SOFT,
    X_AXIS,
    Z_AXIS,
    inline_svg,
)

_SIDE_BY_SIDE = (-0.2, 0.0, 0.2)
_REACH = 1.8
"""Inches that the sketch reaches up and down from the turning axis; one unit of it is an inch."""


@dataclass(frozen=True, slots=True)
class LeverArm:
    """Where the IMU sits from the turning axis, floor frame."""

    forward: float
    left: float
    """m."""
    forward_sigma: float
    left_sigma: float
    """m, 1-sigma."""


def lever_arm(spin: Spin) -> LeverArm | None:
    """Turns the lever arm into the floor frame; None where the data do not show it."""
    found = [parameter_named(spin, f"lever arm {axis}") for axis in "xyz"]
    known = [each for each in found if each is not None]
    if len(known) < 3:
        return None
    arm = np.array([each.value for each in known])
    sigma = np.array([each.sigma for each in known])
    forward = np.array([1.0, 0.0, 0.0]) - spin.up[0] * spin.up
    forward = forward / np.linalg.norm(forward)
    left = np.cross(spin.up, forward)
    return LeverArm(
        float(forward @ arm),
        float(left @ arm),
        float(np.linalg.norm(forward * sigma)),
        float(np.linalg.norm(left * sigma)),
    )


def top_view_figure(spin: Spin, prefix: str) -> Markup:
    """Draws the robot from above: forward, uphill, the turning axis and the IMU with its 1-sigma ellipse."""
    figure = Figure(HALF_WIDTH, 2 * _REACH)
    axes = figure.add_axes((0.0, 0.0, HALF_WIDTH, 2 * _REACH))
    axes.set_xlim(-HALF_WIDTH / 2, HALF_WIDTH / 2)
    axes.set_ylim(-_REACH, _REACH)
    # Forward is upwards on paper, so left is to the left: x = -left, y = forward.
    axes.rounded((-0.8, -0.95, 1.6, 1.9), 18.0, PANEL, SOFT)
    _arrow(axes, (0.0, 0.66), (0.0, 0.9), INK)
    axes.text(0.1, 0.78, "forward", ha="left", va="center", size=8, color=INK)
    axes.line([-0.07, 0.07, np.nan, 0.0, 0.0], [0.0, 0.0, np.nan, -0.07, 0.07], INK, 1.2)
    arm = lever_arm(spin)
    _draw_uphill(axes, spin)
    if arm is not None:
        _draw_arm(axes, arm)
    return inline_svg(figure, prefix, f"{spin.label}: the robot from above. {top_view_caption(spin)}")


def top_view_caption(spin: Spin) -> str:
    """Describes the sketch in words."""
    tilt, uphill = parameter_named(spin, "floor tilt"), parameter_named(spin, "uphill bearing")
    arm = lever_arm(spin)
    floor = (
        "Floor tilt: not observable."
        if tilt is None
        else f"Floor tilt {measurement(tilt.value, tilt.sigma, tilt.unit)}"
        + (
            "; the uphill direction is not observable."
            if uphill is None
            else f", uphill {measurement(uphill.value, uphill.sigma, uphill.unit)} counter-clockwise from "
            "forward as the robot first stood."
        )
    )
    if arm is None:
        return f"{floor} Lever arm: not observable."
    scale = readable_scale("m", max(abs(arm.forward), abs(arm.left)))
    forward = measurement(scale.factor * arm.forward, scale.factor * arm.forward_sigma, scale.unit)
    left = measurement(scale.factor * arm.left, scale.factor * arm.left_sigma, scale.unit)
    return f"{floor} The IMU is {forward} forward and {left} left of the turning axis."


def spins_figure(result: SpinResult, prefix: str) -> Markup:
    """Draws how far the biases of each spin are from those of all spins, and the 1-sigma band of these."""
    figure = Figure(2 * HALF_WIDTH, 2.75)
    panels = (
        ("accelerometer", "m/s^2", result.accelerometer_bias, [s.accelerometer_bias for s in result.spins]),
        ("gyroscope", "rad/s", result.gyroscope_bias, [s.gyroscope_bias for s in result.spins]),
    )
    place = np.arange(len(result.spins), dtype=float)
    for side, (name, unit, combined, biases) in enumerate(panels):
        left, bottom, width, height = box(HALF_WIDTH, bottom=LABEL_ROOM, height=1.8)
        axes = figure.add_axes((left + side * HALF_WIDTH, bottom, width - 0.1, height))
        values = np.array([_known(bias, bias.value) for bias in biases]) - _known(combined, combined.value)
        sigma = np.array([_known(bias, bias.sigma) for bias in biases])
        band = _known(combined, combined.sigma)
        scale = readable_scale(unit, largest(values, sigma, band))
        value_axis_in(axes, scale, f"{name} bias, less that of all", values - sigma, values + sigma, band)
        category_axis(axes, [spin.label for spin in result.spins])
        for axis, (colour, marker, aside) in enumerate(
            zip(AXIS_COLOURS, AXIS_MARKERS, _SIDE_BY_SIDE, strict=True)
        ):
            error_bars(
                axes, place + aside, scale.factor * values[:, axis], scale.factor * sigma[:, axis], colour
            )
            axes.points(place + aside, scale.factor * values[:, axis], colour, marker)
        if np.all(np.isfinite(band)):
            reach = scale.factor * float(np.max(band))
            axes.band(-reach, reach, PANEL)
    return inline_svg(
        figure, prefix, f"Biases of {len(result.spins)} spins, less those of all spins together"
    )


def _known(bias: BiasEstimate, values: FloatArray) -> FloatArray:
    return values if bias.observable else np.full(3, np.nan)


def _draw_uphill(axes: Axes, spin: Spin) -> None:
    tilt, uphill = parameter_named(spin, "floor tilt"), parameter_named(spin, "uphill bearing")
    if tilt is None or uphill is None:
        return
    bearing = math.radians(uphill.value)
    right, up = -math.sin(bearing), math.cos(bearing)
    _arrow(axes, (1.2 * right, 1.2 * up), (1.46 * right, 1.46 * up), Z_AXIS)
    text = f"uphill\n{measurement(tilt.value, tilt.sigma, tilt.unit)}"
    aside: Side = "right" if right < -0.3 else "left" if right > 0.3 else "center"
    axes.text(1.54 * right, 1.6 * up, text, ha=aside, va="center", size=8, color=Z_AXIS)


def _draw_arm(axes: Axes, arm: LeverArm) -> None:
    spread = max(arm.forward_sigma, arm.left_sigma)
    # Arm and ellipse together take a third of the robot, whatever they are: the size of the robot is unknown.
    factor = 0.55 / (math.hypot(arm.forward, arm.left) + spread)
    right, up = -factor * arm.left, factor * arm.forward
    axes.line([0.0, right], [0.0, up], X_AXIS, 1.2)
    angle = np.linspace(0.0, 2.0 * np.pi, 61)
    axes.line(
        right + factor * arm.left_sigma * np.cos(angle),
        up + factor * arm.forward_sigma * np.sin(angle),
        ALARM,
    )
    axes.points(np.array([right]), np.array([up]), X_AXIS, "o")
    beside = right + factor * arm.left_sigma + 0.08
    axes.text(beside, up, "IMU", ha="left", va="center", size=8, color=X_AXIS)


def _arrow(axes: Axes, tail: tuple[float, float], head: tuple[float, float], colour: str) -> None:
    along = np.array(head) - np.array(tail)
    along /= np.linalg.norm(along)
    aside = np.array([-along[1], along[0]])
    barbs = [np.array(head) - 0.12 * along + sign * 0.06 * aside for sign in (1.0, -1.0)]
    axes.line([tail[0], head[0]], [tail[1], head[1]], colour, 1.4)
    corners = [barbs[0], np.array(head), barbs[1]]
    axes.line([c[0] for c in corners], [c[1] for c in corners], colour, 1.4)
