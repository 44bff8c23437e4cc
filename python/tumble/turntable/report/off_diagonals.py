"""The off-diagonals of M as a table: mounting ignored, compensated as published, and as Tumble finds them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tumble.report.numbers import measurement
from tumble.results import Parameter
from tumble.turntable.result import OffDiagonal


@dataclass(frozen=True, slots=True)
class OffDiagonalRow:
    """One element as printed."""

    element: str
    """`M xz`."""
    ignored: str
    published: str
    found: str


def off_diagonal_rows(elements: Sequence[OffDiagonal]) -> tuple[OffDiagonalRow, ...]:
    """Print each element with the sigma that its own fit states."""
    return tuple(
        OffDiagonalRow(
            each.found.name, _printed(each.ignored), _printed(each.published), _printed(each.found)
        )
        for each in elements
    )


def _printed(parameter: Parameter) -> str:
    return measurement(parameter.value, parameter.sigma, parameter.unit)
