"""A result on six faces beside the formulas of Ferraris, as text for screen, page and notebook."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from tumble.foundation.results import Parameter, TriadResult
from tumble.procedures.multipose.result import FerrarisTriad, MultiposeResult
from tumble.report.numbers import NOT_OBSERVABLE, Scale, round_like, round_pair, scales_of, significant


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
    """Difference in sigmas of the estimate."""


def compared(result: MultiposeResult) -> Iterator[ComparedRow]:
    """Prints both side by side, parameter by parameter; nothing where the unit did not lie on six faces."""
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
    each = list(zip(triad.parameters, map(float, ferraris.values), ferraris.differences, strict=True))
    scales = scales_of(
        (parameter.unit, max(abs(parameter.value), abs(value))) for parameter, value, _ in each
    )
    for parameter, value, difference in each:
        yield _row(triad.triad, parameter, value, float(difference), scales[parameter.unit])


def _row(triad: str, parameter: Parameter, value: float, difference: float, scale: Scale) -> ComparedRow:
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
