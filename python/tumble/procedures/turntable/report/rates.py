"""The gyroscope at constant rates: what deviates from a straight line, and the figures of each rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from tumble.procedures.turntable.result import ResponseResult
from tumble.report.canvas import Figure
from tumble.report.figures import FULL_WIDTH, box
from tumble.report.numbers import measurement, significant
from tumble.report.page import Picture
from tumble.report.panel import error_bars, horizontal_axis, span, value_axis
from tumble.report.svg import AXIS_COLOURS, AXIS_MARKERS, SOFT, inline_svg


@dataclass(frozen=True, slots=True)
class ResponseRow:
    """An axis as printed: full scale in deg/s, all else in ppm."""

    axis: str
    full_scale: str
    scale: str
    linearity: str
    asymmetry: str


@dataclass(frozen=True, slots=True)
class LevelRow:
    """An axis at one rate as printed: rate in deg/s, scale and deviation in ppm."""

    axis: str
    rate: str
    turns: str
    scale: str
    deviation: str


@dataclass(frozen=True, slots=True)
class ResponseSection:
    """All axes that turned at constant rates."""

    picture: Picture
    axes: tuple[ResponseRow, ...]
    levels: tuple[LevelRow, ...]


def response_section(responses: Sequence[ResponseResult]) -> ResponseSection | None:
    """Prints the responses; None where there are none."""
    if not responses:
        return None
    caption = "Deviation of each rate from the straight line through all rates of its axis; bars: one sigma."
    return ResponseSection(
        picture=Picture(deviation_figure(responses, "rates"), caption),
        axes=tuple(_axis_row(each) for each in responses),
        levels=tuple(_level_rows(responses)),
    )


def deviation_figure(responses: Sequence[ResponseResult], prefix: str) -> Markup:
    """Draws the deviation of each rate from the straight line, ppm of full scale, over the rate."""
    figure = Figure(FULL_WIDTH, 2.7)
    axes = figure.add_axes(box(FULL_WIDTH, bottom=0.45, height=1.95))
    levels = [(("xyz").index(each.axis), each.levels) for each in responses]
    rates = np.array([level.rate for _, found in levels for level in found])
    values = np.array([level.deviation for _, found in levels for level in found])
    sigmas = np.array([level.deviation_sigma for _, found in levels for level in found])
    low, high = span(values - sigmas, values + sigmas, at_least=(0.0,))
    start, end = span(rates, at_least=(0.0,))
    value_axis(axes, low, high, "deviation, ppm of full scale")
    axes.set_xlim(start, end)
    axes.line(np.array([start, end]), np.zeros(2), SOFT, 0.8)
    for axis, found in levels:
        at = np.array([level.rate for level in found])
        deviation = np.array([level.deviation for level in found])
        sigma = np.array([level.deviation_sigma for level in found])
        error_bars(axes, at, deviation, sigma, AXIS_COLOURS[axis])
        axes.points(at, deviation, AXIS_COLOURS[axis], AXIS_MARKERS[axis])
    horizontal_axis(axes, start, end, "rate, deg/s", most=12)
    shown = ", ".join(each.axis for each in responses)
    return inline_svg(
        figure, prefix, f"Deviation of gyroscope {shown} from a straight line at {len(rates)} rates, in ppm"
    )


def _axis_row(response: ResponseResult) -> ResponseRow:
    asymmetry = (
        "not observable"
        if response.asymmetry is None or response.asymmetry_sigma is None
        else measurement(response.asymmetry, response.asymmetry_sigma)
    )
    return ResponseRow(
        axis=response.axis,
        full_scale=significant(response.full_scale),
        scale=_scale_error(response.scale, response.scale_sigma),
        linearity=measurement(response.linearity, response.linearity_sigma),
        asymmetry=asymmetry,
    )


def _level_rows(responses: Sequence[ResponseResult]) -> list[LevelRow]:
    return [
        LevelRow(
            axis=each.axis,
            rate=significant(level.rate, 4),
            turns=str(level.turns),
            scale=_scale_error(level.scale, level.scale_sigma),
            deviation=measurement(level.deviation, level.deviation_sigma),
        )
        for each in responses
        for level in each.levels
    ]


def _scale_error(scale: float, sigma: float) -> str:
    return measurement(1e6 * (scale - 1.0), 1e6 * sigma)
