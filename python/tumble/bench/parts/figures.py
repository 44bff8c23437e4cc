"""FigureParts of a run, as far as its views have any: a part for each type of figure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from tumble.bench.page.context import PageContext
from tumble.bench.parts.allan import AllanPart
from tumble.bench.parts.deviations import DeviationPart
from tumble.bench.parts.elements import block
from tumble.bench.parts.events import EventPart
from tumble.bench.parts.sphere import SpherePart
from tumble.bench.parts.states import StatePart
from tumble.tools.guided.figures import (
    AllanFigure,
    DeviationFigure,
    EventFigure,
    RunFigure,
    SphereFigure,
    StateFigure,
)


class FigurePart(Protocol):
    """Draws one figure after another of its type."""

    def show(self, figure: Any) -> None:  # noqa: ANN401 - of its own type
        """Draws a figure."""


FIGURE_PARTS: dict[type[object], Callable[[PageContext], FigurePart]] = {
    SphereFigure: SpherePart,
    AllanFigure: AllanPart,
    DeviationFigure: DeviationPart,
    StateFigure: StatePart,
    EventFigure: EventPart,
}
"""Part for each type of figure."""


class FigureParts:
    """The figures of the newest view, side by side."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._box = block("figures")
        self._types: tuple[type[object], ...] = ()
        self._parts: list[FigurePart] = []

    def show(self, figures: tuple[RunFigure, ...]) -> None:
        """Draws figures; parts are made anew only where others are wanted."""
        drawn = [figure for figure in figures if type(figure) in FIGURE_PARTS]
        types = tuple(map(type, drawn))
        if types != self._types:
            self._types = types
            self._box.clear()
            with self._box:
                self._parts = [FIGURE_PARTS[each](self._page) for each in types]
        for part, figure in zip(self._parts, drawn, strict=True):
            part.show(figure)
