"""The readings of one axis at the poses: raw, compensated for the mounting, and calibrated."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from markupsafe import Markup

from tumble.foundation.recording import FloatArray
from tumble.procedures.turntable.result import AxisReading, MountingResult, TargetResult
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import (
    CALIBRATED,
    COMPENSATED,
    HALF_WIDTH,
    LABEL_ROOM,
    UNCOMPENSATED,
    box,
    largest,
    value_axis_in,
)
from tumble.report.numbers import readable_scale
from tumble.report.panel import category_axis, error_bars, segments, span, value_axis
from tumble.report.svg import SOFT, inline_svg

LOOKS = {
    "raw": (UNCOMPENSATED, "o", True, -0.2),
    "mounting compensated": (COMPENSATED, "D", False, 0.0),
    "calibrated": (CALIBRATED, "o", False, 0.2),
}
"""Colour, marker, whether hollow, and how far beside its place: of each state of a reading."""


def axis_reading_figure(reading: AxisReading, states: Mapping[str, FloatArray], prefix: str) -> Markup:
    """Draws the readings of one axis over the poses, and below them how far each is from its ideal.

    `states` are as `deviations` returns them.
    """
    figure = Figure(HALF_WIDTH, 3.65)
    upper = figure.add_axes(box(HALF_WIDTH, bottom=2.35, height=1.05))
    lower = figure.add_axes(box(HALF_WIDTH, bottom=LABEL_ROOM + 0.06, height=1.3))
    place = np.arange(len(reading.labels), dtype=float)
    readings = {name: reading.ideal + deviation for name, deviation in states.items()}

    low, high = span(reading.ideal, *readings.values(), at_least=(0.0,), margin=0.12)
    value_axis(upper, low, high, "reading, m/s²", most=4)
    upper.set_xlim(-0.6, len(place) - 0.4)
    segments(upper, place - 0.32, reading.ideal, place + 0.32, reading.ideal, SOFT, 1.2)
    draw_states(upper, place, readings)

    scale = readable_scale("m/s^2", largest(*states.values()))
    value_axis_in(lower, scale, "deviation from the ideal", *states.values())
    category_axis(lower, reading.labels)
    scaled = {name: scale.factor * deviation for name, deviation in states.items()}
    draw_states(lower, place, scaled, scale.factor * reading.sigma)
    label = (
        f"Readings of the {reading.axis} axis at {len(place)} rests, {', '.join(states)}, "
        f"and their deviation from the ideal in {scale.unit}"
    )
    return inline_svg(figure, prefix, label)


def draw_states(
    axes: Axes, place: FloatArray, states: Mapping[str, FloatArray], sigma: FloatArray | None = None
) -> None:
    """Draws values (k,) of each state side by side, with bars of one sigma where that is given."""
    for name, values in states.items():
        colour, marker, hollow, aside = LOOKS[name]
        if sigma is not None:
            error_bars(axes, place + aside, values, sigma, colour)
        axes.points(place + aside, values, colour, marker, hollow=hollow)


def deviations(
    target: TargetResult, reading: AxisReading, mounting: MountingResult | None
) -> dict[str, FloatArray]:
    """Returns reading minus ideal in each of the states of `LOOKS` that is known: (k,) m/s^2 each."""
    calibrated = None if mounting is None else calibrated_deviation(target, reading, mounting)
    states = (reading.uncompensated - reading.ideal, reading.compensated - reading.ideal, calibrated)
    return {name: state for name, state in zip(LOOKS, states, strict=True) if state is not None}


def calibrated_deviation(
    target: TargetResult, reading: AxisReading, mounting: MountingResult
) -> FloatArray | None:
    """Returns the reading of the axis after calibration and in the table frame, minus its ideal: (k,) m/s^2.

    None where a reading cannot be traced to its rest, or the matrix is not known.
    """
    triad, axis = target.accelerometer, "XY".index(reading.axis)
    by_reading = {float(rest.specific_force[axis]): rest.specific_force for rest in target.rests}
    if triad is None or "matrix" not in triad.estimated:
        return None
    if not all(float(value) in by_reading for value in reading.uncompensated):
        return None
    measured = np.array([by_reading[float(value)] for value in reading.uncompensated])
    corrected = np.linalg.solve(triad.M, (measured - triad.b).T).T
    return np.asarray(mounting.in_table_frame(corrected)[:, axis] - reading.ideal)


def rms(values: FloatArray) -> float:
    """Returns the root mean square."""
    return float(np.sqrt(np.mean(values**2)))
