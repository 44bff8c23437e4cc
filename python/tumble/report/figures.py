"""The figures of one recording: residuals, rests found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from tumble.foundation.log_time import LogTime
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Rest, Trace, TriadResult
from tumble.report.canvas import Axes, Box, Figure
from tumble.report.numbers import Scale, readable_scale
from tumble.report.panel import (
    category_axis,
    error_bars,
    horizontal_axis,
    short,
    span,
    value_axis,
)
from tumble.report.svg import (
    ALARM,
    AXIS_COLOURS,
    AXIS_MARKERS,
    INK,
    PANEL,
    REST,
    SOFT,
    UNUSED,
    X_AXIS,
    Z_AXIS,
    inline_svg,
)

HALF_WIDTH, FULL_WIDTH = 5.6, 11.2
LEFT, RIGHT = 0.55, 0.08
LABEL_ROOM = 0.62
"""Inches below a panel for slanted names of rests."""
ROOM_FOR_LAST_NAME = 0.35
"""Inches that a slanted name over the last rest reaches beyond it."""

UNCOMPENSATED, COMPENSATED, CALIBRATED = ALARM, X_AXIS, Z_AXIS

_SIDE_BY_SIDE = (-0.2, 0.0, 0.2)
_MOST_REST_LABELS = 40


def residual_figure(triad: TriadResult, prefix: str) -> Markup:
    """Draws the residual of each axis at each rest and turn with its error bar, and below it in sigmas."""
    figure = Figure(HALF_WIDTH, 3.95)
    upper = figure.add_axes(box(HALF_WIDTH, bottom=2.32, height=1.38))
    lower = figure.add_axes(box(HALF_WIDTH, bottom=LABEL_ROOM + 0.14, height=1.2))
    scale = readable_scale(triad.unit, largest(triad.residuals))
    known = np.where(triad.residual_sigma > 0, triad.residual_sigma, np.nan)
    normalised = triad.residuals / known
    place = np.arange(len(triad.residual_labels), dtype=float)

    bars = triad.residual_sigma
    value_axis_in(upper, scale, "residual", triad.residuals - bars, triad.residuals + bars)
    upper.set_xlim(-0.6, len(place) - 0.4)
    low, high = span(normalised, at_least=(-3.2, 3.2))
    lower.band(-2.0, 2.0, PANEL)
    value_axis(lower, low, high, "residual / sigma (shaded: where 95 of 100 belong)")
    category_axis(lower, triad.residual_labels, most=16)
    for axis, (colour, marker, aside) in enumerate(
        zip(AXIS_COLOURS, AXIS_MARKERS, _SIDE_BY_SIDE, strict=True)
    ):
        shown = scale.factor * triad.residuals[:, axis]
        error_bars(upper, place + aside, shown, scale.factor * bars[:, axis], colour)
        upper.points(place + aside, shown, colour, marker)
        lower.points(place + aside, normalised[:, axis], colour, marker)
    where = f"at {len(place)} rests and turns"
    label = f"Residuals of the {triad.triad}, three axes, {where}, in {scale.unit} and in sigmas"
    return inline_svg(figure, prefix, label)


def recording_figure(trace: Trace, rests: Sequence[Rest], time: LogTime, prefix: str) -> Markup:
    """Draws specific force and angular rate over the recording, rests shaded and named, unused hatched."""
    trace, rests = trace.from_start(time), [rest.from_start(time) for rest in rests]
    figure = Figure(FULL_WIDTH, 4.3)
    width = FULL_WIDTH - ROOM_FOR_LAST_NAME
    upper = figure.add_axes(box(width, bottom=2.1, height=1.4))
    lower = figure.add_axes(box(width, bottom=0.42, height=1.25))
    start, end = span(trace.time, np.array([[rest.start, rest.end] for rest in rests]), margin=0.0)
    for axes, values, title, unit in (
        (upper, trace.accelerometer, "specific force", "m/s^2"),
        (lower, trace.gyroscope, "angular rate", "rad/s"),
    ):
        scale = readable_scale(unit, largest(values))
        value_axis_in(axes, scale, title, values)
        axes.set_xlim(start, end)
        shade(axes, [(rest.start, rest.end) for rest in rests if rest.used], REST, "")
        shade(axes, [(rest.start, rest.end) for rest in rests if not rest.used], UNUSED, "////")
        for axis, colour in enumerate(AXIS_COLOURS):
            axes.line(trace.time, scale.factor * values[:, axis], colour, 0.8)
    horizontal_axis(lower, start, end, "time, s", most=12)
    _name_rests(upper, rests)
    unused = sum(not rest.used for rest in rests)
    return inline_svg(
        figure, prefix, f"The recording over time with {len(rests)} rests, {unused} of them not used"
    )


def box(width: float, *, bottom: float, height: float) -> Box:
    """Places a panel across a figure of that width, all in inches."""
    return LEFT, bottom, width - LEFT - RIGHT, height


def largest(*arrays: FloatArray) -> float:
    """Returns the largest finite magnitude; 0 for none."""
    numbers = np.abs(np.concatenate([np.ravel(array) for array in arrays]))
    numbers = numbers[np.isfinite(numbers)]
    return float(numbers.max()) if numbers.size else 0.0


def value_axis_in(axes: Axes, scale: Scale, title: str, *values: FloatArray) -> None:
    """Sets a vertical range that holds zero and all `values`, which are in SI, shown in another unit."""
    low, high = span(*(scale.factor * array for array in values), at_least=(0.0,))
    value_axis(axes, low, high, f"{title}, {scale.unit}")


def shade(axes: Axes, spans: Sequence[tuple[float, float]], colour: str, hatch: str) -> None:
    """Colour what lies between those places of the horizontal axis, over the height the axes have by now."""
    low, high = axes.get_ylim()
    axes.bars(spans, low, high - low, colour, hatch, ink=SOFT, order=-1.0)


def _name_rests(axes: Axes, rests: Sequence[Rest]) -> None:
    stride = max(1, -(-len(rests) // _MOST_REST_LABELS))
    for number, rest in list(enumerate(rests, start=1))[::stride]:
        axes.text(
            (rest.start + rest.end) / 2,
            1,
            f"{number} {short(rest.pose)}" if rest.used else f"{number} not used",
            frames=("data", "panel"),
            shift=(0, 16),
            rotation=35,
            size=7.5,
            color=INK if rest.used else SOFT,
        )
