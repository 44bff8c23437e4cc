"""Uncertainty of the reference: who states it, and what is stated.

Corrected by its calibration, a reference reads `(I + E) u + e`. Method: docs/theory/uncertainty.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tumble import _core
from tumble.calibration.document import Calibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName
from tumble.foundation.units import TRIADS
from tumble.foundation.words import join
from tumble.procedures.turntable.result import NOT_STATED, UncertaintySources


@dataclass(frozen=True, slots=True)
class ReferenceUncertainty:
    """Covariance (12, 12) of [E row by row, e] of each triad, None where nobody states it, and who does."""

    accelerometer: FloatArray | None
    gyroscope: FloatArray | None
    sources: UncertaintySources


def reference_uncertainty(applied: Calibration | None, grade: str | None) -> ReferenceUncertainty:
    """Returns the uncertainty of each triad from its calibration, or else from the grade.

    Raises `ProcedureError` where no grade has that name.
    """
    if grade is not None and grade not in _core.sensor_grades():
        raise ProcedureError(f"reference grade {grade!r}: give one of {join(_core.sensor_grades())}")
    of_grade = dict(zip(TRIADS, _core.uncertainty_of_grade(grade), strict=True)) if grade else {}
    found: dict[TriadName, FloatArray | None] = {}
    sources: dict[TriadName, str] = {}
    for name in TRIADS:
        stated = None if applied is None else _of_calibration(applied, name)
        found[name] = of_grade.get(name) if stated is None else stated
        by_grade = f"grade {grade}" if name in of_grade else NOT_STATED
        sources[name] = by_grade if stated is None else "calibration"
    return ReferenceUncertainty(found["accelerometer"], found["gyroscope"], UncertaintySources(**sources))


def _of_calibration(applied: Calibration, name: TriadName) -> FloatArray | None:
    triad = getattr(applied, name)
    stated = None if triad is None else triad.total_covariance
    if stated is None or not np.isfinite(stated).all():
        return None
    return _core.uncertainty_of_calibration(
        np.ascontiguousarray(triad.M, dtype=np.float64), np.ascontiguousarray(stated, dtype=np.float64)
    )
