"""The picture of an alignment: where units sit beside the primary, from two sides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of
from tumble.procedures.align.result import UnitAlignment
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import HALF_WIDTH, LABEL_ROOM, box
from tumble.report.numbers import Scale, readable_scale
from tumble.report.panel import horizontal_axis, value_axis
from tumble.report.svg import ALARM, INK, SOFT, X_AXIS, inline_svg

_HEIGHT = 2.6
"""Inches of a panel."""
_TITLE = 0.35
"""Inches above a panel, for the name of its axis."""
_ROOM = 1.35
"""Times the largest distance that a panel reaches, so that names have room."""
_TWO_SIGMA = 2.0
_VIEWS = ((0, 1), (0, 2))
"""Axes to the right and upwards of the two panels."""


def places_figure(primary: str, units: Sequence[UnitAlignment], prefix: str) -> Markup:
    """Draws the lever arms of units, all of them known, from above and from the side."""
    figure = Figure(2 * HALF_WIDTH, _HEIGHT + LABEL_ROOM + _TITLE)
    left, bottom, width, height = box(HALF_WIDTH, bottom=LABEL_ROOM, height=_HEIGHT)
    width -= 0.1
    arms = np.array([unit.lever_arm for unit in units])
    spread = max(float(np.sqrt(np.trace(unit.lever_arm_covariance))) for unit in units)
    x, y, z = np.max(np.abs(arms), axis=0) + _TWO_SIGMA * spread
    # One scale both ways and in both panels: a place is no graph.
    reach = _ROOM * max(y, z, x * height / width)
    scale = readable_scale("m", reach)
    end = scale.factor * reach
    for side, (right, up) in enumerate(_VIEWS):
        axes = figure.add_axes((left + side * HALF_WIDTH, bottom, width, height))
        value_axis(axes, -end, end, f"{'xyz'[up]}, {scale.unit}")
        across = end * width / height
        horizontal_axis(axes, -across, across, f"{'xyz'[right]}, {scale.unit}", most=5, zero=SOFT)
        _mark(axes, np.zeros(2), primary, INK, "s", above=True)
        for number, unit in enumerate(units):
            _place(axes, unit, (right, up), scale, above=number % 2 == 1)
    return inline_svg(figure, prefix, f"Places of {count_of('unit', len(units))} relative to {primary}")


def _place(axes: Axes, unit: UnitAlignment, view: tuple[int, int], scale: Scale, *, above: bool) -> None:
    """Draws one unit; names of units on both sides of a board would cover each other, so they alternate."""
    seen = list(view)
    centre = scale.factor * unit.lever_arm[seen]
    values, vectors = np.linalg.eigh(unit.lever_arm_covariance[np.ix_(seen, seen)])
    angle = np.linspace(0.0, 2.0 * np.pi, 61)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    radii = _TWO_SIGMA * scale.factor * np.sqrt(np.maximum(values, 0.0))
    ellipse = centre[:, None] + vectors @ (radii[:, None] * circle)
    axes.line([0.0, centre[0]], [0.0, centre[1]], SOFT, 0.7)
    axes.line(ellipse[0], ellipse[1], ALARM)
    _mark(axes, centre, unit.name, X_AXIS, "o", above=above)


def _mark(axes: Axes, place: FloatArray, name: str, colour: str, marker: str, *, above: bool) -> None:
    axes.points(place[:1], place[1:], colour, marker)
    axes.text(
        place[0],
        place[1],
        name,
        shift=(4, 4) if above else (4, -4),
        va="bottom" if above else "top",
        color=colour,
    )
