"""Draw `docs/images/spin-how-much.svg` from `results/spin_enough.json`.

`python -m benchmarks.spin_chart`
"""

from __future__ import annotations

from math import log10
from pathlib import Path

import numpy as np

from benchmarks.results import Content, load
from tumble.report.canvas import Axes, Figure
from tumble.report.panel import numbered_horizontal_axis, numbered_value_axis
from tumble.report.svg import GRID, INK, SOFT, X_AXIS, Y_AXIS, Z_AXIS, standalone_svg

CHART = Path(__file__).parent.parent / "docs" / "images" / "spin-how-much.svg"
COLOURS = {0.2: "#cc79a7", 0.5: Y_AXIS, 1.0: INK, 2.0: X_AXIS, 3.0: Z_AXIS}
MARKERS = {0.2: "v", 0.5: "s", 1.0: "o", 2.0: "^", 3.0: "D"}
UNITS = ((0, 1e3, "accelerometer bias, mm/s²"), (1, 1e6, "gyroscope bias, µrad/s"))
LIMITS = ((0.6, 6.0), (20.0, 250.0))
"""Limits of the drawn sigmas, in those units."""
PANELS = (
    ("turning", "turns", "turns, one way", 0, (0.5, 1, 2, 3, 5, 10)),
    ("resting", "rest", "rest before the turn, s", 1, (1, 2, 5, 10, 20, 60)),
    ("sampling", "rate", "samples a second", 0, (50, 100, 200, 500, 1000)),
)
"""Series of motions, what is varied, its name, which sigma is shown, ticks."""
WIDTH, HEIGHT = 9.0, 3.5
DASHES = "3 1.5"


def chart(content: Content) -> str:
    """Accelerometer bias over turns, gyroscope bias over rest, accelerometer bias over samples a second."""
    rows = [row for row in content["motions"] if "stated" in row]
    figure = Figure(WIDTH, HEIGHT)
    for place, (series, over, title, which, ticks) in enumerate(PANELS):
        axes = figure.add_axes((0.4 + place * WIDTH / 3, 0.85, WIDTH / 3 - 0.55, 2.3))
        _scales(axes, title, which, ticks)
        found = [row for row in rows if row["series"] == series]
        for speed in sorted({row["speed"] for row in found}):
            _curve(axes, [row for row in found if row["speed"] == speed], over, which)
    _key(figure.add_axes((0.4, 0.05, WIDTH - 0.8, 0.3)))
    return standalone_svg(figure, "Sigma of the biases over turns, rest and samples a second")


def _curve(axes: Axes, rows: list[Content], over: str, which: int) -> None:
    factor, speed = UNITS[which][1], rows[0]["speed"]
    places = np.log10([row[over] for row in rows])
    stated, bound = (np.log10([factor * row[name][which] for row in rows]) for name in ("stated", "bound"))
    axes.line(places, bound, COLOURS[speed], 0.8, dash=DASHES)
    axes.line(places, stated, COLOURS[speed])
    axes.points(places, stated, COLOURS[speed], MARKERS[speed], 3.5)


def _scales(axes: Axes, title: str, which: int, ticks: tuple[float, ...]) -> None:
    low, high = LIMITS[which]
    axes.set_ylim(log10(low), log10(high))
    axes.set_xlim(log10(ticks[0]) - 0.07, log10(ticks[-1]) + 0.07)
    marks = [m * 10.0**e for e in range(-1, 3) for m in (1, 1.5, 2, 3, 5) if low <= m * 10.0**e <= high]
    across, up = ([log10(number) for number in numbers] for numbers in (ticks, marks))
    axes.grid(across, "x", GRID)
    axes.grid(up, "y", GRID)
    numbered_value_axis(axes, up, [f"{mark:g}" for mark in marks], f"sigma of the {UNITS[which][2]}")
    numbered_horizontal_axis(axes, across, [f"{tick:g}" for tick in ticks], title)


def _key(key: Axes) -> None:
    names = [(f"{speed:g} rad/s", colour, MARKERS[speed]) for speed, colour in COLOURS.items()]
    for place, (name, colour, marker) in enumerate([*names, ("best possible", SOFT, "")]):
        left = 0.05 + 0.15 * place
        key.line(
            [left, left + 0.03], [0.5, 0.5], colour, 1.0 if marker else 0.8, dash="" if marker else DASHES
        )
        if marker:
            key.points([left + 0.015], [0.5], colour, marker, 3.5)
        else:
            key.line([left, left + 0.03], [0.5, 0.5], colour, 0.8, dash=DASHES)
        key.text(left + 0.037, 0.5, name, va="center", color=INK)


def main() -> None:
    """Draws the chart."""
    unfinished = CHART.with_name(CHART.name + ".part")
    unfinished.write_text(chart(load("spin_enough")), encoding="utf-8")
    unfinished.replace(CHART)


if __name__ == "__main__":
    main()
