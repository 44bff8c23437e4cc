"""From a figure to SVG: inside a page in the page's colours, dark where the page is dark, or as a file."""

from __future__ import annotations

from types import MappingProxyType

from markupsafe import Markup, escape

from tumble.report.canvas import Figure
from tumble.report.panel_svg import figure_svg

INK = "#1b2227"
SOFT = "#5d6870"
GRID = "#dfe4e8"
PANEL = "#f3f6f8"
REST = "#e3edf5"
UNUSED = "#efe3d6"
ALARM = "#c24400"
X_AXIS, Y_AXIS, Z_AXIS = "#0072b2", "#d55e00", "#009e73"
"""Okabe and Ito's palette, which colour-blind readers distinguish: https://jfly.uni-koeln.de/color/."""

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

_NAMESPACE = "http://www.w3.org/2000/svg"
_FONTS = "system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif"


class Drawing(Markup):
    """A figure as an `<svg>` element; `figure` is what it was drawn from, `name` its own on its page."""

    figure: Figure
    name: str
    label: str


def inline_svg(figure: Figure, prefix: str, label: str) -> Drawing:
    """Turns the figure into an `<svg>` element for a page, in the page's colours.

    Its identifiers start with `prefix`, so that no two figures of a page share one. `label` is what
    a screen reader reads.
    """
    body = figure_svg(figure, lambda colour: f"var(--{PAGE_COLOURS[colour]})", prefix)
    size = f"{figure.width:g} {figure.height:g}"
    drawing = Drawing(
        f'<svg viewBox="0 0 {size}" xmlns="{_NAMESPACE}" role="img" aria-label="{escape(label)}">{body}</svg>'
    )
    drawing.figure, drawing.name, drawing.label = figure, prefix, label
    return drawing


def standalone_svg(figure: Figure, title: str) -> str:
    """Turns the figure into a file of its own, with fixed colours."""
    width, height = f"{figure.width:g}", f"{figure.height:g}"
    return (
        f'<svg viewBox="0 0 {width} {height}" xmlns="{_NAMESPACE}" width="{width}" height="{height}" '
        f'font-family="{_FONTS}" role="img"><title>{escape(title)}</title>'
        f"{figure_svg(figure, str, 'f')}</svg>\n"
    )
