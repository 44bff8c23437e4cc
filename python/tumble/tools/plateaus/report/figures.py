"""The figure of a triad over temperature: bias and scale at the plateaus, and their curves."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from tumble.foundation.recording import FloatArray
from tumble.foundation.results import INTERVAL
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import HALF_WIDTH, box, value_axis_in
from tumble.report.numbers import Scale, readable_scale
from tumble.report.panel import error_bars, horizontal_axis
from tumble.report.svg import AXIS_COLOURS, AXIS_MARKERS, SOFT, inline_svg
from tumble.tools.plateaus.result import TriadOverTemperature

_BEYOND = 0.06
"""Share of the range that is drawn on either side, where the edge is held."""
_POINTS = 120


def curves_figure(triad: TriadOverTemperature, prefix: str) -> Markup:
    """Draws the change of bias over temperature, and below it that of scale."""
    label = f"Bias and scale of the {triad.triad} over temperature, with the curves that were found"
    return inline_svg(curves_sheet(triad), prefix, label)


def curves_sheet(triad: TriadOverTemperature) -> Figure:
    """Draws them on a sheet of their own."""
    figure = Figure(HALF_WIDTH, 4.9)
    upper = figure.add_axes(box(HALF_WIDTH, bottom=2.75, height=1.85))
    lower = figure.add_axes(box(HALF_WIDTH, bottom=0.45, height=1.85))
    low, high = triad.range
    room = _BEYOND * (high - low)
    temperature = np.linspace(low - room, high + room, _POINTS)
    curves, sigma = triad.at(temperature)
    curves = curves - np.concatenate([np.zeros(3), triad.b])
    lengths = np.linalg.norm(triad.measured[:, :9].reshape(-1, 3, 3), axis=2)
    scales = lengths / np.linalg.norm(triad.M, axis=1) - 1.0
    biases = triad.measured[:, 9:] - triad.b
    bias_unit = readable_scale(triad.unit, float(np.abs(biases).max()))
    scale_unit = readable_scale("1", float(np.abs(scales).max()))
    value_axis_in(upper, bias_unit, "change of bias from the reference", biases, curves[:, 3:])
    value_axis_in(lower, scale_unit, "change of scale", scales, curves[:, :3])
    upper.set_xlim(low - room, high + room)
    horizontal_axis(lower, low - room, high + room, "temperature, °C; dashed: the range ends", most=8)
    for panel, unit, values, first, bars in (
        (upper, bias_unit, biases, 3, triad.measured_sigma[:, 9:]),
        (lower, scale_unit, scales, 0, None),
    ):
        for axis in range(3):
            place = first + axis
            _curve(panel, unit, temperature, curves[:, place], sigma[:, place], axis)
            _points(panel, unit, triad, values[:, axis], None if bars is None else bars[:, axis], axis)
        _edges(panel, triad.range)
    return figure


def _curve(
    panel: Axes, unit: Scale, temperature: FloatArray, curve: FloatArray, sigma: FloatArray, axis: int
) -> None:
    colour = AXIS_COLOURS[axis]
    panel.line(temperature, unit.factor * curve, colour, 1.3)
    for side in (-INTERVAL, INTERVAL):
        panel.line(temperature, unit.factor * (curve + side * sigma), colour, 0.6, dash="2 2")


def _points(
    panel: Axes,
    unit: Scale,
    triad: TriadOverTemperature,
    values: FloatArray,
    sigma: FloatArray | None,
    axis: int,
) -> None:
    """Draws plateaus reached by warming filled, by cooling hollow."""
    if sigma is not None:
        error_bars(panel, triad.temperatures, unit.factor * values, unit.factor * sigma, AXIS_COLOURS[axis])
    cooled = triad.legs < 0.0
    for chosen, hollow in ((~cooled, False), (cooled, True)):
        if chosen.any():
            panel.points(
                triad.temperatures[chosen],
                unit.factor * values[chosen],
                AXIS_COLOURS[axis],
                AXIS_MARKERS[axis],
                4.0,
                hollow=hollow,
            )


def _edges(panel: Axes, ends: tuple[float, float]) -> None:
    height = np.array(panel.get_ylim())
    for end in ends:
        panel.line(np.array([end, end]), height, SOFT, 0.7, dash="3 3")
