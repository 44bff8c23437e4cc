"""Numbers of a result as a certificate shows them: each rounded to its expanded uncertainty, with k.

U is that of the budget where the result holds one. Elsewhere it is the standard uncertainty times the
quantile for 95 %: of Student's t where residuals widened the uncertainty, else of the normal distribution.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from tumble import _core
from tumble.calibration.budget import COVERAGE, Budget
from tumble.calibration.document import Calibration, TriadCalibration
from tumble.foundation.results import INTERVAL
from tumble.foundation.units import TRIADS
from tumble.laboratory.certificate.model import CertifiedQuantity, SensorModel
from tumble.laboratory.results import RegisteredParameter, Result
from tumble.report.numbers import MINUS, round_pair, significant

_DIGITS = 3
"""Digits of a value without an uncertainty."""


def quantities_of(result: Result) -> Iterator[CertifiedQuantity]:
    """Yield all numbers of a result."""
    calibration = result.calibration
    triads: dict[str, TriadCalibration] = {
        name: triad for name in TRIADS if (triad := getattr(calibration, name)) is not None
    }
    budgets = {
        f"{name} {budget.parameter}": budget
        for name, triad in triads.items()
        for budget in triad.budget or ()
    }
    for each in result.parameters:
        name, _, _ = each.name.partition(" ")
        if name not in triads:
            continue  # a certificate states accelerometer and gyroscope only
        if each.value == 0.0 and each.u is None:
            continue  # a term of noise that the recording is too short to show
        yield _quantity(each, budgets, coverage_factor(triads[name]))


def coverage_factor(triad: TriadCalibration) -> float:
    """Return k for 95 % of a triad's standard uncertainties."""
    if triad.widening is not None and triad.widening > 1.0 and triad.degrees_of_freedom:
        found: float = _core.student_quantile(0.5 * (1.0 + COVERAGE), float(triad.degrees_of_freedom))
        return found
    return INTERVAL


def models_of(calibration: Calibration) -> Iterator[SensorModel]:
    """Yield M and b of each triad that was calibrated."""
    for name in TRIADS:
        triad: TriadCalibration | None = getattr(calibration, name)
        if triad is not None:
            yield SensorModel(triad=name, M=triad.M, b=triad.b, covariance=triad.total_covariance)


def _quantity(each: RegisteredParameter, budgets: Mapping[str, Budget], usual: float) -> CertifiedQuantity:
    budget = budgets.get(each.name)
    k = usual if budget is None else budget.coverage_factor
    reach = each.u * k if budget is None and each.u is not None else None
    reach = reach if budget is None else budget.expanded_uncertainty
    value = uncertainty = None
    if each.value is not None and reach:
        value, uncertainty = map(_ascii, round_pair(each.value, reach))
    elif each.value is not None:
        value = _ascii(significant(each.value, _DIGITS))
    return CertifiedQuantity(
        parameter=each.name,
        unit=each.unit,
        value=value,
        uncertainty=uncertainty,
        coverage_factor=None if uncertainty is None else f"{k:.2f}",
    )


def _ascii(text: str) -> str:
    return text.replace(MINUS, "-")
