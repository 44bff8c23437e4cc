"""Allan deviations that grow while a log is recorded: curves with intervals, and figures in words."""

from __future__ import annotations

import math

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block
from tumble.bench.parts.plot import Plot, PlotAxis, PlotLine
from tumble.foundation.results import INTERVAL
from tumble.foundation.words import length_of_time
from tumble.report.numbers import readable_scale, readable_unit, significant
from tumble.tools.guided.figures import AllanCurve, AllanFigure

AT = 1.0
"""s of averaging at which the deviation is white noise of most sensors."""


class AllanPart:
    """The chart of one triad."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._plot: Plot | None = None
        with block("panel figure") as self._box:
            self._title = Label("", "section", "h2")
            self._plot_box = block("plot-box")
            self._words = Label("", "figure-words")

    def show(self, figure: AllanFigure) -> None:
        """Draws a figure."""
        page = self._page
        self._title.show(page.text(figure.title))
        if self._plot is None:
            with self._plot_box:
                y = PlotAxis(f"{page.words('deviation')}, {readable_unit(figure.unit)}", log=True)
                self._plot = Plot(PlotAxis(page.words("averaging time, s"), log=True), y)
        words = self._in_words(figure)
        self._words.show(words)
        lines = [_line(place, curve) for place, curve in enumerate(figure.curves)]
        self._plot.show(lines, label=f"{page.text(figure.title)}. {words}")

    def _in_words(self, figure: AllanFigure) -> str:
        page = self._page
        found = {curve.name: _at(curve, AT) for curve in figure.curves}
        scale = readable_scale(figure.unit, max(found.values()))
        shown = ", ".join(f"{name} {significant(scale.factor * each)}" for name, each in found.items())
        longest = max(curve.tau[-1] for curve in figure.curves)
        return page.words(
            "At {at} s: {shown} {unit}. Longest average {longest}.",
            at=f"{AT:g}",
            shown=shown,
            unit=scale.unit,
            longest=length_of_time(longest),
        )


def _line(place: int, curve: AllanCurve) -> PlotLine:
    sigmas = curve.sigma or (math.nan,) * len(curve.tau)
    rows = [
        (tau, deviation, sigma)
        for tau, deviation, sigma in zip(curve.tau, curve.deviation, sigmas, strict=True)
        if deviation > 0.0
    ]
    return PlotLine(
        curve.name,
        tuple((tau, deviation) for tau, deviation, _ in rows),
        colour=place,
        dash=place // 4,
        intervals=tuple(
            (tau, max(deviation - INTERVAL * sigma, 0.05 * deviation), deviation + INTERVAL * sigma)
            for tau, deviation, sigma in rows
            if math.isfinite(sigma)
        ),
    )


def _at(curve: AllanCurve, tau: float) -> float:
    """Returns the deviation at the averaging time that is nearest."""
    nearest = min(range(len(curve.tau)), key=lambda place: abs(math.log(curve.tau[place] / tau)))
    return curve.deviation[nearest]
