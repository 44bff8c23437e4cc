"""The figures of one spin: over time, over heading, across its axis, before and after."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup

from tumble.foundation.recording import FloatArray
from tumble.procedures.spin.report.parameters import parameter_named
from tumble.procedures.spin.result import BiasEstimate, Spin
from tumble.report.canvas import Axes, Figure
from tumble.report.figures import (
    COMPENSATED,
    FULL_WIDTH,
    HALF_WIDTH,
    LEFT,
    RIGHT,
    UNCOMPENSATED,
    box,
    largest,
    shade,
    value_axis_in,
)
from tumble.report.numbers import readable_scale
from tumble.report.panel import (
    category_axis,
    error_bars,
    horizontal_axis,
    span,
    value_axis,
)
from tumble.report.svg import (
    INK,
    REST,
    SOFT,
    X_AXIS,
    Y_AXIS,
    Z_AXIS,
    inline_svg,
)

MOST_POINTS = 240
"""Points of one kind in a figure; more cannot be distinguished, and make the page heavy."""

RADIUS_95 = math.sqrt(-2.0 * math.log(0.05))
"""Radius in sigmas of the circle that holds 95 of 100 points, which scatter alike in both directions."""

_QUARTER_TURNS = (0.0, 90.0, 180.0, 270.0, 360.0)
LEVEL_FLOOR = Z_AXIS
"""Distinguished from the fit by colour: over several turns the gaps of a dashed line fill each other."""

_SQUARE = 3.3
"""Inches, side of a panel with the same scale both ways."""


def time_figure(spin: Spin, prefix: str) -> Markup:
    """Draws rate about the turning axis, rate across it and heading over time, rests shaded."""
    blocks = spin.blocks
    figure = Figure(FULL_WIDTH, 5.3)
    panels = [figure.add_axes(box(FULL_WIDTH, bottom=bottom, height=1.2)) for bottom in (3.85, 2.15, 0.45)]
    about, across, heading = panels
    start, end = span(blocks.time, np.array([spin.start, spin.end]), margin=0.0)
    value_axis_in(about, readable_scale("rad/s", 1.0), "rate about the turning axis", blocks.rate)
    scale = readable_scale("rad/s", largest(blocks.across))
    value_axis_in(across, scale, "rate across the turning axis", blocks.across)
    value_axis_in(heading, readable_scale("deg", 1.0), "heading", np.degrees(blocks.heading))
    for axes in panels:
        axes.set_xlim(start, end)
        shade(axes, [(rest.start, rest.end) for rest in spin.rests], REST, "")
    about.line(blocks.time, blocks.rate, INK)
    for component, colour in enumerate((X_AXIS, Y_AXIS)):
        across.line(blocks.time, scale.factor * blocks.across[:, component], colour, 0.8)
    heading.line(blocks.time, np.degrees(blocks.heading), INK)
    horizontal_axis(heading, start, end, "time, s", most=12)
    return inline_svg(figure, prefix, f"{spin.label} over time: rate about and across its axis, and heading")


def heading_figure(spin: Spin, gravity: float, prefix: str) -> Markup:
    """Draws forward and left force over heading, with the fit and what a level floor would give."""
    blocks = spin.blocks
    figure = Figure(FULL_WIDTH, 3.0)
    width = (FULL_WIDTH - 2 * (LEFT + RIGHT) - 0.2) / 2
    scale = readable_scale("m/s^2", largest(blocks.force[:, :2], blocks.fit[:, :2]))
    level = level_floor_fit(spin, gravity)
    degrees = np.degrees(blocks.heading) % 360.0
    kept = shown_blocks(spin)
    for side, (name, colour, marker) in enumerate((("forward", X_AXIS, "o"), ("left", Y_AXIS, "s"))):
        left = LEFT + side * (width + LEFT + RIGHT + 0.2)
        axes = figure.add_axes((left, 0.45, width, 2.2))
        shown = [blocks.force[:, :2], blocks.fit[:, :2], *([] if level is None else [level])]
        value_axis_in(axes, scale, f"specific force {name}, less bias", *shown)
        horizontal_axis(axes, 0.0, 360.0, "heading, deg, counter-clockwise", ticks=_QUARTER_TURNS)
        if level is not None:
            _draw_over_heading(axes, degrees, scale.factor * level[:, side], LEVEL_FLOOR)
        _draw_over_heading(axes, degrees, scale.factor * blocks.fit[:, side], INK)
        turning = blocks.resting < 0.5
        for chosen, hollow in ((kept & turning, False), (kept & ~turning, True)):
            small_markers(
                axes, degrees[chosen], scale.factor * blocks.force[chosen, side], colour, marker, hollow
            )
    return inline_svg(
        figure, prefix, f"{spin.label}: specific force forward and left over heading, in {scale.unit}"
    )


def level_floor_fit(spin: Spin, gravity: float) -> FloatArray | None:
    """Returns what the model would have forward and left on a level floor: (n, 2) m/s^2.

    None where tilt or uphill bearing are not known.
    """
    tilt, uphill = parameter_named(spin, "floor tilt"), parameter_named(spin, "uphill bearing")
    if tilt is None or uphill is None:
        return None
    bearing = math.radians(uphill.value) - spin.blocks.heading
    across = np.column_stack([np.cos(bearing), np.sin(bearing)])
    return np.asarray(spin.blocks.fit[:, :2] - gravity * math.sin(math.radians(tilt.value)) * across)


def scatter_figure(spin: Spin, prefix: str) -> Markup:
    """Draws the rate across the turning axis, one component over the other, with circles of the noise."""
    blocks = spin.blocks
    radii = noise_radii(spin)
    figure = Figure(HALF_WIDTH, _SQUARE + 0.85)
    axes = figure.add_axes((LEFT + (HALF_WIDTH - LEFT - RIGHT - _SQUARE) / 2, 0.5, _SQUARE, _SQUARE))
    scale = readable_scale("rad/s", largest(blocks.across, np.array([r for r in radii if r])))
    reach = scale.factor * largest(blocks.across, np.array([r for r in radii if r])) * 1.1 or 1.0
    value_axis(axes, -reach, reach, f"second component, {scale.unit}")
    horizontal_axis(axes, -reach, reach, f"first component, {scale.unit}", most=5, zero=SOFT)
    kept = shown_blocks(spin)
    turning = blocks.resting < 0.5
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    for chosen, colour, marker, radius in (
        (kept & turning, Y_AXIS, "s", radii[1]),
        (kept & ~turning, X_AXIS, "o", radii[0]),
    ):
        points = scale.factor * blocks.across[chosen]
        small_markers(axes, points[:, 0], points[:, 1], colour, marker, marker == "o")
        if radius is not None:
            circle = scale.factor * radius
            axes.line(circle * np.cos(angle), circle * np.sin(angle), colour, 1.3)
    return inline_svg(
        figure, prefix, f"{spin.label}: rate across the turning axis in {scale.unit}, two components"
    )


def noise_radii(spin: Spin) -> tuple[float | None, float | None]:
    """Returns the radii that white noise alone gives the rate across the axis at rest, and turning: rad/s.

    Such a circle holds 95 of 100 blocks. None where it is not known how many samples a block has.
    """
    seconds = sum(rest.end - rest.start for rest in spin.rests)
    samples = sum(rest.samples for rest in spin.rests)
    if len(spin.blocks.time) < 2 or seconds <= 0 or samples == 0:
        return None, None
    each = float(np.median(np.diff(spin.blocks.time))) * samples / seconds
    sigmas = [_noise_across(spin.noise[row], spin.up) / math.sqrt(max(each, 1.0)) for row in (2, 3)]
    at_rest, turning = (RADIUS_95 * sigma if math.isfinite(sigma) else None for sigma in sigmas)
    return at_rest, turning


def _noise_across(scatter: FloatArray, up: FloatArray) -> float:
    """Returns what noise alone is in the scatter of three gyroscopes, rad/s; NaN where that is not known.

    Speeding up and slowing down scatter too, but along the turning axis only: the scatter squared is that of
    the noise, alike on all axes, and a share of the rest by how far each axis leans to the turning axis.
    """
    if not np.all(np.isfinite(scatter)):
        return math.nan
    shares, *_ = np.linalg.lstsq(np.column_stack([np.ones(3), up**2]), scatter**2, rcond=None)
    return math.sqrt(max(float(shares[0]), 0.0))


def improvement_figure(spin: Spin, gravity: float, prefix: str) -> Markup:
    """Draw, at each rest, |specific force| less gravity and |angular rate|, without and with compensation."""
    figure = Figure(HALF_WIDTH, 4.15)
    upper = figure.add_axes(box(HALF_WIDTH, bottom=2.45, height=1.4))
    lower = figure.add_axes(box(HALF_WIDTH, bottom=0.55, height=1.4))
    place = np.arange(len(spin.rests), dtype=float)
    for axes, (before, after, sigma), unit, title in (
        (upper, force_errors(spin, gravity), "m/s^2", "|specific force| less gravity"),
        (lower, rates_at_rest(spin), "rad/s", "|angular rate|"),
    ):
        scale = readable_scale(unit, largest(before, after))
        value_axis_in(axes, scale, title, before - sigma, before + sigma, after - sigma, after + sigma)
        axes.set_xlim(-0.6, len(place) - 0.4)
        for aside, values, colour, marker in (
            (-0.1, before, UNCOMPENSATED, "o"),
            (0.1, after, COMPENSATED, "D"),
        ):
            error_bars(axes, place + aside, scale.factor * values, scale.factor * sigma, colour)
            axes.points(place + aside, scale.factor * values, colour, marker, hollow=marker == "o")
    category_axis(lower, [f"rest {n}" for n in range(1, len(place) + 1)])
    return inline_svg(figure, prefix, f"{spin.label}: errors at rest, without and with compensation")


def force_errors(spin: Spin, gravity: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns |specific force| less gravity at each rest, raw, compensated, and the 1-sigma of the means.

    (k,) m/s^2 each; NaN where the bias is not known.
    """
    raw = np.array([rest.specific_force for rest in spin.rests]).reshape(-1, 3)
    sigma = np.array([rest.specific_force_sigma for rest in spin.rests]).reshape(-1, 3)
    before, spread = _norms(raw, sigma)
    after, _ = _norms(raw - _value(spin.accelerometer_bias), sigma)
    return before - gravity, after - gravity, spread


def rates_at_rest(spin: Spin) -> tuple[FloatArray, FloatArray, FloatArray]:
    """|angular rate| at each rest, raw, compensated, and the 1-sigma of the means: (k,) rad/s each."""
    raw = np.array([rest.angular_rate for rest in spin.rests]).reshape(-1, 3)
    sigma = np.array([rest.angular_rate_sigma for rest in spin.rests]).reshape(-1, 3)
    before, spread = _norms(raw, sigma)
    after, _ = _norms(raw - _value(spin.gyroscope_bias), sigma)
    return before, after, spread


def shown_blocks(spin: Spin) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Chooses the blocks drawn as points: every so-manyth where there are many. (n,)."""
    count = len(spin.blocks.time)
    stride = max(1, -(-count // MOST_POINTS))
    return np.asarray(np.arange(count) % stride == 0)


def small_markers(axes: Axes, x: FloatArray, y: FloatArray, colour: str, marker: str, hollow: bool) -> None:
    """Draws many unconnected points. Shapes (k,)."""
    axes.points(x, y, colour, marker, 2.6, hollow=hollow, edge=0.7)


def _draw_over_heading(axes: Axes, degrees: FloatArray, values: FloatArray, colour: str) -> None:
    """Draws a line over folded heading, in the order of time, broken where it passes 360 deg."""
    if len(degrees) == 0:
        return
    breaks = np.flatnonzero(np.abs(np.diff(degrees)) > 180.0) + 1
    across, up = np.insert(degrees, breaks, np.nan), np.insert(values, breaks, np.nan)
    axes.line(across, up, colour, 0.9, order=1.6)


def _value(bias: BiasEstimate) -> FloatArray:
    return bias.value if bias.observable else np.full(3, np.nan)


def _norms(vectors: FloatArray, sigmas: FloatArray) -> tuple[FloatArray, FloatArray]:
    norms = np.linalg.norm(vectors, axis=1)
    safe = np.where(norms > 0, norms, 1.0)
    return norms, np.linalg.norm(vectors * sigmas, axis=1) / safe
