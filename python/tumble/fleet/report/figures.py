"""Distributions of the latest values of all units, a panel for each axis of a parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from markupsafe import Markup

from tumble.report.canvas import Figure
from tumble.report.figures import HALF_WIDTH, box, largest
from tumble.report.numbers import readable_scale
from tumble.report.panel import horizontal_axis, value_axis
from tumble.report.svg import AXIS_COLOURS, inline_svg

_PANEL, _ROOM = 1.0, 0.6
"""Inches of a panel, and below it."""
_FEWEST, _MOST = 8, 40
"""Bars of a panel."""


def distribution_figure(latest: Mapping[str, Sequence[float]], unit: str, group: str) -> Markup:
    """Draws how the latest values of one kind of parameter are distributed over the units."""
    figure = Figure(HALF_WIDTH, 0.3 + len(latest) * (_PANEL + _ROOM))
    scale = readable_scale(unit, largest(*(np.array(values) for values in latest.values())))
    everything = scale.factor * np.concatenate([np.array(values) for values in latest.values()])
    low, high = float(everything.min()), float(everything.max())
    margin = 0.05 * (high - low) or 1.0
    edges = np.linspace(low - margin, high + margin, _bars(everything.size // len(latest)) + 1)
    for place, (name, values) in enumerate(latest.items()):
        bottom = 0.45 + (len(latest) - 1 - place) * (_PANEL + _ROOM)
        axes = figure.add_axes(box(HALF_WIDTH, bottom=bottom, height=_PANEL))
        counts = np.histogram(scale.factor * np.array(values), edges)[0]
        value_axis(axes, 0.0, 1.1 * float(counts.max()), f"units, {name.rpartition(' ')[2]}")
        for count, start, end in zip(counts, edges[:-1], edges[1:], strict=True):
            if count:
                axes.bars([(float(start), float(end))], 0.0, float(count), AXIS_COLOURS[place % 3])
        axes.set_xlim(float(edges[0]), float(edges[-1]))
        horizontal_axis(axes, float(edges[0]), float(edges[-1]), f"{group}, {scale.unit}", most=6)
    prefix = f"fleet-{group.replace(' ', '-')}"
    return inline_svg(figure, prefix, f"Distribution of {group} over the units")


def _bars(units: int) -> int:
    """Returns the number of bars, by the rule of Rice: two roots of the third order."""
    return int(np.clip(round(2.0 * units ** (1.0 / 3.0)), _FEWEST, _MOST))
