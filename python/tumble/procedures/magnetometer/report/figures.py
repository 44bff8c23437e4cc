"""The figures of a calibrated magnetometer: directions of the field, its length and its dip."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from tumble.procedures.magnetometer.result import MagnetometerResult
from tumble.report.canvas import Figure
from tumble.report.directions import LengthErrors, influence_bars, length_errors, sphere
from tumble.report.figures import COMPENSATED, FULL_WIDTH, UNCOMPENSATED, box, largest, value_axis_in
from tumble.report.numbers import readable_scale
from tumble.report.panel import category_axis, error_bars
from tumble.report.svg import inline_svg


def sphere_figure(result: MagnetometerResult, prefix: str) -> Markup:
    """Draws where the field pointed to, on both halves of the sphere, and the next direction to add."""
    fields = np.array([point.field for point in result.points]).reshape(-1, 3)
    influence = np.array([point.influence for point in result.points])
    advised = None if result.advised is None else result.advised.field
    directions = fields / np.linalg.norm(fields, axis=1)[:, None]
    return inline_svg(
        sphere(directions, influence > 1.0, advised, ("field towards +z", "field towards -z")),
        prefix,
        f"Directions of the field in the case at {len(result.points)} places, and the next",
    )


def norm_figure(result: MagnetometerResult, prefix: str) -> Markup:
    """Draws |field| minus its strength: raw, calibrated, and by a fit without that direction."""
    before, after, held_out, sigma = (
        np.array([getattr(point, name) for point in result.points])
        for name in ("before", "after", "held_out", "sigma")
    )
    figure = length_errors(LengthErrors("uT", "field strength", before, after, sigma, held_out))
    return inline_svg(figure, prefix, "Length of the field minus its strength, before and after")


def influence_figure(result: MagnetometerResult, prefix: str) -> Markup:
    """Draws by how much the result would change without each rest or stretch."""
    influence = np.array([point.influence for point in result.points])
    finite = np.where(
        np.isfinite(influence), influence, np.nanmax(np.append(influence[np.isfinite(influence)], 1.0))
    )
    return inline_svg(
        influence_bars(finite), prefix, "Largest change of a parameter without each place, in sigmas"
    )


def dip_figure(result: MagnetometerResult, prefix: str) -> Markup:
    """Draws the dip at each rest minus that of all."""
    figure = Figure(FULL_WIDTH, 2.5)
    axes = figure.add_axes(box(FULL_WIDTH, bottom=0.6, height=1.55))
    place = np.arange(len(result.points), dtype=float)
    dip, sigma = (
        np.array([getattr(point, name) for point in result.points]) for name in ("dip", "dip_sigma")
    )
    scale = readable_scale("deg", largest(dip))
    value_axis_in(axes, scale, "dip minus that of all", dip - sigma, dip + sigma)
    axes.set_xlim(-0.6, len(place) - 0.4)
    error_bars(axes, place, scale.factor * dip, scale.factor * sigma, COMPENSATED)
    disturbed = np.array([point.disturbed for point in result.points])
    axes.points(place[~disturbed], scale.factor * dip[~disturbed], COMPENSATED, "D")
    axes.points(place[disturbed], scale.factor * dip[disturbed], UNCOMPENSATED, "o", hollow=True)
    category_axis(axes, [str(number) for number in range(1, len(place) + 1)], most=40)
    return inline_svg(figure, prefix, "Dip of the field at each rest minus that of all")
