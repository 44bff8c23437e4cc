"""The picture of an alignment: where units sit beside the primary, from two sides.

Drawn inside `svg.house_style`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from tumble.recording import FloatArray
from tumble.report.figures import HALF_WIDTH, LABEL_ROOM, box
from tumble.report.numbers import Scale, readable_scale
from tumble.report.panel import bare_axes, horizontal_axis, markers, value_axis
from tumble.report.svg import ALARM, INK, SOFT, X_AXIS, inline_svg, new_figure
from tumble.results_align import UnitAlignment

_HEIGHT = 2.6
"""Inches of a panel."""
_ROOM = 1.35
"""Times the largest distance that a panel reaches, so that names have room."""
_TWO_SIGMA = 2.0
_VIEWS = ((0, 1), (0, 2))
"""Axes to the right and upwards of the two panels."""


def places_figure(primary: str, units: Sequence[UnitAlignment], prefix: str) -> Markup:
    """Draw the lever arms of units, all of them known, from above and from the side."""
    figure = new_figure(2 * HALF_WIDTH, _HEIGHT + LABEL_ROOM + 0.1)
    arms = np.array([unit.lever_arm for unit in units])
    spread = [float(np.sqrt(np.trace(unit.lever_arm_covariance))) for unit in units]
    reach = _ROOM * float(np.max(np.abs(arms)) + _TWO_SIGMA * max(spread))
    scale = readable_scale("m", reach)
    for side, (right, up) in enumerate(_VIEWS):
        left, bottom, width, height = box(HALF_WIDTH, bottom=LABEL_ROOM, height=_HEIGHT)
        axes = bare_axes(figure, (left + side * HALF_WIDTH, bottom, width - 0.1, height))
        end = scale.factor * reach
        # One scale both ways: a place is no graph.
        across = end * (width - 0.1) / height
        value_axis(axes, -end, end, f"{'xyz'[up]}, {scale.unit}")
        horizontal_axis(axes, -across, across, f"{'xyz'[right]}, {scale.unit}", most=5)
        _mark(axes, np.zeros(2), primary, INK, "s")
        for unit in units:
            _place(axes, unit, (right, up), scale)
    return inline_svg(figure, prefix, f"Places of {len(units)} units beside {primary}")


def _place(axes: Axes, unit: UnitAlignment, view: tuple[int, int], scale: Scale) -> None:
    seen = list(view)
    centre = scale.factor * unit.lever_arm[seen]
    values, vectors = np.linalg.eigh(unit.lever_arm_covariance[np.ix_(seen, seen)])
    angle = np.linspace(0.0, 2.0 * np.pi, 61)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    radii = _TWO_SIGMA * scale.factor * np.sqrt(np.maximum(values, 0.0))
    ellipse = centre[:, None] + vectors @ (radii[:, None] * circle)
    axes.plot([0.0, centre[0]], [0.0, centre[1]], color=SOFT, linewidth=0.7)
    axes.plot(ellipse[0], ellipse[1], color=ALARM, linewidth=1.0)
    _mark(axes, centre, unit.name, X_AXIS, "o")


def _mark(axes: Axes, place: FloatArray, name: str, colour: str, marker: str) -> None:
    markers(axes, place[:1], place[1:], colour, marker)
    axes.annotate(
        name, (place[0], place[1]), (4, 4), textcoords="offset points", size=8, color=colour, va="bottom"
    )
