"""From a matplotlib figure to SVG inside a page: small, repeatable, and dark where the page is dark.

Matplotlib keeps its settings in one global table, so drawing takes a lock and puts the table back afterwards.
No pyplot: every figure is its own object.
"""

from __future__ import annotations

import io
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any
from xml.etree import ElementTree

import matplotlib as mpl
from markupsafe import Markup
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

INK = "#1b2227"
SOFT = "#5d6870"
GRID = "#dfe4e8"
PANEL = "#f3f6f8"
REST = "#e3edf5"
UNUSED = "#efe3d6"
ALARM = "#c24400"
X_AXIS, Y_AXIS, Z_AXIS = "#0072b2", "#d55e00", "#009e73"
"""Okabe and Ito's palette, which colour-blind readers tell apart: https://jfly.uni-koeln.de/color/."""

AXIS_COLOURS = (X_AXIS, Y_AXIS, Z_AXIS)
AXIS_MARKERS = ("o", "s", "^")
AXIS_NAMES = ("x", "y", "z")

PAGE_COLOURS = MappingProxyType(
    {
        INK: "ink",
        SOFT: "soft",
        GRID: "grid",
        PANEL: "panel",
        REST: "rest",
        UNUSED: "unused",
        ALARM: "alarm",
        X_AXIS: "x",
        Y_AXIS: "y",
        Z_AXIS: "z",
    }
)
"""Each drawing colour, and the CSS variable of the page that stands for it."""

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "tumble report",
    "text.parse_math": False,
    "font.family": ["sans-serif"],
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8.0,
    "text.color": INK,
    "lines.solid_capstyle": "butt",
    "lines.linewidth": 1.0,
    "hatch.linewidth": 0.6,
    "hatch.color": SOFT,
    "path.simplify_threshold": 0.4,
}

_SVG = "{http://www.w3.org/2000/svg}"
_XLINK_REFERENCE = "{http://www.w3.org/1999/xlink}href"
_LONG_DECIMAL = re.compile(r"-?\d+\.\d{2,}(?![\d.]*e)")
_REFERENCE = re.compile(r"url\(#([^)]+)\)")
_COLOUR = re.compile(r"#[0-9a-fA-F]{6}\b")
_FONT = re.compile(r"font: (?:(\w+) )?([\d.]+px) [^;]*")
_LENGTHS = frozenset({"d", "x", "y", "width", "height", "transform", "points"})

_drawing = threading.RLock()


@contextmanager
def house_style() -> Iterator[None]:
    """Hold matplotlib's settings at this module's style, whatever the user's are, until the block ends."""
    with _drawing, mpl.rc_context():
        held_already = mpl.rcParams["svg.hashsalt"] == _STYLE["svg.hashsalt"]
        if not held_already:
            mpl.rcdefaults()
            mpl.rcParams.update(_STYLE)
        yield


def new_figure(width: float, height: float) -> Figure:
    """Make an empty figure of that many inches, drawn to SVG and to nothing else."""
    figure = Figure(figsize=(width, height), frameon=False)
    FigureCanvasSVG(figure)
    return figure


def inline_svg(figure: Figure, prefix: str, label: str) -> Markup:
    """Turn the figure into an `<svg>` element for a page, in the page's colours.

    Its identifiers start with `prefix`, so that no two figures of a page share one. `label` is what
    a screen reader says. To be called inside `house_style`.
    """
    root = _parse(figure)
    root.attrib = {
        "viewBox": root.attrib["viewBox"],
        "xmlns": "http://www.w3.org/2000/svg",
        "role": "img",
        "aria-label": label,
    }
    _tidy(root, prefix, page_colours=True)
    return Markup(_text(root))


def standalone_svg(figure: Figure, title: str) -> str:
    """Turn the figure into a file of its own, with fixed colours. To be called inside `house_style`."""
    root = _parse(figure)
    width, height = root.attrib["viewBox"].split()[2:]
    root.attrib = {
        "viewBox": root.attrib["viewBox"],
        "xmlns": "http://www.w3.org/2000/svg",
        "width": width,
        "height": height,
        "font-family": "system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif",
        "role": "img",
    }
    _tidy(root, "f", page_colours=False)
    heading = ElementTree.Element("title")
    heading.text = title
    root.insert(0, heading)
    return _text(root) + "\n"


def _parse(figure: Figure) -> ElementTree.Element:
    target = io.StringIO()
    figure.savefig(target, format="svg", metadata={"Date": None, "Creator": None})
    return ElementTree.fromstring(target.getvalue())


def _tidy(root: ElementTree.Element, prefix: str, *, page_colours: bool) -> None:
    for element in list(root):
        is_global_style = element.tag == f"{_SVG}defs" and element.find(f"{_SVG}style") is not None
        if element.tag == f"{_SVG}metadata" or is_global_style:
            root.remove(element)
    names = _names_in_use(root, prefix)
    for element in root.iter():
        element.tag = element.tag.removeprefix(_SVG)
        element.attrib = dict(_tidy_attributes(element.attrib, names, page_colours=page_colours))
        if element.tag != "text" and element.text and not element.text.strip():
            element.text = None
        element.tail = None if not (element.tail or "").strip() else element.tail
    for element in root.iter("g"):
        _say_style_once(element)


def _say_style_once(group: ElementTree.Element) -> None:
    """Let the group carry the style that its many markers share: half the weight of a cloud of points."""
    uses = group.findall("use")
    styles = {each.get("style") for each in uses}
    if len(uses) < 2 or len(styles) > 1 or None in styles or "style" in group.attrib:
        return
    group.set("style", str(styles.pop()))
    for each in uses:
        del each.attrib["style"]


def _names_in_use(root: ElementTree.Element, prefix: str) -> dict[str, str]:
    """Give short names to the identifiers that something refers to, in order of appearance."""
    used: dict[str, str] = {}
    for element in root.iter():
        for key, value in element.attrib.items():
            found = [value.removeprefix("#")] if key == _XLINK_REFERENCE else _REFERENCE.findall(value)
            for name in found:
                used.setdefault(name, f"{prefix}-{len(used)}")
    return used


def _tidy_attributes(
    attributes: dict[str, str], names: dict[str, str], *, page_colours: bool
) -> Iterator[tuple[str, str]]:
    for key, value in attributes.items():
        if key == "id":
            if value in names:
                yield key, names[value]
        elif key == _XLINK_REFERENCE:
            yield "href", "#" + names[value.removeprefix("#")]
        elif key in _LENGTHS:
            yield key, _LONG_DECIMAL.sub(_shorten, value).strip()
        elif page_colours and _COLOUR.fullmatch(value):
            yield "style", f"{key}: {_COLOUR.sub(_page_colour, value)}"  # var() is known to styles only
        elif key == "style":
            yield key, _tidy_style(value, names, page_colours=page_colours)
        else:
            yield key, _REFERENCE.sub(lambda match: f"url(#{names[match[1]]})", value)


def _tidy_style(style: str, names: dict[str, str], *, page_colours: bool) -> str:
    style = _REFERENCE.sub(lambda match: f"url(#{names[match[1]]})", style)
    style = _FONT.sub(_font_without_family, style)
    return _COLOUR.sub(_page_colour, style) if page_colours else style


def _font_without_family(match: re.Match[str]) -> str:
    weight, size = match.groups()
    return f"font-size: {size}" + (f"; font-weight: {weight}" if weight else "")


def _shorten(match: re.Match[str]) -> str:
    return f"{float(match[0]):.2f}".rstrip("0").rstrip(".")


def _page_colour(match: re.Match[str]) -> str:
    return f"var(--{PAGE_COLOURS[match[0].lower()]})"


def _text(root: ElementTree.Element) -> str:
    return ElementTree.tostring(root, encoding="unicode")
