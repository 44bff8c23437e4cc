"""The figures of a drift over temperature: bias on both legs with its curve, and what the curve leaves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL
from tumble.procedures.thermal.result import AxisDrift, ThermalBlocks
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import HALF_WIDTH, box, largest, value_axis_in
from tumble.report.numbers import readable_scale
from tumble.report.panel import horizontal_axis
from tumble.report.svg import AXIS_COLOURS, AXIS_MARKERS, SOFT, inline_svg

_BEYOND = 0.06
"""Share of the range that is drawn on either side, where the edge is held."""
_POINTS = 160


def drift_figure(axes: Sequence[AxisDrift], blocks: ThermalBlocks, prefix: str) -> Markup:
    """Draws the bias of a triad over temperature, and below it what its curves leave."""
    label = (
        f"Bias of the {axes[0].triad} over temperature, warming and cooling apart, its curve and what is left"
    )
    return inline_svg(drift_sheet(axes, blocks), prefix, label)


def drift_sheet(axes: Sequence[AxisDrift], blocks: ThermalBlocks) -> Figure:
    """Draws them on a sheet of their own."""
    figure = Figure(HALF_WIDTH, 4.9)
    upper = figure.add_axes(box(HALF_WIDTH, bottom=2.2, height=2.4))
    lower = figure.add_axes(box(HALF_WIDTH, bottom=0.45, height=1.35))
    low, high = axes[0].range
    room = _BEYOND * (high - low)
    temperature = np.linspace(low - room, high + room, _POINTS)
    scale = readable_scale(axes[0].unit, largest(*(axis.change for axis in axes)))
    value_axis_in(upper, scale, "change of bias from the reference", *(axis.change for axis in axes))
    left = [axis.change - axis.bias_at(blocks.temperature) for axis in axes]
    scale_left = readable_scale(axes[0].unit, largest(*left))
    value_axis_in(lower, scale_left, "left by the curve", *left)
    for panel in (upper, lower):
        panel.set_xlim(low - room, high + room)
    horizontal_axis(lower, low - room, high + room, "temperature, °C; dashed: the range ends", most=8)
    for place, axis in enumerate(axes):
        colour = AXIS_COLOURS[place]
        curve, sigma = axis.bias_at(temperature), axis.bias_sigma_at(temperature)
        upper.line(temperature, scale.factor * curve, colour, 1.3)
        for side in (-INTERVAL, INTERVAL):
            upper.line(temperature, scale.factor * (curve + side * sigma), colour, 0.6, dash="2 2")
        for panel, values, factor in (
            (upper, axis.change, scale.factor),
            (lower, left[place], scale_left.factor),
        ):
            _legs(panel, blocks, factor * values, place)
    for panel in (upper, lower):
        _edges(panel, axes[0].range)
    return figure


def _legs(panel: Axes, blocks: ThermalBlocks, values: FloatArray, place: int) -> None:
    """Draws readings while warming filled, while cooling hollow."""
    warm = blocks.leg > 0.0
    for chosen, hollow in ((warm, False), (~warm, True)):
        if chosen.any():
            panel.points(
                blocks.temperature[chosen],
                values[chosen],
                AXIS_COLOURS[place],
                AXIS_MARKERS[place],
                3.2,
                hollow=hollow,
            )


def _edges(panel: Axes, ends: tuple[float, float]) -> None:
    height = np.array(panel.get_ylim())
    for end in ends:
        panel.line(np.array([end, end]), height, SOFT, 0.7, dash="3 3")
