"""One picture of a session: what compensation and calibration do to one axis, and to every target."""

from __future__ import annotations

import numpy as np

from tumble.foundation.errors import ProcedureError
from tumble.foundation.words import count_of
from tumble.procedures.turntable.report.batch_figures import draw_improvement, improvements
from tumble.procedures.turntable.report.readings import LOOKS, deviations, draw_states, rms
from tumble.procedures.turntable.result import MountingResult, TargetResult, TurntableResult
from tumble.report.canvas import Axes, Figure, Frame
from tumble.report.numbers import readable_scale, significant
from tumble.report.panel import category_axis, span, value_axis
from tumble.report.svg import GRID, INK, SOFT, standalone_svg

WIDTH, HEIGHT = 10.4, 4.2
PAPER = "#ffffff"

_MOST_TARGETS = 12
_KEY_PLACES = (0.0, 0.27, 0.72)
_PANEL: tuple[Frame, Frame] = ("panel", "panel")


def figure_overview(result: TurntableResult) -> str:
    """Draws the session as one SVG file: an axis at its poses in three states, all targets before and after.

    Fixed colours on white, so that it reads the same wherever it is shown. Raises `ProcedureError` where no
    target was calibrated with its mounting angle known: there is nothing to picture.
    """
    shown = next((target for target in result.targets if target.axis_readings and target.accelerometer), None)
    mounting = result.reference.mounting
    if shown is None or mounting is None:
        raise ProcedureError(
            "no overview to draw: no target was calibrated with a known mounting angle; give a pose list"
        )
    figure = Figure(WIDTH, HEIGHT)
    _card(figure)
    _draw_axis(*_panel_and_key(figure, 0.85, 4.5), shown, mounting)
    _draw_targets(*_panel_and_key(figure, 6.75, 3.3), result)
    return standalone_svg(
        figure, f"Tumble: {shown.name} and {count_of('target', len(result.targets))} calibrated"
    )


def _card(figure: Figure) -> None:
    figure.add_axes((0.0, 0.0, WIDTH, HEIGHT)).rounded((0.004, 0.01, 0.992, 0.98), 11.0, PAPER, GRID)


def _panel_and_key(figure: Figure, left: float, width: float) -> tuple[Axes, Axes]:
    return figure.add_axes((left, 1.1, width, 2.1)), figure.add_axes((left, 3.35, width, 0.2))


def _draw_axis(axes: Axes, key: Axes, target: TargetResult, mounting: MountingResult) -> None:
    reading = target.axis_readings[0]
    states = deviations(target, reading, mounting)
    scale = readable_scale("m/s^2", max(map(rms, states.values())) / 10)
    scaled = {name: scale.factor * deviation for name, deviation in states.items()}
    low, high = span(*scaled.values(), at_least=(0.0,), margin=0.1)
    value_axis(axes, low, high, "")
    category_axis(axes, reading.labels)
    place = np.arange(len(reading.labels), dtype=float)
    draw_states(axes, place, scaled)
    for row, (name, deviation) in enumerate(scaled.items()):
        _key(key, row, name, f"{name}: {significant(rms(deviation), 2)} rms")
    if "calibrated" in states:
        _note(axes, "What is left is the error of the table, which the reference measured too.")
    _title(
        axes,
        f"{reading.axis} axis of {target.name} at {len(place)} rests: deviation from ideal, {scale.unit}",
    )


def _draw_targets(axes: Axes, key: Axes, result: TurntableResult) -> None:
    pairs = improvements(result)[:_MOST_TARGETS]
    draw_improvement(axes, pairs, named=True)
    for row, name in enumerate(("raw", "calibrated")):
        _key(key, row, name, name)
    _title(axes, "All targets: error of |specific force|")


def _key(key: Axes, row: int, state: str, text: str) -> None:
    colour, marker, hollow, _ = LOOKS[state]
    left = 0.01 + _KEY_PLACES[row]
    key.points([left], [0.5], colour, marker, 4.6, hollow=hollow, clipped=False)
    key.text(left + 0.02, 0.5, text, va="center", color=SOFT)


def _note(axes: Axes, text: str) -> None:
    axes.text(0, -0.33, text, frames=_PANEL, va="top", color=SOFT)


def _title(axes: Axes, text: str) -> None:
    axes.text(0, 1.26, text, frames=_PANEL, size=9.5, bold=True, color=INK)
