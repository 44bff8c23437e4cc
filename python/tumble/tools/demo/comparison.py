"""Errors of the calibrations of the demo against the truth of its simulator."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.bounded_yaml import parse
from tumble.foundation.file_reading import own_text
from tumble.foundation.units import TRIADS, Triad
from tumble.tools.demo.scene import SESSION, TARGETS

LARGEST_MATRIX_ERROR = 1e-3
"""Largest error of M of a consumer-grade unit: five times what its noise explains."""


@dataclass(frozen=True, slots=True)
class TriadDifference:
    """Largest errors of one triad of a target over its elements."""

    triad: Triad
    matrix: float
    """Error of M; a ratio."""
    bias: float
    """Error of the bias in `unit`."""
    unit: str


@dataclass(frozen=True, slots=True)
class TargetDifference:
    """A target, and how far its calibration is from the truth."""

    name: str
    grade: str
    triads: tuple[TriadDifference, ...]

    def line(self) -> str:
        """Describes the difference in a line."""
        found = "; ".join(f"M {each.matrix:.1e}, b {each.bias:.1e} {each.unit}" for each in self.triads)
        return f"{self.name} ({self.grade}): {found}"


def differences(folder: Path) -> Iterator[TargetDifference]:
    """Compares each calibration in the folder of results with the truth of the session.

    Raises `ArithmeticError`, a bug of ours, where one is further off than noise explains.
    """
    _, content = parse(own_text(folder / SESSION / "truth.yaml"))
    for name in TARGETS:
        truth = content["units"][name]
        calibration = Calibration.load(folder / f"{name}.yaml")
        triads = tuple(_difference(calibration, triad, truth[triad]) for triad in TRIADS)
        for each in triads:
            if not each.matrix < LARGEST_MATRIX_ERROR:
                raise ArithmeticError(f"{name} {each.triad}: M has an error of {each.matrix:.1e}")
        yield TargetDifference(name, truth["grade"], triads)


def _difference(calibration: Calibration, triad: Triad, truth: dict[str, Any]) -> TriadDifference:
    found = getattr(calibration, triad)
    matrix = float(np.abs(found.M - truth["M"]).max())
    bias = float(np.abs(found.b - np.add(truth["b"], truth["drift"])).max())
    return TriadDifference(triad, matrix, bias, found.unit)
