"""A figure drawn straight to SVG: panels with linear scales that hold lines, points, bars and text.

A batch has thousands of small figures, of which each takes a millisecond here and 70 in a library for plots.
Boxes of panels are in inches, line widths, sizes and shifts in points, 72 an inch, all else in the numbers of
the panel. Nothing is drawn before the figure is asked for, so that limits may be set at any time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Literal, TypeAlias

import numpy as np
from markupsafe import escape
from numpy.typing import ArrayLike, NDArray

Box: TypeAlias = tuple[float, float, float, float]
"""Left, bottom, width and height; of a panel in inches."""
Range: TypeAlias = tuple[float, float]
Paint: TypeAlias = Callable[[str], str]
"""Gives what a drawing colour is called where the figure will stand."""
Frame: TypeAlias = Literal["data", "panel"]
"""Frame of a place: numbers of the panel, or shares of its width or height."""

Side: TypeAlias = Literal["left", "center", "right"]
"""Place of a text relative to its point: left end, middle, right end."""

POINTS = 72.0
"""An inch."""

_LINES, _TEXT = 2.0, 3.0
"""Usual order: what is drawn later covers what is drawn before."""
_ANCHORS = {"left": "start", "center": "middle", "right": "end"}
_BELOW = {"baseline": 0.0, "center": 0.36, "top": 0.78, "bottom": -0.22}
"""Distance of the baseline of a text below its place, in sizes of the text."""
_LINE_HEIGHT = 1.2
"""Line height of text, in font sizes."""
_HATCHES = {"////": "M-1 1l2 -2M0 6l6 -6M5 7l2 -2", "xxxx": "M0 0l6 6M6 0l-6 6"}
_HATCH_CELL = 6
_HATCH_WIDTH = 0.6

_SHAPES = {
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


class Definitions:
    """Definitions that a figure refers to by identifier: markers, hatches, edges of panels."""

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._names: dict[str, str] = {}

    def name(self, element: str) -> str:
        """Returns the identifier of an element, which is written with `ID` in the place of its own."""
        return self._names.setdefault(element, f"{self._prefix}-{len(self._names)}")

    def svg(self) -> str:
        """Writes all elements that were named."""
        elements = [element.replace("ID", name, 1) for element, name in self._names.items()]
        return f"<defs>{''.join(elements)}</defs>" if elements else ""


Mark: TypeAlias = Callable[[Paint, Definitions], str]


class Axes:
    """One panel: a box on paper, with the range of numbers shown in each direction."""

    def __init__(self, left: float, top: float, width: float, height: float) -> None:
        self._place = left, top, width, height
        self._across: Range = (0.0, 1.0)
        self._up: Range = (0.0, 1.0)
        self._inside: list[tuple[float, Mark]] = []
        self._over: list[tuple[float, Mark]] = []

    def set_xlim(self, low: float, high: float) -> None:
        """Sets what the left and the right edge stand for."""
        self._across = float(low), float(high)

    def set_ylim(self, low: float, high: float) -> None:
        """Sets what the lower and the upper edge stand for."""
        self._up = float(low), float(high)

    def get_xlim(self) -> Range:
        """Returns what the left and the right edge stand for."""
        return self._across

    def get_ylim(self) -> Range:
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
        across, up = np.asarray(x, dtype=float), np.asarray(y, dtype=float)

        def draw(paint: Paint, _: Definitions) -> str:
            style = f"fill:none;stroke:{paint(colour)};stroke-width:{_short(width)}"
            dashed = f";stroke-dasharray:{dash}" if dash else ""
            return f'<path d="{_path(self._right(across), self._down(up))}" style="{style}{dashed}"/>'

        self._inside.append((order, draw))

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
        across, up = np.asarray(x, dtype=float), np.asarray(y, dtype=float)

        def draw(paint: Paint, definitions: Definitions) -> str:
            shape = definitions.name(f'<path id="ID" d="{_marker(marker, size)}"/>')
            name = paint(colour)
            style = f"fill:{'none' if hollow or marker == 'x' else name};stroke:{name}"
            seen = f";opacity:{_short(opacity)}" if opacity < 1.0 else ""
            places = zip(
                self._right(across).tolist(),
                self._down(up).tolist(),
                titles or [""] * len(across),
                strict=True,
            )
            uses = "".join(
                f'<use href="#{shape}" x="{_short(right)}" y="{_short(down)}"{_titled("use", title)}'
                for right, down, title in places
                if np.isfinite(right + down)
            )
            return f'<g style="{style};stroke-width:{_short(edge)}{seen}">{uses}</g>'

        (self._inside if clipped else self._over).append((order, draw))

    def bars(
        self,
        spans: Iterable[Range],
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
        spans = list(spans)

        def draw(paint: Paint, definitions: Definitions) -> str:
            fill = f"url(#{definitions.name(_hatch(hatch, paint(colour), paint(ink)))})" if hatch else ""
            ends = self._down(np.array([low, low + height]))
            top, bottom = float(ends.min()), float(ends.max())
            rows = [sorted(self._right(np.array(span)).tolist()) for span in spans]
            shapes = "".join(
                f"M{left:.1f} {top:.1f}H{right:.1f}V{bottom:.1f}H{left:.1f}Z" for left, right in rows
            )
            return f'<path d="{shapes}" style="fill:{fill or paint(colour)}"{_titled("path", title)}'

        self._inside.append((order, draw))

    def band(self, low: float, high: float, colour: str) -> None:
        """Fills what lies between two heights, across the whole panel, behind everything."""

        def draw(paint: Paint, _: Definitions) -> str:
            left, _top, width, _height = self._place
            top, bottom = sorted(self._down(np.array([low, high])).tolist())
            return (
                f'<rect x="{_short(left)}" y="{_short(top)}" width="{_short(width)}" '
                f'height="{_short(bottom - top)}" style="fill:{paint(colour)}"/>'
            )

        self._inside.append((-1.0, draw))

    def grid(self, ticks: Sequence[float], direction: Literal["x", "y"], colour: str, zero: str = "") -> None:
        """Draws a line at each tick, from edge to edge; `zero` is the colour of that at zero."""

        def draw(paint: Paint, _: Definitions) -> str:
            left, top, width, height = self._place
            plain = [tick for tick in ticks if not (zero and tick == 0)]
            groups = [(colour, 0.6, plain), (zero, 0.7, [0.0] if len(plain) < len(ticks) else [])]
            text = ""
            for name, thickness, chosen in groups:
                if not chosen:
                    continue
                if direction == "x":
                    places = self._right(np.array(chosen)).tolist()
                    lines = "".join(f"M{place:.1f} {top:.1f}v{height:.1f}" for place in places)
                else:
                    places = self._down(np.array(chosen)).tolist()
                    lines = "".join(f"M{left:.1f} {place:.1f}h{width:.1f}" for place in places)
                text += f'<path d="{lines}" style="stroke:{paint(name)};stroke-width:{thickness}"/>'
            return text

        self._inside.append((0.0, draw))

    def rounded(self, box: Box, radius: float, face: str, edge: str) -> None:
        """Draws a rectangle with round corners; `box` is in numbers of the panel, its radius in points."""
        left, low, width, height = box

        def draw(paint: Paint, _: Definitions) -> str:
            right = self._right(np.array([left, left + width]))
            down = self._down(np.array([low, low + height]))
            size = abs(float(right[1] - right[0])), abs(float(down[1] - down[0]))
            return (
                f'<rect x="{_short(right.min())}" y="{_short(down.min())}" width="{_short(size[0])}" '
                f'height="{_short(size[1])}" rx="{_short(radius)}" '
                f'style="fill:{paint(face)};stroke:{paint(edge)}"/>'
            )

        self._inside.append((1.0, draw))

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
        va: Literal["baseline", "center", "top", "bottom"] = "baseline",
        size: float = 8.0,
        rotation: float = 0.0,
        bold: bool = False,
    ) -> None:
        """Writes text beside a place, which is counted in `frames` and moved right and up by `shift`.

        `rotation` is in deg, counter-clockwise about the place. A new line begins a new line.
        """

        def draw(paint: Paint, _: Definitions) -> str:
            left, top, width, height = self._place
            right = left + x * width if frames[0] == "panel" else float(self._right(np.array(x)))
            down = top + (1.0 - y) * height if frames[1] == "panel" else float(self._down(np.array(y)))
            right, down = right + shift[0], down - shift[1]
            lines = text.split("\n")
            below = _BELOW[va] - (0.5 * _LINE_HEIGHT * (len(lines) - 1) if va == "center" else 0.0)
            style = f"font-size:{_short(size)}px;fill:{paint(color)}"
            style += f";text-anchor:{_ANCHORS[ha]}" if ha != "left" else ""
            style += ";font-weight:bold" if bold else ""
            turn = f' transform="rotate({-rotation:g} {_short(right)} {_short(down)})"' if rotation else ""
            return "".join(
                f'<text x="{_short(right)}" y="{_short(down + (below + _LINE_HEIGHT * number) * size)}" '
                f'style="{style}"{turn}>{escape(line)}</text>'
                for number, line in enumerate(lines)
            )

        self._over.append((_TEXT, draw))

    def svg(self, paint: Paint, definitions: Definitions) -> Iterator[str]:
        """Writes what is inside, cut off at the edges, then what may stand over them."""
        left, top, width, height = map(_short, self._place)
        if self._inside:
            edges = definitions.name(
                f'<clipPath id="ID"><rect x="{left}" y="{top}" width="{width}" height="{height}"/></clipPath>'
            )
            yield f'<g clip-path="url(#{edges})">'
            yield from (draw(paint, definitions) for _, draw in sorted(self._inside, key=_order))
            yield "</g>"
        yield from (draw(paint, definitions) for _, draw in sorted(self._over, key=_order))

    def _right(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        left, _, width, _ = self._place
        low, high = self._across
        return np.asarray(left + (x - low) * (width / (high - low)))

    def _down(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        _, top, _, height = self._place
        low, high = self._up
        return np.asarray(top + (high - y) * (height / (high - low)))


class Figure:
    """Panels on one sheet of that many inches."""

    def __init__(self, width: float, height: float) -> None:
        self.width, self.height = POINTS * width, POINTS * height
        """Points."""
        self._panels: list[Axes] = []

    def add_axes(self, box: Box) -> Axes:
        """Adds a panel."""
        left, bottom, width, height = (POINTS * length for length in box)
        axes = Axes(left, self.height - bottom - height, width, height)
        self._panels.append(axes)
        return axes

    def svg(self, paint: Paint, prefix: str) -> str:
        """Writes all panels; what is referred to has identifiers that begin with `prefix`."""
        definitions = Definitions(prefix)
        body = "".join(part for axes in self._panels for part in axes.svg(paint, definitions))
        return definitions.svg() + body


def _order(mark: tuple[float, Mark]) -> float:
    return mark[0]


def _titled(element: str, title: str) -> str:
    """Closes an element, around its title if it has one."""
    return f"><title>{escape(title)}</title></{element}>" if title else "/>"


def _short(number: float) -> str:
    text = f"{number:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _path(right: NDArray[np.float64], down: NDArray[np.float64]) -> str:
    """Writes a line, without the points of a level stretch that are not its ends."""
    known = np.isfinite(right) & np.isfinite(down)
    tenths = np.where(known, np.round(10.0 * np.where(known, down, 0.0)), np.nan)
    corner = np.ones(len(right), dtype=bool)
    corner[1:-1] = ~((tenths[1:-1] == tenths[:-2]) & (tenths[1:-1] == tenths[2:]))
    parts: list[str] = []
    begun = False
    for shown, x, y in zip(
        known[corner].tolist(), right[corner].tolist(), down[corner].tolist(), strict=True
    ):
        if shown:
            parts.append(f"{'L' if begun else 'M'}{x:.1f} {y:.1f}")
        begun = shown
    return "".join(parts)


def _marker(kind: str, size: float) -> str:
    half = size / 2.0
    if kind == "o":
        return f"M{-half:g} 0a{half:g} {half:g} 0 1 0 {size:g} 0a{half:g} {half:g} 0 1 0 {-size:g} 0z"
    if kind == "x":
        return f"M{-half:g} {-half:g}l{size:g} {size:g}M{-half:g} {half:g}l{size:g} {-size:g}"
    return "M" + "L".join(f"{_short(half * x)} {_short(half * y)}" for x, y in _SHAPES[kind]) + "z"


def _hatch(kind: str, face: str, ink: str) -> str:
    cell = _HATCH_CELL
    return (
        f'<pattern id="ID" width="{cell}" height="{cell}" patternUnits="userSpaceOnUse">'
        f'<rect width="{cell}" height="{cell}" style="fill:{face}"/>'
        f'<path d="{_HATCHES[kind]}" style="stroke:{ink};stroke-width:{_HATCH_WIDTH}"/></pattern>'
    )
