"""A result on six faces beside the formulas of Ferraris, as text for screen, page and notebook."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from tumble.multipose.result import FerrarisTriad, MultiposeResult
from tumble.report.numbers import NOT_OBSERVABLE, readable_scale, round_like, round_pair, significant
from tumble.results import Parameter, TriadResult


@dataclass(frozen=True, slots=True)
class ComparedRow:
    """A parameter as it was found, and by the formulas."""

    triad: str
    name: str
    own: str
    sigma: str
    ferraris: str
    unit: str
    difference: str
    """In sigmas of what was found."""


def compared(result: MultiposeResult) -> Iterator[ComparedRow]:
    """Print both side by side, parameter by parameter; nothing where the unit did not lie on six faces."""
    if result.faces is None:
        return
    both = (
        (result.accelerometer, result.faces.accelerometer),
        (result.gyroscope, result.faces.gyroscope),
    )
    for triad, ferraris in both:
        if triad is not None and ferraris is not None and len(ferraris.values):
            yield from _of_triad(triad, ferraris)


def _of_triad(triad: TriadResult, ferraris: FerrarisTriad) -> Iterator[ComparedRow]:
    each = zip(triad.parameters, ferraris.values, ferraris.differences, strict=True)
    for parameter, value, difference in each:
        yield _row(triad.triad, parameter, float(value), float(difference))


def _row(triad: str, parameter: Parameter, value: float, difference: float) -> ComparedRow:
    scale = readable_scale(parameter.unit, max(abs(parameter.value), abs(value)))
    if not parameter.observable or not math.isfinite(parameter.sigma):
        shown = significant(scale.factor * value)
        return ComparedRow(triad, parameter.name, NOT_OBSERVABLE, "", shown, scale.unit, "")
    sigma = scale.factor * parameter.sigma
    own, printed_sigma = round_pair(scale.factor * parameter.value, sigma)
    return ComparedRow(
        triad=triad,
        name=parameter.name,
        own=own,
        sigma=printed_sigma,
        ferraris=round_like(scale.factor * value, sigma),
        unit=scale.unit,
        difference=f"{difference:+.1f}",
    )
