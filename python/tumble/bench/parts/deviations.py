"""Deviations of units over time against their thresholds: curves, and the newest ones in words."""

from __future__ import annotations

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block
from tumble.bench.parts.plot import Plot, PlotAxis, PlotLine
from tumble.report.numbers import readable_unit
from tumble.tools.guided.figures import DeviationFigure, DeviationSeries

SMALLEST = 1e-3
"""Share of a threshold below which a deviation is drawn there: the axis is logarithmic."""
RATIO = "1"
"""Unit of a deviation over its threshold."""


class DeviationPart:
    """The chart of one sensor."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._plot: Plot | None = None
        with block("panel figure"):
            self._title = Label("", "section", "h2")
            self._plot_box = block("plot-box")
            self._words = Label("", "figure-words")

    def show(self, figure: DeviationFigure) -> None:
        """Draws a figure."""
        page = self._page
        self._title.show(page.text(figure.title))
        if self._plot is None:
            with self._plot_box:
                self._plot = Plot(PlotAxis(page.words("time, s")), PlotAxis(_name(page, figure), log=True))
        words = "; ".join(self._newest(each, figure) for each in figure.series)
        self._words.show(words)
        lines = [_line(place, each) for place, each in enumerate(figure.series)]
        limit = None if figure.threshold is None else (figure.threshold, page.words("threshold"))
        self._plot.show(
            lines, label=f"{page.text(figure.title)}. {words}", limit=limit, marks=figure.marks[-6:]
        )

    def _newest(self, series: DeviationSeries, figure: DeviationFigure) -> str:
        page, value = self._page, series.value[-1]
        unit = "" if figure.unit == RATIO else f" {readable_unit(figure.unit)}"
        if figure.threshold is None:
            return f"{series.name} {value:.2g}{unit}"
        if series.note:
            return f"{series.name} {value:.2g}{unit}, {page.text(series.note)}"
        if value > figure.threshold:
            return page.words("✕ {name} {value}, beyond", name=series.name, value=f"{value:.2g}{unit}")
        return page.words("✓ {name} {value}, within", name=series.name, value=f"{value:.2g}{unit}")


def _name(page: PageContext, figure: DeviationFigure) -> str:
    if figure.unit == RATIO:
        return page.words("over the threshold")
    return f"{page.words('deviation')}, {readable_unit(figure.unit)}"


def _line(place: int, series: DeviationSeries) -> PlotLine:
    points = zip(series.time, series.value, strict=True)
    return PlotLine(
        series.name, tuple((time, max(value, SMALLEST)) for time, value in points), place, dash=place // 4
    )
