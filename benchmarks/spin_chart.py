"""Draw `docs/images/spin-how-much.svg` from `results/spin_enough.json`.

`python -m benchmarks.spin_chart`
"""

from __future__ import annotations

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from benchmarks.results import Content, load
from tumble.report.svg import (
    GRID,
    INK,
    SOFT,
    X_AXIS,
    Y_AXIS,
    Z_AXIS,
    house_style,
    new_figure,
    standalone_svg,
)

CHART = Path(__file__).parent.parent / "docs" / "images" / "spin-how-much.svg"
COLOURS = {0.2: "#cc79a7", 0.5: Y_AXIS, 1.0: INK, 2.0: X_AXIS, 3.0: Z_AXIS}
MARKERS = {0.2: "v", 0.5: "s", 1.0: "o", 2.0: "^", 3.0: "D"}
UNITS = ((0, 1e3, "accelerometer bias, mm/s²"), (1, 1e6, "gyroscope bias, µrad/s"))
LIMITS = ((0.6, 6.0), (20.0, 250.0))
"""Of the sigmas drawn, in those units."""


def chart(content: Content) -> str:
    """Accelerometer bias over turns, gyroscope bias over rest, accelerometer bias over samples a second."""
    rows = [row for row in content["motions"] if "stated" in row]
    with house_style():
        figure = new_figure(9.0, 3.5)
        left, middle, right = figure.subplots(1, 3)
        for speed in COLOURS:
            at_speed = [row for row in rows if row["speed"] == speed]
            _curve(left, [row for row in at_speed if row["series"] == "turning"], "turns", 0)
            _curve(right, [row for row in at_speed if row["series"] == "sampling"], "rate", 0)
        _curve(middle, [row for row in rows if row["series"] == "resting"], "rest", 1)
        _label(left, "turns, one way", 0, [0.5, 1, 2, 3, 5, 10])
        _label(middle, "rest before the turn, s", 1, [1, 2, 5, 10, 20, 60])
        _label(right, "samples a second", 0, [50, 100, 200, 500, 1000])
        handles, labels = left.get_legend_handles_labels()
        bound = Line2D([], [], color=SOFT, linewidth=0.8, linestyle="--")
        figure.legend(
            [*handles, bound], [*labels, "best possible"], loc="lower center", ncols=6, frameon=False
        )
        figure.tight_layout(rect=(0.0, 0.07, 1.0, 1.0), w_pad=2.0)
        return standalone_svg(figure, "Sigma of the biases over turns, rest and samples a second")


def _curve(axes: Axes, rows: list[Content], over: str, which: int) -> None:
    factor = UNITS[which][1]
    speed = rows[0]["speed"]
    colour = COLOURS[speed]
    places = [row[over] for row in rows]
    stated, bound = ([factor * row[name][which] for row in rows] for name in ("stated", "bound"))
    axes.plot(places, bound, color=colour, linewidth=0.8, linestyle="--")
    axes.plot(places, stated, color=colour, marker=MARKERS[speed], markersize=3.5, label=f"{speed:g} rad/s")


def _label(axes: Axes, over: str, which: int, ticks: list[float]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_ylim(*LIMITS[which])
    low, high = LIMITS[which]
    marks = [m * 10.0**e for e in range(-1, 3) for m in (1, 1.5, 2, 3, 5) if low <= m * 10.0**e <= high]
    axes.set_yticks(marks, [f"{mark:g}" for mark in marks])
    axes.minorticks_off()
    axes.set_xlabel(over)
    axes.set_title(f"sigma of the {UNITS[which][2]}", loc="left", fontsize=8.0)
    axes.grid(color=GRID, linewidth=0.6)
    axes.tick_params(color=SOFT, labelcolor=SOFT, length=0)
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)


def main() -> None:
    """Draw the chart."""
    unfinished = CHART.with_name(CHART.name + ".part")
    unfinished.write_text(chart(load("spin_enough")), encoding="utf-8")
    unfinished.replace(CHART)


if __name__ == "__main__":
    main()
