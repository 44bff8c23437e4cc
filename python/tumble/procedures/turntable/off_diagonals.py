"""Effect of a mounting angle on the off-diagonals of M: ignored, compensated as published, and by Tumble."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal, TypeAlias, get_args

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Parameter
from tumble.poses.triads import parameter
from tumble.procedures.turntable.result import OffDiagonal

Treatment: TypeAlias = Literal["ideal", "rotate-measurement", "reference"]
"""The truths compared: mounting ignored, compensated as published, and measured by the reference."""
TREATMENTS: tuple[Treatment, ...] = get_args(Treatment)

ELEMENTS = tuple((row, column) for row in range(3) for column in range(3) if row != column)


def off_diagonals(fits: Mapping[Treatment, _core.TriadFigures]) -> tuple[OffDiagonal, ...]:
    """Compares the off-diagonals of three fits of one accelerometer to the same readings.

    Empty where a fit does not show all of M. Method: docs/theory/turntable.md, section 8.
    """
    if not all(all(fit["observed"][:9]) for fit in fits.values()):
        return ()
    return tuple(
        OffDiagonal(
            f"{'xyz'[row]}{'xyz'[column]}",
            ignored=_lean(fits["ideal"], row, column),
            published=_lean(fits["rotate-measurement"], row, column),
            found=_lean(fits["reference"], row, column),
        )
        for row, column in ELEMENTS
    )


def _lean(fit: _core.TriadFigures, row: int, column: int) -> Parameter:
    """Returns the angle by which sensing axis `row` leans towards axis `column`, with its sigma."""
    axis = fit["M"][row]
    covariance = fit["covariance"][3 * row : 3 * row + 3, 3 * row : 3 * row + 3]
    sine, slope = sine_of_lean(axis, column)
    sigma = math.sqrt(slope @ covariance @ slope) / math.sqrt(1.0 - sine**2)  # (27)
    angle, sigma = math.degrees(math.asin(sine)), math.degrees(sigma)
    name = f"M {'xyz'[row]}{'xyz'[column]}"
    return parameter(name, "deg", angle, sigma, fit["variance_freedom"])


def sine_of_lean(axis: Sequence[float] | FloatArray, column: int) -> tuple[float, FloatArray]:
    """Sine of that angle, and its derivative by the row of M."""
    row = np.asarray(axis, dtype=np.float64)
    length = float(np.linalg.norm(row))
    sine = float(row[column]) / length  # (26)
    return sine, (np.eye(3)[column] - sine * row / length) / length
