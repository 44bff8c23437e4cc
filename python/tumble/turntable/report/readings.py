"""The readings of one axis at the poses, before and after compensation."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from tumble.recording import FloatArray
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import (
    COMPENSATED,
    HALF_WIDTH,
    LABEL_ROOM,
    UNCOMPENSATED,
    box,
    largest,
    value_axis_in,
)
from tumble.report.numbers import Scale, readable_scale
from tumble.report.panel import category_axis, error_bars, segments, span, value_axis
from tumble.report.svg import SOFT, inline_svg
from tumble.turntable.result import AxisReading


def axis_reading_figure(reading: AxisReading, prefix: str) -> Markup:
    """Draw the readings of one axis over the poses, and below them how far each is from its ideal."""
    figure = Figure(HALF_WIDTH, 3.65)
    upper = figure.add_axes(box(HALF_WIDTH, bottom=2.35, height=1.05))
    lower = figure.add_axes(box(HALF_WIDTH, bottom=LABEL_ROOM + 0.06, height=1.3))
    place = np.arange(len(reading.labels), dtype=float)

    low, high = span(reading.ideal, reading.uncompensated, reading.compensated, at_least=(0.0,), margin=0.12)
    value_axis(upper, low, high, "reading, m/s²", most=4)
    upper.set_xlim(-0.6, len(place) - 0.4)
    segments(upper, place - 0.32, reading.ideal, place + 0.32, reading.ideal, SOFT, 1.2)
    _draw_readings(upper, place, reading.uncompensated, reading.compensated, np.zeros_like(place))

    before, after = deviations(reading)
    scale = deviation_scale(reading)
    value_axis_in(lower, scale, "deviation from the ideal", before, after)
    category_axis(lower, reading.labels)
    _draw_readings(lower, place, scale.factor * before, scale.factor * after, scale.factor * reading.sigma)
    label = (
        f"Readings of the {reading.axis} axis at {len(place)} rests, with and without mounting compensation, "
        f"and their deviation from the ideal in {scale.unit}"
    )
    return inline_svg(figure, prefix, label)


def deviations(reading: AxisReading) -> tuple[FloatArray, FloatArray]:
    """Return reading minus ideal, without and with compensation: (k,) m/s^2 each."""
    return reading.uncompensated - reading.ideal, reading.compensated - reading.ideal


def deviation_scale(reading: AxisReading) -> Scale:
    """Choose the unit that deviations of this axis are shown in, in its figure and in what is said of it."""
    return readable_scale("m/s^2", largest(*deviations(reading)))


def _draw_readings(
    axes: Axes, place: FloatArray, before: FloatArray, after: FloatArray, sigma: FloatArray
) -> None:
    error_bars(axes, place - 0.12, before, sigma, UNCOMPENSATED)
    error_bars(axes, place + 0.12, after, sigma, COMPENSATED)
    axes.points(place - 0.12, before, UNCOMPENSATED, "o", hollow=True)
    axes.points(place + 0.12, after, COMPENSATED, "D")
