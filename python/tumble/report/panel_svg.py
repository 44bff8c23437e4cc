"""Panels of a figure as SVG text."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np
from markupsafe import escape

from tumble.foundation.arrays import FloatArray
from tumble.report.canvas import (
    MARKERS,
    Axes,
    Band,
    Bars,
    Figure,
    Grid,
    LineMark,
    Mark,
    Points,
    Rounded,
    Text,
)

Paint: TypeAlias = Callable[[str], str]
"""Gives what a drawing colour is called where the figure will stand."""

_ANCHORS = {"left": "start", "center": "middle", "right": "end"}
_BELOW = {"baseline": 0.0, "center": 0.36, "top": 0.78, "bottom": -0.22}
"""Distance of the baseline of a text below its place, in sizes of the text."""
_LINE_HEIGHT = 1.2
"""Line height of text, in font sizes."""
_HATCHES = {"////": "M-1 1l2 -2M0 6l6 -6M5 7l2 -2", "xxxx": "M0 0l6 6M6 0l-6 6"}
_HATCH_CELL = 6
_HATCH_WIDTH = 0.6


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


def figure_svg(figure: Figure, paint: Paint, prefix: str) -> str:
    """Writes all panels; what is referred to has identifiers that begin with `prefix`."""
    definitions = Definitions(prefix)
    body = "".join(part for axes in figure.panels for part in _Panel(axes, paint, definitions).parts())
    return definitions.svg() + body


class _Panel:
    """Writes the marks of one panel."""

    def __init__(self, axes: Axes, paint: Paint, definitions: Definitions) -> None:
        self._axes, self._paint, self._definitions = axes, paint, definitions
        self._left, self._top, self._width, self._height = axes.place

    def parts(self) -> Iterator[str]:
        """Writes what is inside, cut off at the edges, then what may stand over them."""
        if self._axes.inside:
            left, top, width, height = map(_short, self._axes.place)
            edges = self._definitions.name(
                f'<clipPath id="ID"><rect x="{left}" y="{top}" width="{width}" height="{height}"/></clipPath>'
            )
            yield f'<g clip-path="url(#{edges})">'
            yield from map(self._mark, sorted(self._axes.inside, key=_order))
            yield "</g>"
        yield from map(self._mark, sorted(self._axes.over, key=_order))

    def _mark(self, mark: Mark) -> str:
        match mark:
            case LineMark():
                return self._line(mark)
            case Points():
                return self._points(mark)
            case Bars():
                return self._bars(mark)
            case Band():
                return self._band(mark)
            case Grid():
                return self._grid(mark)
            case Rounded():
                return self._rounded(mark)
            case Text():
                return self._text(mark)

    def _line(self, line: LineMark) -> str:
        style = f"fill:none;stroke:{self._paint(line.colour)};stroke-width:{_short(line.width)}"
        dashed = f";stroke-dasharray:{line.dash}" if line.dash else ""
        return f'<path d="{_path(self._right(line.x), self._down(line.y))}" style="{style}{dashed}"/>'

    def _points(self, points: Points) -> str:
        shape = self._definitions.name(f'<path id="ID" d="{_marker(points.marker, points.size)}"/>')
        name = self._paint(points.colour)
        empty = points.hollow or points.marker == "x"
        style = f"fill:{'none' if empty else name};stroke:{name};stroke-width:{_short(points.edge)}"
        seen = f";opacity:{_short(points.opacity)}" if points.opacity < 1.0 else ""
        places = zip(
            self._right(points.x).tolist(),
            self._down(points.y).tolist(),
            points.titles or [""] * len(points.x),
            strict=True,
        )
        uses = "".join(
            f'<use href="#{shape}" x="{_short(right)}" y="{_short(down)}"{_titled("use", title)}'
            for right, down, title in places
            if np.isfinite(right + down)
        )
        return f'<g style="{style}{seen}">{uses}</g>'

    def _bars(self, bars: Bars) -> str:
        fill = self._paint(bars.colour)
        if bars.hatch:
            fill = f"url(#{self._definitions.name(_hatch(bars.hatch, fill, self._paint(bars.ink)))})"
        ends = self._down(np.array([bars.low, bars.low + bars.height]))
        top, bottom = float(ends.min()), float(ends.max())
        rows = [sorted(self._right(np.array(span)).tolist()) for span in bars.spans]
        shapes = "".join(
            f"M{left:.1f} {top:.1f}H{right:.1f}V{bottom:.1f}H{left:.1f}Z" for left, right in rows
        )
        return f'<path d="{shapes}" style="fill:{fill}"{_titled("path", bars.title)}'

    def _band(self, band: Band) -> str:
        top, bottom = sorted(self._down(np.array([band.low, band.high])).tolist())
        return (
            f'<rect x="{_short(self._left)}" y="{_short(top)}" width="{_short(self._width)}" '
            f'height="{_short(bottom - top)}" style="fill:{self._paint(band.colour)}"/>'
        )

    def _grid(self, grid: Grid) -> str:
        plain = [tick for tick in grid.ticks if not (grid.zero and tick == 0)]
        groups = [(grid.colour, 0.6, plain), (grid.zero, 0.7, [0.0] if len(plain) < len(grid.ticks) else [])]
        return "".join(
            f'<path d="{self._across(ticks, grid)}" style="stroke:{self._paint(name)};'
            f'stroke-width:{thickness}"/>'
            for name, thickness, ticks in groups
            if ticks
        )

    def _across(self, ticks: list[float], grid: Grid) -> str:
        if grid.direction == "x":
            places = self._right(np.array(ticks)).tolist()
            return "".join(f"M{place:.1f} {self._top:.1f}v{self._height:.1f}" for place in places)
        places = self._down(np.array(ticks)).tolist()
        return "".join(f"M{self._left:.1f} {place:.1f}h{self._width:.1f}" for place in places)

    def _rounded(self, rounded: Rounded) -> str:
        left, low, width, height = rounded.box
        right = self._right(np.array([left, left + width]))
        down = self._down(np.array([low, low + height]))
        size = abs(float(right[1] - right[0])), abs(float(down[1] - down[0]))
        return (
            f'<rect x="{_short(right.min())}" y="{_short(down.min())}" width="{_short(size[0])}" '
            f'height="{_short(size[1])}" rx="{_short(rounded.radius)}" '
            f'style="fill:{self._paint(rounded.face)};stroke:{self._paint(rounded.edge)}"/>'
        )

    def _text(self, text: Text) -> str:
        in_panel = [frame == "panel" for frame in text.frames]
        right = self._left + text.x * self._width if in_panel[0] else float(self._right(np.array(text.x)))
        down = (
            self._top + (1.0 - text.y) * self._height if in_panel[1] else float(self._down(np.array(text.y)))
        )
        right, down = right + text.shift[0], down - text.shift[1]
        lines = text.text.split("\n")
        middle = 0.5 * _LINE_HEIGHT * (len(lines) - 1) if text.height == "center" else 0.0
        below = _BELOW[text.height] - middle
        style = f"font-size:{_short(text.size)}px;fill:{self._paint(text.colour)}"
        style += f";text-anchor:{_ANCHORS[text.side]}" if text.side != "left" else ""
        style += ";font-weight:bold" if text.bold else ""
        place = f"{_short(right)} {_short(down)}"
        turn = f' transform="rotate({-text.rotation:g} {place})"' if text.rotation else ""
        return "".join(
            f'<text x="{_short(right)}" y="{_short(down + (below + _LINE_HEIGHT * number) * text.size)}" '
            f'style="{style}"{turn}>{escape(line)}</text>'
            for number, line in enumerate(lines)
        )

    def _right(self, x: FloatArray) -> FloatArray:
        low, high = self._axes.get_xlim()
        return np.asarray(self._left + (x - low) * (self._width / (high - low)))

    def _down(self, y: FloatArray) -> FloatArray:
        low, high = self._axes.get_ylim()
        return np.asarray(self._top + (high - y) * (self._height / (high - low)))


def _order(mark: Mark) -> float:
    return mark.order


def _titled(element: str, title: str) -> str:
    """Closes an element, around its title if it has one."""
    return f"><title>{escape(title)}</title></{element}>" if title else "/>"


def _short(number: float) -> str:
    text = f"{number:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _path(right: FloatArray, down: FloatArray) -> str:
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
    return "M" + "L".join(f"{_short(half * x)} {_short(half * y)}" for x, y in MARKERS[kind]) + "z"


def _hatch(kind: str, face: str, ink: str) -> str:
    cell = _HATCH_CELL
    return (
        f'<pattern id="ID" width="{cell}" height="{cell}" patternUnits="userSpaceOnUse">'
        f'<rect width="{cell}" height="{cell}" style="fill:{face}"/>'
        f'<path d="{_HATCHES[kind]}" style="stroke:{ink};stroke-width:{_HATCH_WIDTH}"/></pattern>'
    )
