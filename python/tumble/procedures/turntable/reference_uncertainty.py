"""Uncertainty of the reference: who states it, and what is stated.

Corrected by its calibration, a reference reads `(I + E) u + e`. Method: docs/theory/uncertainty.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tumble import _core
from tumble.calibration.budget import Distribution
from tumble.calibration.document import Calibration, TriadCalibration
from tumble.calibration.reference_certificate import CertifiedTriad, Influence, ReferenceCertificate
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName
from tumble.foundation.units import TRIADS, CalibratedTriad
from tumble.foundation.words import join
from tumble.procedures.turntable.result import NOT_STATED, UncertaintySources
from tumble.tools.simulate.grade import Grade

Temperature = tuple[float, float, float] | None
"""Lowest, mean and highest, degC; None where none was recorded."""


@dataclass(frozen=True, slots=True)
class StatedError:
    """A source of the error of the corrected reference."""

    source: str
    distribution: Distribution
    covariance: FloatArray
    """(12, 12) of [E row by row, e]."""
    degrees_of_freedom: float | None = None


@dataclass(frozen=True, slots=True)
class KnownUncertainty:
    """Covariance (12, 12) of [E row by row, e] of each triad, None where nobody states it, and who does."""

    accelerometer: FloatArray | None
    gyroscope: FloatArray | None
    sources: UncertaintySources
    errors: Mapping[CalibratedTriad, tuple[StatedError, ...]] = field(default_factory=dict)
    """Sources of both, which sum up to them."""


def reference_uncertainty(
    applied: Calibration | None,
    grade: str | None,
    certificate: ReferenceCertificate | None = None,
    day: str = "",
    temperature: Temperature = None,
    walks: Mapping[str, float] | None = None,
) -> KnownUncertainty:
    """Returns the uncertainty of each triad from certificate or calibration, or else from the grade.

    `applied` is the calibration of the certificate, where there is one; `day` that of the session, and
    `temperature` that of the reference in it. `walks` are as of `ReferenceCertificate.influences`.

    Raises `ProcedureError` where no grade has that name.
    """
    refuse_unknown_grade("reference", grade)
    of_grade = dict(zip(TRIADS, _core.uncertainty_of_grade(grade), strict=True)) if grade else {}
    errors: dict[CalibratedTriad, tuple[StatedError, ...]] = {}
    sources: dict[TriadName, str] = {}
    for name in TRIADS:
        found: tuple[StatedError, ...] = ()
        if certificate is not None and applied is not None and name in certificate.triads():
            sources[name] = "certificate"
            found = tuple(_of_certificate(applied, certificate, name, day, temperature, grade, walks))
        elif (stated := of_calibration(applied, name)) is not None:
            sources[name] = "calibration"
            found = (StatedError("reference: calibration", "normal", stated),)
        elif name in of_grade:
            sources[name] = f"grade {grade}"
            found = (StatedError(f"reference: grade {grade}", "normal", of_grade[name]),)
        else:
            sources[name] = NOT_STATED
        errors[name] = found
    accelerometer, gyroscope = (_sum(errors[name]) for name in TRIADS)
    return KnownUncertainty(accelerometer, gyroscope, UncertaintySources(**sources), errors)


def refuse_unknown_grade(of: str, grade: str | None) -> None:
    """Raises `ProcedureError` where no grade has that name."""
    if grade is not None and grade not in _core.sensor_grades():
        raise ProcedureError(f"{of} grade {grade!r}: give one of {join(_core.sensor_grades())}")


def _sum(errors: Sequence[StatedError]) -> FloatArray | None:
    return np.sum([each.covariance for each in errors], axis=0) if errors else None


def of_calibration(applied: Calibration | None, name: CalibratedTriad) -> FloatArray | None:
    """Returns the covariance (12, 12) of [E row by row, e] of a corrected triad; None if nobody states it."""
    triad: TriadCalibration | None = None if applied is None else getattr(applied, name)
    stated = None if triad is None else triad.total_covariance
    if triad is None or stated is None or not np.isfinite(stated).all():
        return None
    return _core.uncertainty_of_calibration(
        np.ascontiguousarray(triad.M, dtype=np.float64), np.ascontiguousarray(stated, dtype=np.float64)
    )


def _of_certificate(
    applied: Calibration,
    certificate: ReferenceCertificate,
    name: TriadName,
    day: str,
    temperature: Temperature,
    grade: str | None,
    walks: Mapping[str, float] | None,
) -> Iterator[StatedError]:
    matrix = np.ascontiguousarray(getattr(applied, name).M, dtype=np.float64)
    influences: list[Influence] = list(certificate.influences(name, day, temperature, walks))
    triad = certificate.triads()[name]
    kelvin = certificate.distance(temperature)
    if triad.temperature is None and grade is not None and kelvin > 0.0:
        influences.append(_temperature_of_grade(triad, name, grade, kelvin))
    for each in influences:
        covariance = _core.uncertainty_of_calibration(matrix, np.ascontiguousarray(each.covariance))
        yield StatedError(each.source, each.distribution, covariance, each.degrees_of_freedom)


def _temperature_of_grade(triad: CertifiedTriad, name: TriadName, grade: str, kelvin: float) -> Influence:
    """Returns the influence of temperature by the coefficient of a grade, where the certificate has none."""
    coefficient = getattr(Grade.named(grade), name).temperature_coefficient
    sigma = np.full(3, coefficient * kelvin / np.sqrt(3.0))  # uncertainty.md, eq. 12
    return Influence(
        source=f"reference: temperature within {kelvin:.2g} K, grade {grade}",
        distribution="rectangular",
        covariance=triad.independent({"bias": sigma}),
    )
