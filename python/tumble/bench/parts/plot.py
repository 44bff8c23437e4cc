"""Lines in a chart of a run: ECharts in the browser, plain data from here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from nicegui.element import Element
from nicegui.elements.echart import EChart

# Its import makes ECharts known to the page.
assert EChart is not None


@dataclass(frozen=True, slots=True)
class PlotAxis:
    """An axis and its name."""

    name: str
    log: bool = False


@dataclass(frozen=True, slots=True)
class PlotLine:
    """A line, and the intervals of its points."""

    name: str
    points: tuple[tuple[float, float], ...]
    colour: int
    """Place in the palette, and among the signs of points."""
    dash: int = 0
    intervals: tuple[tuple[float, float, float], ...] = ()
    """x, low, high."""


class Plot(Element, component="plot.js"):
    """A chart; what is the same is not sent again."""

    def __init__(self, x: PlotAxis, y: PlotAxis) -> None:
        super().__init__()
        self._props |= {"role": "img", "x": _axis(x), "y": _axis(y), "lines": [], "marks": [], "limit": None}
        self._shown: tuple[Any, ...] = ()

    def show(
        self,
        lines: Sequence[PlotLine],
        *,
        label: str,
        limit: tuple[float, str] | None = None,
        marks: Sequence[tuple[float, str]] = (),
    ) -> None:
        """Draws lines; `label` states the same in words, `limit` is a value and its name."""
        shown = (tuple(lines), label, limit, tuple(marks))
        if shown == self._shown:
            return
        self._shown = shown
        self._props |= {
            "lines": [
                {
                    "name": line.name,
                    "colour": line.colour,
                    "dash": line.dash,
                    "points": line.points,
                    "intervals": line.intervals,
                }
                for line in lines
            ],
            "limit": None if limit is None else {"value": limit[0], "name": limit[1]},
            "marks": [list(each) for each in marks],
            "aria-label": label,
        }
        self.update()


def _axis(axis: PlotAxis) -> dict[str, Any]:
    return {"name": axis.name, "log": axis.log}
