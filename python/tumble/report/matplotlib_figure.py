"""Figures of a page as one of matplotlib, which `result.plot()` returns."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from io import BytesIO
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes as PlotAxes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from tumble.foundation.arrays import FloatArray
from tumble.foundation.errors import TumbleError
from tumble.report.canvas import (
    MARKERS,
    POINTS,
    Axes,
    Band,
    Bars,
    Direction,
    Grid,
    LineMark,
    Mark,
    Points,
    Rounded,
    Text,
)
from tumble.report.svg import GRID, INK, SOFT, Drawing

_TITLE_SIZE, _LETTERS_PER_INCH = 9.0, 14.0
_TITLE_ROOM = 0.5
"""Inches above a figure for its title."""
_ABOVE_AXES = 4.0
"""Order in which words are drawn: over all else."""


class PageFigure(Figure):
    """Figures of a page below one another; a notebook shows it where it stands last in a cell."""

    def _repr_png_(self) -> bytes:
        picture = BytesIO()
        FigureCanvasAgg(self).print_png(picture)  # type: ignore[no-untyped-call]
        return picture.getvalue()


def drawn(page: object, wanted: str | None, owner: str) -> PageFigure:
    """Draws the figures of a page, or that of the name `wanted` alone.

    Raises `TumbleError` where the page has no such figure.
    """
    drawings = _chosen(list(drawings_of(page)), wanted, owner)
    heights = [drawing.figure.height / POINTS + _TITLE_ROOM for drawing in drawings]
    widest = max(drawing.figure.width / POINTS for drawing in drawings)
    sheet = PageFigure(figsize=(widest, sum(heights)), facecolor="white")
    parts = sheet.subfigures(len(drawings), 1, squeeze=False, height_ratios=heights)[:, 0]
    for part, drawing, height in zip(parts, drawings, heights, strict=True):
        title = fill(drawing.label, int(_LETTERS_PER_INCH * widest))
        part.suptitle(title, fontsize=_TITLE_SIZE, color=INK, x=0.01, ha="left")
        for axes in drawing.figure.panels:
            _draw_panel(part.add_axes(_box(axes, widest, height)), axes)
    return sheet


def drawings_of(page: object) -> Iterator[Drawing]:
    """Finds all drawings of a page, in the order of its fields."""
    if isinstance(page, Drawing):
        yield page
    elif isinstance(page, tuple | list):
        for each in page:
            yield from drawings_of(each)
    elif is_dataclass(page):
        for field in fields(page):
            yield from drawings_of(getattr(page, field.name))


def _chosen(drawings: Sequence[Drawing], wanted: str | None, owner: str) -> Sequence[Drawing]:
    chosen = [drawing for drawing in drawings if wanted in (None, drawing.name)]
    if not drawings:
        raise TumbleError(f"{owner}: its page has no figures")
    if not chosen:
        names = ", ".join(drawing.name for drawing in drawings)
        raise TumbleError(f"{owner}: has no figure {wanted!r}; its figures are {names}")
    return chosen


def _box(axes: Axes, width: float, height: float) -> tuple[float, float, float, float]:
    """Returns left, bottom, width and height of a panel as shares of its figure, of inches as given."""
    left, top, across, up = (length / POINTS for length in axes.place)
    return left / width, (height - _TITLE_ROOM - top - up) / height, across / width, up / height


def _draw_panel(plot_axes: PlotAxes, axes: Axes) -> None:
    panel = _Panel(plot_axes, axes)
    panel.set_scales()
    for mark in (*axes.inside, *axes.over):
        panel.draw(mark)


class _Panel:
    """Draws the marks of one panel on axes of matplotlib."""

    def __init__(self, plot_axes: PlotAxes, axes: Axes) -> None:
        self._on, self._axes = plot_axes, axes

    def set_scales(self) -> None:
        """Sets limits, numbers and titles of both axes."""
        on, (across, up) = self._on, (self._axes.scales["x"], self._axes.scales["y"])
        for side in ("top", "right", "left"):
            on.spines[side].set_visible(False)
        on.spines["bottom"].set_visible(bool(across.ticks))
        on.spines["bottom"].set_color(GRID)
        on.tick_params(length=0, labelsize=7.5, colors=SOFT)
        if across.logarithmic:
            on.set_xscale("log")
        if up.logarithmic:
            on.set_yscale("log")
        on.set_xlim(*self._values(self._axes.get_xlim(), "x").tolist())
        on.set_ylim(*self._values(self._axes.get_ylim(), "y").tolist())
        on.set_xticks(self._values(across.ticks, "x"), labels=list(across.texts))
        on.set_yticks(self._values(up.ticks, "y"), labels=list(up.texts))
        on.minorticks_off()
        on.set_xlabel(across.title, fontsize=7.5, color=INK)
        on.set_title(up.title, fontsize=8, color=INK, loc="left")

    def draw(self, mark: Mark) -> None:
        """Draws one mark."""
        match mark:
            case LineMark():
                self._line(mark)
            case Points():
                self._points(mark)
            case Bars():
                self._bars(mark)
            case Band():
                low, high = self._values((mark.low, mark.high), "y").tolist()
                self._on.axhspan(low, high, color=mark.colour, lw=0, zorder=mark.order)
            case Grid():
                self._grid(mark)
            case Rounded():
                self._rounded(mark)
            case Text():
                if not mark.of_axis:
                    self._text(mark)

    def _line(self, line: LineMark) -> None:
        style = "-" if not line.dash else (0, tuple(float(part) / line.width for part in line.dash.split()))
        self._on.plot(
            self._values(line.x, "x"),
            self._values(line.y, "y"),
            color=line.colour,
            lw=line.width,
            ls=style,
            zorder=line.order,
        )

    def _points(self, points: Points) -> None:
        self._on.plot(
            self._values(points.x, "x"),
            self._values(points.y, "y"),
            ls="",
            marker=points.marker if points.marker in MARKERS or points.marker in "ox" else "o",
            ms=points.size,
            mew=points.edge,
            mec=points.colour,
            mfc="none" if points.hollow else points.colour,
            alpha=points.opacity,
            zorder=points.order,
            clip_on=points in self._axes.inside,
        )

    def _bars(self, bars: Bars) -> None:
        spans = np.array(bars.spans, dtype=float).reshape(-1, 2)
        left, right = self._values(spans[:, 0], "x"), self._values(spans[:, 1], "x")
        low, high = self._values((bars.low, bars.low + bars.height), "y").tolist()
        self._on.bar(
            left,
            high - low,
            width=right - left,
            bottom=low,
            align="edge",
            color=bars.colour,
            hatch=bars.hatch or None,
            ec=bars.ink or bars.colour,
            lw=0,
            zorder=bars.order,
        )

    def _grid(self, grid: Grid) -> None:
        draw: Callable[..., Any] = self._on.axvline if grid.direction == "x" else self._on.axhline
        for tick in self._values(grid.ticks, grid.direction).tolist():
            at_zero = bool(grid.zero) and tick == 0
            draw(
                tick,
                color=grid.zero if at_zero else grid.colour,
                lw=0.7 if at_zero else 0.6,
                zorder=grid.order,
            )

    def _rounded(self, rounded: Rounded) -> None:
        left, low, width, height = rounded.box
        shape = Rectangle((left, low), width, height)
        shape.set(facecolor=rounded.face, edgecolor=rounded.edge, zorder=rounded.order)
        self._on.add_patch(shape)

    def _text(self, text: Text) -> None:
        in_panel = ["axes fraction" if frame == "panel" else "data" for frame in text.frames]
        place = [
            value if frame == "panel" else self._values([value], direction)[0]
            for value, frame, direction in zip((text.x, text.y), text.frames, _DIRECTIONS, strict=True)
        ]
        self._on.annotate(
            text.text,
            xy=(place[0], place[1]),
            xycoords=(in_panel[0], in_panel[1]),
            xytext=text.shift,
            textcoords="offset points",
            ha=text.side,
            va=text.height,
            rotation=text.rotation,
            rotation_mode="anchor",
            fontsize=text.size,
            fontweight="bold" if text.bold else "normal",
            color=text.colour,
            zorder=_ABOVE_AXES,
            annotation_clip=False,
        )

    def _values(self, numbers: Sequence[float] | FloatArray, direction: Direction) -> FloatArray:
        """Returns numbers of the panel as those written at its edges."""
        values = np.asarray(numbers, dtype=float)
        return np.power(10.0, values) if self._axes.scales[direction].logarithmic else values


_DIRECTIONS: tuple[Direction, Direction] = ("x", "y")
