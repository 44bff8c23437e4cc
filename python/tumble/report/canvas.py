"""A figure as plain data: panels with linear scales that hold lines, points, bars and text.

Pages draw it as SVG (`panel_svg`), `result.plot()` with matplotlib (`matplotlib_figure`). A batch has
thousands of small figures, of which each takes a millisecond as SVG and 70 in a library for plots.
Boxes of panels are in inches, line widths, sizes and shifts in points, 72 an inch, all else in the numbers of
the panel. Nothing is drawn before the figure is asked for, so that limits may be set at any time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from tumble.foundation.arrays import FloatArray

Box: TypeAlias = tuple[float, float, float, float]
"""Left, bottom, width and height; of a panel in inches."""
Ends: TypeAlias = tuple[float, float]
Frame: TypeAlias = Literal["data", "panel"]
"""Frame of a place: numbers of the panel, or shares of its width or height."""

Side: TypeAlias = Literal["left", "center", "right"]
"""Place of a text relative to its point: left end, middle, right end."""
Height: TypeAlias = Literal["baseline", "center", "top", "bottom"]
Direction: TypeAlias = Literal["x", "y"]

POINTS = 72.0
"""An inch."""

_LINES, _TEXT = 2.0, 3.0
"""Usual order: what is drawn later covers what is drawn before."""

MARKERS = {
    "s": ((-1, -1), (1, -1), (1, 1), (-1, 1)),
    "D": ((0, -1.414), (1.414, 0), (0, 1.414), (-1.414, 0)),
    "^": ((0, -1), (1, 1), (-1, 1)),
    "v": ((0, 1), (1, -1), (-1, -1)),
    "X": (
        *((-1, -0.5), (-0.5, -1), (0, -0.5), (0.5, -1), (1, -0.5), (0.5, 0)),
        *((1, 0.5), (0.5, 1), (0, 0.5), (-0.5, 1), (-1, 0.5), (-0.5, 0)),
    ),
    "P": (
        *((-0.33, -1), (0.33, -1), (0.33, -0.33), (1, -0.33), (1, 0.33), (0.33, 0.33)),
        *((0.33, 1), (-0.33, 1), (-0.33, 0.33), (-1, 0.33), (-1, -0.33), (-0.33, -0.33)),
    ),
}
"""Corners of markers, in halves of their size, downwards; `o` is round, `x` is two strokes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineMark:
    """A line through points, broken where a number is not finite."""

    x: FloatArray
    y: FloatArray
    colour: str
    width: float
    dash: str
    """Lengths of strokes and gaps, as SVG has them; empty for none."""
    order: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Points:
    """Markers that no line connects."""

    x: FloatArray
    y: FloatArray
    colour: str
    marker: str
    size: float
    hollow: bool
    edge: float
    opacity: float
    titles: Sequence[str]
    order: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Bars:
    """Rectangles between places across, over one height."""

    spans: Sequence[Ends]
    low: float
    height: float
    colour: str
    hatch: str
    """`////` or `xxxx`, drawn in `ink`; empty for none."""
    ink: str
    title: str
    order: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """A rectangle between two heights, across the whole panel, behind everything."""

    low: float
    high: float
    colour: str
    order: float = -1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Lines at ticks from edge to edge; `zero` is the colour of that at zero, if it has one of its own."""

    ticks: Sequence[float]
    direction: Direction
    colour: str
    zero: str
    order: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Rounded:
    """A rectangle with round corners, their radius in points."""

    box: Box
    radius: float
    face: str
    edge: str
    order: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """Words beside a place, which is counted in `frames` and moved right and up by `shift`."""

    x: float
    y: float
    text: str
    colour: str
    frames: tuple[Frame, Frame]
    shift: tuple[float, float]
    side: Side
    height: Height
    size: float
    rotation: float
    """deg, counter-clockwise about the place."""
    bold: bool
    of_axis: bool
    """Indicates whether it is a number or the title of an axis, which matplotlib writes itself."""
    order: float = _TEXT


Mark: TypeAlias = LineMark | Points | Bars | Band | Grid | Rounded | Text


@dataclass(slots=True)
class AxisScale:
    """Numbers along one edge of a panel."""

    ticks: Sequence[float] = ()
    texts: Sequence[str] = ()
    title: str = ""
    logarithmic: bool = False
    """Indicates whether the numbers of the panel are decadic logarithms of those written."""


class Axes:
    """One panel: a box on paper, with the range of numbers shown in each direction."""

    def __init__(self, left: float, top: float, width: float, height: float) -> None:
        self.place = left, top, width, height
        """Points from the upper left corner of the sheet."""
        self.inside: list[Mark] = []
        """Marks that are cut off at the edges."""
        self.over: list[Mark] = []
        """Marks that may stand over the edges."""
        self.scales: dict[Direction, AxisScale] = {"x": AxisScale(), "y": AxisScale()}
        self._across: Ends = (0.0, 1.0)
        self._up: Ends = (0.0, 1.0)

    def set_xlim(self, low: float, high: float) -> None:
        """Sets what the left and the right edge stand for."""
        self._across = float(low), float(high)

    def set_ylim(self, low: float, high: float) -> None:
        """Sets what the lower and the upper edge stand for."""
        self._up = float(low), float(high)

    def get_xlim(self) -> Ends:
        """Returns what the left and the right edge stand for."""
        return self._across

    def get_ylim(self) -> Ends:
        """Returns what the lower and the upper edge stand for."""
        return self._up

    def line(
        self,
        x: ArrayLike,
        y: ArrayLike,
        colour: str,
        width: float = 1.0,
        *,
        order: float = _LINES,
        dash: str = "",
    ) -> None:
        """Draws a line through points (n,), broken where a number is not finite; `dash` is as SVG has it."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        self.inside.append(LineMark(x=x, y=y, colour=colour, width=width, dash=dash, order=order))

    def points(
        self,
        x: ArrayLike,
        y: ArrayLike,
        colour: str,
        marker: str,
        size: float = 4.2,
        *,
        hollow: bool = False,
        edge: float = 1.0,
        opacity: float = 1.0,
        order: float = _LINES,
        clipped: bool = True,
        titles: Sequence[str] = (),
    ) -> None:
        """Draws unconnected markers at (n,) places, the finite ones; `titles` show under the pointer."""
        mark = Points(
            x=np.asarray(x, dtype=float),
            y=np.asarray(y, dtype=float),
            colour=colour,
            marker=marker,
            size=size,
            hollow=hollow,
            edge=edge,
            opacity=opacity,
            titles=titles,
            order=order,
        )
        (self.inside if clipped else self.over).append(mark)

    def bars(
        self,
        spans: Iterable[Ends],
        low: float,
        height: float,
        colour: str,
        hatch: str = "",
        *,
        ink: str = "",
        order: float = 1.0,
        title: str = "",
    ) -> None:
        """Fills what lies between two places across, over one height; `hatch` is drawn on it in `ink`.

        The title shows under the pointer.
        """
        mark = Bars(
            spans=tuple(spans),
            low=low,
            height=height,
            colour=colour,
            hatch=hatch,
            ink=ink,
            title=title,
            order=order,
        )
        self.inside.append(mark)

    def band(self, low: float, high: float, colour: str) -> None:
        """Fills what lies between two heights, across the whole panel, behind everything."""
        self.inside.append(Band(low=low, high=high, colour=colour))

    def grid(self, ticks: Sequence[float], direction: Direction, colour: str, zero: str = "") -> None:
        """Draws a line at each tick, from edge to edge; `zero` is the colour of that at zero."""
        self.inside.append(Grid(ticks=ticks, direction=direction, colour=colour, zero=zero))

    def rounded(self, box: Box, radius: float, face: str, edge: str) -> None:
        """Draws a rectangle with round corners; `box` is in numbers of the panel, its radius in points."""
        self.inside.append(Rounded(box=box, radius=radius, face=face, edge=edge))

    def text(
        self,
        x: float,
        y: float,
        text: str,
        *,
        color: str,
        frames: tuple[Frame, Frame] = ("data", "data"),
        shift: tuple[float, float] = (0.0, 0.0),
        ha: Side = "left",
        va: Height = "baseline",
        size: float = 8.0,
        rotation: float = 0.0,
        bold: bool = False,
        of_axis: bool = False,
    ) -> None:
        """Writes text beside a place, which is counted in `frames` and moved right and up by `shift`.

        `rotation` is in deg, counter-clockwise about the place. A new line begins a new line.
        """
        mark = Text(
            x=x,
            y=y,
            text=text,
            colour=color,
            frames=frames,
            shift=shift,
            side=ha,
            height=va,
            size=size,
            rotation=rotation,
            bold=bold,
            of_axis=of_axis,
        )
        self.over.append(mark)


class Figure:
    """Panels on one sheet of that many inches."""

    def __init__(self, width: float, height: float) -> None:
        self.width, self.height = POINTS * width, POINTS * height
        """Points."""
        self.panels: list[Axes] = []

    def add_axes(self, box: Box) -> Axes:
        """Adds a panel."""
        left, bottom, width, height = (POINTS * length for length in box)
        axes = Axes(left, self.height - bottom - height, width, height)
        self.panels.append(axes)
        return axes
