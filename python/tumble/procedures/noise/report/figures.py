"""Allan deviations over averaging time, with intervals and what the terms make of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from tumble.foundation.noise_terms import BIAS_INSTABILITY, QUANTISATION, RAMP, RANDOM_WALK, WHITE
from tumble.foundation.recording import FloatArray
from tumble.procedures.noise.result import ChannelNoise
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import HALF_WIDTH, LABEL_ROOM, box
from tumble.report.numbers import readable_unit
from tumble.report.panel import log_axis, log_value_axis, segments
from tumble.report.svg import AXIS_COLOURS, AXIS_MARKERS, SOFT, inline_svg

FLICKER_FLOOR = np.sqrt(2.0 * np.log(2.0) / np.pi)
"""Allan deviation of bias instability of B = 1 (docs/theory/noise.md, eq. 5)."""
_HEIGHT = 3.4
_ROOM = 0.1
"""Decades above and below what is drawn."""


def term_deviations(channel: ChannelNoise, tau: FloatArray) -> dict[str, FloatArray]:
    """Returns the Allan deviation of each term at averaging times (n,), s (docs/theory/noise.md, eq. 20)."""
    q, n, b, k, r = np.nan_to_num(channel.model)
    return {
        QUANTISATION: np.sqrt(3.0) * q / tau,
        WHITE: n / np.sqrt(tau),
        BIAS_INSTABILITY: np.full(len(tau), FLICKER_FLOOR * b),
        RANDOM_WALK: k * np.sqrt(tau / 3.0),
        RAMP: r * tau / np.sqrt(2.0),
    }


def deviation_figure(channels: Sequence[ChannelNoise], prefix: str) -> Markup:
    """Draws the Allan deviations of a triad."""
    triad = channels[0].triad
    label = f"Allan deviation of the {triad} over averaging time, logarithmic, with 95 % intervals and terms"
    return inline_svg(deviation_sheet(channels), prefix, label)


def deviation_sheet(channels: Sequence[ChannelNoise]) -> Figure:
    """Draws them on a sheet of their own."""
    figure = Figure(HALF_WIDTH, _HEIGHT + LABEL_ROOM + 0.3)
    axes = figure.add_axes(box(HALF_WIDTH, bottom=LABEL_ROOM, height=_HEIGHT))
    seen = np.concatenate([channel.allan.deviation for channel in channels])
    seen = seen[seen > 0.0]
    tau = channels[0].allan.tau
    if len(seen):
        low, high = np.log10([seen.min(), seen.max()])
        log_value_axis(axes, low - _ROOM, high + _ROOM, f"Allan deviation, {readable_unit(channels[0].unit)}")
        log_axis(axes, float(tau[0]), float(tau[-1]), "averaging time, s")
        for channel in channels:
            _channel(axes, channel)
    return figure


def _channel(axes: Axes, channel: ChannelNoise) -> None:
    place = "xyz".index(channel.name[-1])
    colour, marker = AXIS_COLOURS[place], AXIS_MARKERS[place]
    curve = channel.allan
    known = curve.deviation > 0.0
    tau = np.log10(curve.tau[known])
    low, high = np.log10(curve.low[known]), np.log10(curve.high[known])
    segments(axes, tau, low, tau, high, colour, 0.9)
    axes.points(tau, np.log10(curve.deviation[known]), colour, marker, 3.2)
    terms = term_deviations(channel, curve.tau)
    for name, deviation in terms.items():
        if channel.term(name).observable and deviation.min() > 0.0:
            axes.line(np.log10(curve.tau), np.log10(deviation), SOFT, 0.7, dash="3 3")
    total = np.sqrt(sum(np.square(deviation) for deviation in terms.values()))
    fitted = total > 0.0
    axes.line(np.log10(curve.tau[fitted]), np.log10(total[fitted]), colour, 1.0)
