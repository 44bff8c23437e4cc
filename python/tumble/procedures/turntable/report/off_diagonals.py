"""The off-diagonals of M as a table: mounting ignored, compensated as published, and as Tumble finds them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tumble.foundation.results import Parameter
from tumble.procedures.turntable.result import OffDiagonal
from tumble.report.numbers import measurement


@dataclass(frozen=True, slots=True)
class OffDiagonalRow:
    """One element as printed."""

    element: str
    """`M xz`."""
    ignored: str
    published: str
    found: str
    unit: str


def off_diagonal_rows(elements: Sequence[OffDiagonal]) -> tuple[OffDiagonalRow, ...]:
    """Prints each element with the sigma that its own fit states."""
    return tuple(
        OffDiagonalRow(
            each.found.name,
            _printed(each.ignored),
            _printed(each.published),
            _printed(each.found),
            each.found.unit,
        )
        for each in elements
    )


def _printed(parameter: Parameter) -> str:
    return measurement(parameter.value, parameter.sigma)
