"""A sphere of directions: those held, the next one, and the present one with the way to it."""

from __future__ import annotations

import math
from collections.abc import Sequence

# Registers three.js, which the component imports.
import nicegui.elements.scene  # noqa: F401
from nicegui.element import Element

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, set_attribute
from tumble.tools.guided.figures import CaseDirection, SphereFigure


class Sphere(Element, component="sphere.js"):
    """Shows directions; the camera follows the next one smoothly."""

    def show(self, figure: SphereFigure) -> None:
        """Shows a figure."""
        shown = {
            "held": [_rounded(each) for each in figure.held],
            "wanted": _rounded(figure.wanted),
            "now": _rounded(figure.now),
        }
        if any(self._props.get(name) != value for name, value in shown.items()):
            self._props |= shown
            self.update()


class SpherePart:
    """The sphere with its legend, which states the same in words."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        with block("panel figure", role="group") as box:
            self._box = box
            self._title = Label("", "section", "h2")
            self._sphere = Sphere().classes("sphere")
            with block("legend"):
                self._held = Label("", "legend-item good")
                self._wanted = Label("", "legend-item warn")
                self._now = Label("", "legend-item here")
        self._sphere._props["role"] = "img"

    def show(self, figure: SphereFigure) -> None:
        """Draws a figure."""
        page = self._page
        self._title.show(page.text(figure.title))
        self._sphere.show(figure)
        held = page.words("{count} held", count=len(figure.held))
        self._held.show(f"✓ {held}")
        self._wanted.show(f"◎ {page.words('next')}" if figure.wanted else "")
        self._now.show(f"◆ {page.words('now')}" if figure.now else "")
        set_attribute(self._sphere, "aria-label", self._words(figure))
        set_attribute(self._box, "aria-label", page.text(figure.title))

    def _words(self, figure: SphereFigure) -> str:
        page = self._page
        title, count = page.text(figure.title), len(figure.held)
        words = page.words("{title}: {count} on the sphere.", title=title, count=count)
        if figure.wanted is None or figure.now is None:
            return words
        # A text that changed with each degree would not be read to its end.
        angle = 10 * round(_degrees(figure.wanted, figure.now) / 10)
        return f"{words} {page.words('The next one is about {angle} degrees away.', angle=angle)}"


def _rounded(direction: CaseDirection | None) -> list[float] | None:
    return None if direction is None else [round(each, 2) for each in direction]


def _degrees(one: Sequence[float], other: Sequence[float]) -> float:
    cosine = sum(a * b for a, b in zip(one, other, strict=True))
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
