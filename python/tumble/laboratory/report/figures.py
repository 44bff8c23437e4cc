"""The figures of a unit over time: a panel for each kind of parameter, with the predicted interval."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from tumble.foundation.error_decomposition import PAIRS
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import GROUPS, INTERVAL
from tumble.laboratory.parameter_history import ParameterHistory, date_of, years_of
from tumble.laboratory.results import ideal
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import HALF_WIDTH, box, largest, value_axis_in
from tumble.report.groups import group_of
from tumble.report.numbers import readable_scale
from tumble.report.panel import horizontal_axis, segments
from tumble.report.svg import ALARM, AXIS_COLOURS, AXIS_MARKERS, AXIS_NAMES, inline_svg

_PANEL, _ROOM = 1.35, 0.55
"""Inches of a panel, and above it."""
_POINTS = 12
_SHORTEST_LOOK_AHEAD = 1.0
"""Years for which the interval is drawn at least."""


def drawn(parameters: Sequence[ParameterHistory], triad: str) -> list[ParameterHistory]:
    """Choose the parameters of a triad that have three axes side by side."""
    return [
        each
        for each in parameters
        if each.measured.name.startswith(triad) and group_of(each.measured.name).partition(" ")[2] in GROUPS
    ]


def unit_figure(parameters: Sequence[ParameterHistory], prefix: str, triad: str) -> Markup:
    """Draw the parameters of a triad over the years, with what is predicted."""
    groups: dict[str, list[ParameterHistory]] = {}
    for each in parameters:
        groups.setdefault(group_of(each.measured.name), []).append(each)
    times = np.concatenate([each.measured.series.times for each in parameters])
    ahead = max(_SHORTEST_LOOK_AHEAD, 0.5 * float(np.ptp(times)))
    first = float(times.min())
    room = 0.04 * (float(np.ptp(times)) + ahead)
    ends = -room, float(np.ptp(times)) + ahead
    figure = Figure(HALF_WIDTH, 0.1 + len(groups) * (_PANEL + _ROOM))
    for place, (group, found) in enumerate(groups.items()):
        bottom = 0.45 + (len(groups) - 1 - place) * (_PANEL + _ROOM)
        axes = figure.add_axes(box(HALF_WIDTH, bottom=bottom, height=_PANEL - 0.1))
        _panel(axes, group, found, first, ends)
        title = f"years since {date_of(first)}" if place == len(groups) - 1 else ""
        horizontal_axis(axes, *ends, title, most=6)
    return inline_svg(figure, prefix, f"Parameters of the {triad} over years, with the interval predicted")


def _panel(
    axes: Axes, group: str, found: Sequence[ParameterHistory], first: float, ends: tuple[float, float]
) -> None:
    """Draws values with 95 % intervals, the interval predicted from the last one on, and limits.

    Values are less the ideal one where all have limits, which count from there, else less their mean.
    """
    limits = [each.limit for each in found if each.limit is not None]
    has_limits = len(limits) == len(found)
    centres = [
        ideal(each.measured.name) if has_limits else float(np.mean(each.measured.values)) for each in found
    ]
    predicted = [_predicted(each, first + ends[1]) for each in found]
    changes = [np.array(each.measured.values) - centre for each, centre in zip(found, centres, strict=True)]
    reaches = [INTERVAL * np.sqrt(each.measured.series.variances) for each in found]
    edges = [
        change + side * reach for change, reach in zip(changes, reaches, strict=True) for side in (-1, 1)
    ]
    edges += [band - centre for (_, *bands), centre in zip(predicted, centres, strict=True) for band in bands]
    if has_limits:
        edges += [np.array([-1.0, 1.0]) * max(limits)]
    scale = readable_scale(found[0].measured.unit, largest(*edges))
    quantity = group.partition(" ")[2]
    value_axis_in(
        axes, scale, f"{quantity}, and its limits" if has_limits else f"{quantity}, less its mean", *edges
    )
    axes.set_xlim(*ends)
    if has_limits:
        _draw_limits(axes, found, scale.factor, ends)
    for each, centre, change, reach, (years, low, high) in zip(
        found, centres, changes, reaches, predicted, strict=True
    ):
        axis = _axis(each.measured.name)
        colour = AXIS_COLOURS[axis]
        for band in (low, high):
            axes.line(years - first, scale.factor * (band - centre), colour, 0.7, dash="2 2")
        at = each.measured.series.times - first
        lower, upper = scale.factor * (change - reach), scale.factor * (change + reach)
        segments(axes, at, lower, at, upper, colour, 1.0)
        axes.points(at, scale.factor * change, colour, AXIS_MARKERS[axis], 4.0)


def _draw_limits(
    axes: Axes, found: Sequence[ParameterHistory], factor: float, ends: tuple[float, float]
) -> None:
    """Draws limits across the panel, once where all axes share them, else in the colour of each axis."""
    limits = {AXIS_COLOURS[_axis(each.measured.name)]: each.limit for each in found if each.limit is not None}
    shared = set(limits.values())
    for colour, limit in {ALARM: shared.pop()}.items() if len(shared) == 1 else limits.items():
        for side in (-1.0, 1.0):
            axes.line(np.array(ends), np.full(2, side * factor * limit), colour, 1.1, dash="7 3")


def _predicted(each: ParameterHistory, end: float) -> tuple[FloatArray, ...]:
    """(k,) times, and lower and upper ends of the interval then; empty where nothing is predicted."""
    if each.walk is None:
        nothing = np.zeros(0)
        return nothing, nothing, nothing
    start = years_of(each.measured.dates[-1])
    # An interval grows by the root of time: places lie closer together at its beginning.
    years = start + (end - start) * np.linspace(0.0, 1.0, _POINTS) ** 2
    ends = np.array([each.predicted(year) for year in years])
    return years, ends[:, 0], ends[:, 1]


def _axis(name: str) -> int:
    """Return which of three a parameter is: x, y and z, or xy, yz and zx."""
    axis = name.rpartition(" ")[2]
    return PAIRS.index(axis) if axis in PAIRS else AXIS_NAMES.index(axis)
