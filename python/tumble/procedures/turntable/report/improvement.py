"""Improvement of the readings at rest by calibration: their magnitude against gravity, before and after."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.procedures.turntable.result import TargetResult
from tumble.report.numbers import Scale, significant

SCALE = Scale("mm/s²", 1e3)
"""Unit of all improvements, so that those of a column can be compared."""
IMPROVEMENT_TITLE = f"error at rest, before → after, {SCALE.unit}"


@dataclass(frozen=True, slots=True)
class Improvement:
    """Root mean square of |specific force| - g over the rests used, m/s^2."""

    before: float
    after: float

    def numbers(self) -> str:
        """`214 → 0.31`, in `SCALE`."""
        before, after = (significant(SCALE.factor * number, 2) for number in (self.before, self.after))
        return f"{before} → {after}"

    def text(self) -> str:
        """`214 → 0.31 mm/s²`."""
        return SCALE.quantity(self.numbers())


def improvement(target: TargetResult, gravity: float) -> Improvement | None:
    """Before and after of one target; None where its matrix was not estimated or no rest was used."""
    triad = target.accelerometer
    readings = np.array([rest.specific_force for rest in target.rests if rest.used])
    if triad is None or "matrix" not in triad.estimated or readings.size == 0:
        return None
    corrected = np.linalg.solve(triad.M, (readings - triad.b).T).T
    return Improvement(_norm_error(readings, gravity), _norm_error(corrected, gravity))


def _norm_error(readings: FloatArray, gravity: float) -> float:
    return float(np.sqrt(np.mean((np.linalg.norm(readings, axis=1) - gravity) ** 2)))
