"""The figures of calibrations over time: a panel for each kind of parameter, with straight lines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from tumble.foundation.error_decomposition import PAIRS
from tumble.foundation.results import INTERVAL
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import FULL_WIDTH, HALF_WIDTH, box, largest, value_axis_in
from tumble.report.groups import group_of
from tumble.report.numbers import readable_scale
from tumble.report.panel import LABEL_SIZE, horizontal_axis, segments, span, value_axis
from tumble.report.svg import AXIS_COLOURS, AXIS_MARKERS, AXIS_NAMES, PANEL, SOFT, inline_svg
from tumble.tools.compare.result import Difference, History

_PANEL, _ROOM = 1.35, 0.55
"""Inches of a panel, and above it."""
_POINTS = 60
_MARGIN = 0.06
_LINE = 11
"""Points from one line of a name to the next."""
_BESIDE = 0.16
"""Share of the room of a kind of parameter by which its axes are set apart."""
_ASIDE = 0.006
"""Share of the time by which markers of three axes are set apart."""


def history_figure(histories: Sequence[History], prefix: str) -> Markup:
    """Draws the parameters of a triad over years."""
    triad = histories[0].name.partition(" ")[0]
    return inline_svg(
        history_sheet(histories), prefix, f"Parameters of the {triad} over years, each with a straight line"
    )


def sigmas_figure(compared: Sequence[Difference], prefix: str) -> Markup:
    """Draws how many sigmas each parameter differs by, its axes side by side."""
    groups: dict[str, list[Difference]] = {}
    for each in compared:
        groups.setdefault(each.group, []).append(each)
    figure = Figure(FULL_WIDTH, 2.6)
    axes = figure.add_axes(box(FULL_WIDTH, bottom=0.5, height=1.8))
    low, high = span(np.array([each.sigmas for each in compared]), at_least=(-3.2, 3.2))
    axes.band(-INTERVAL, INTERVAL, PANEL)
    value_axis(axes, low, high, "difference / sigma (shaded: where 95 of 100 belong)")
    axes.set_xlim(-0.6, len(groups) - 0.4)
    for place, group in enumerate(groups):
        for line, words in enumerate(group.split(" ", 1)):
            axes.text(
                place,
                0,
                words,
                frames=("data", "panel"),
                shift=(0, -6 - _LINE * line),
                ha="center",
                va="top",
                size=LABEL_SIZE,
                color=SOFT,
            )
    for place, members in enumerate(groups.values()):
        for k, each in enumerate(members):
            axis = k % len(AXIS_COLOURS)
            at = np.array([place + _BESIDE * (k - (len(members) - 1) / 2)])
            axes.points(at, np.array([each.sigmas]), AXIS_COLOURS[axis], AXIS_MARKERS[axis], 5.0)
    return inline_svg(figure, prefix, f"Differences of {len(compared)} parameters in sigmas")


def history_sheet(histories: Sequence[History]) -> Figure:
    """Draws them on a sheet of their own."""
    groups: dict[str, list[History]] = {}
    for each in histories:
        groups.setdefault(group_of(each.name), []).append(each)
    figure = Figure(HALF_WIDTH, 0.1 + len(groups) * (_PANEL + _ROOM))
    ends = np.concatenate([each.years for each in histories])
    room = _MARGIN * float(np.ptp(ends))
    low, high = float(ends.min()) - room, float(ends.max()) + room
    for place, (group, found) in enumerate(groups.items()):
        bottom = 0.45 + (len(groups) - 1 - place) * (_PANEL + _ROOM) - 0.05 * place
        axes = figure.add_axes(box(HALF_WIDTH, bottom=bottom, height=_PANEL - 0.1))
        _panel(axes, group, found, (low, high))
        horizontal_axis(axes, low, high, "years" if place == len(groups) - 1 else "", most=6)
    return figure


def _panel(axes: Axes, group: str, histories: Sequence[History], ends: tuple[float, float]) -> None:
    """Draws values minus their mean with 95 % intervals, their lines, and the intervals of these."""
    years = np.linspace(*ends, _POINTS)
    changes = [each.values - each.level for each in histories]
    reaches = [INTERVAL * each.sigmas for each in histories]
    edges = [
        change + side * reach for change, reach in zip(changes, reaches, strict=True) for side in (-1, 1)
    ]
    scale = readable_scale(histories[0].unit, largest(*edges))
    value_axis_in(axes, scale, f"{group.partition(' ')[2]}, less its mean", *edges)
    axes.set_xlim(*ends)
    for each, change, reach in zip(histories, changes, reaches, strict=True):
        place = _place(each)
        colour = AXIS_COLOURS[place]
        level, sigma = each.line(years)
        axes.line(years, scale.factor * (level - each.level), colour, 1.2)
        for side in (-each.reach, each.reach):
            axes.line(years, scale.factor * (level - each.level + side * sigma), colour, 0.6, dash="2 2")
        at = each.years + (place - 1) * _ASIDE * (ends[1] - ends[0])
        bars = scale.factor * (change - reach), scale.factor * (change + reach)
        segments(axes, at, bars[0], at, bars[1], colour, 1.0)
        axes.points(at, scale.factor * change, colour, AXIS_MARKERS[place], 4.0)


def _place(each: History) -> int:
    """Returns the index of a parameter among three: x, y and z, or xy, yz and zx."""
    axis = each.name.rpartition(" ")[2]
    return PAIRS.index(axis) if axis in PAIRS else AXIS_NAMES.index(axis)
