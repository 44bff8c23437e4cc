"""Budgets of a target against a reference with a certificate: each source through the fit to each parameter.

Method: docs/theory/uncertainty.md, sections 5 and 6.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tumble import _core
from tumble.acquisition.imu import Imu
from tumble.calibration.budget import Budget, BudgetSource, Distribution, budget_of
from tumble.foundation.error_decomposition import factor_jacobian
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Rest, TriadResult
from tumble.foundation.units import CalibratedTriad
from tumble.poses.triads import VERY_MANY
from tumble.procedures.turntable.reference_uncertainty import StatedError
from tumble.tools.inspect.samples import quantisation_step
from tumble.tools.simulate.grade import Grade

SAMPLES = 20_000
"""Samples from which the step of a log is read."""
_ANGLES = 6
"""Place of the first angle among the parameters, behind biases and scales."""
_PRINTED = np.repeat([1.0, math.degrees(1.0)], [6, 6])
"""Factors from SI and rad to the units that parameters are printed in."""


@dataclass(frozen=True, slots=True)
class OwnError:
    """A source of type B that each target has by itself."""

    source: str
    distribution: Distribution
    sigma: FloatArray
    """(3,) of the axes, unit of the triad."""
    covariance: FloatArray
    """(12, 12) of [M row by row, b] by it."""


@dataclass(frozen=True, slots=True)
class BudgetSources:
    """Sources that all targets of a session share."""

    reference: Mapping[CalibratedTriad, tuple[StatedError, ...]]
    gravity_sigma: float
    """m/s^2; 0 where nobody states it."""
    table_sigma: float
    """Relative 1-sigma of the rates of the table; 0 where they are not the truth."""
    target_grade: str | None = None

    def budgeted(
        self, triad: TriadResult, figures: _core.TriadFigures, unit: Imu, rests: Sequence[Rest]
    ) -> tuple[TriadResult, tuple[Budget, ...]]:
        """Returns a triad whose sigmas and intervals are those of its budgets, and these."""
        own = [*self._temperature(triad, unit), *_resolution(triad, unit, rests)]
        added = np.sum([each.covariance for each in own], axis=0) if own else np.zeros((12, 12))
        budgets, parameters = [], []
        for k, parameter in enumerate(triad.parameters):
            if not parameter.observable:
                parameters.append(parameter)
                continue
            sources = list(self._sources(k, triad, figures, own))
            budget = budget_of(parameter.name, parameter.unit, parameter.value, sources)
            budgets.append(budget)
            common = math.hypot(*(each.contribution for each in sources if each.common))
            reach = budget.expanded_uncertainty
            parameters.append(
                replace(
                    parameter,
                    sigma=budget.combined_uncertainty,
                    low=parameter.value - reach,
                    high=parameter.value + reach,
                    inherited=common,
                )
            )
        covariance = triad.covariance + added
        return replace(triad, parameters=tuple(parameters), covariance=covariance), tuple(budgets)

    def _sources(
        self, k: int, triad: TriadResult, figures: _core.TriadFigures, own: Sequence[OwnError]
    ) -> Iterator[BudgetSource]:
        """Yields the sources of the parameter of that place."""
        unit = triad.parameters[k].unit
        fit = float(figures["sigmas"][k] * _PRINTED[k])
        freedom = figures["variance_freedom"]
        yield BudgetSource(
            source="repeatability",
            type="A",
            distribution="normal",
            standard_uncertainty=fit,
            unit=unit,
            contribution=fit,
            degrees_of_freedom=freedom if freedom < VERY_MANY else None,
        )
        if "parts_jacobian" not in figures:
            return
        gradient = figures["parts_jacobian"][k] * _PRINTED[k]
        by_reference = gradient @ figures["by_reference"]
        for stated in self.reference[triad.triad]:
            contribution = _root(by_reference @ stated.covariance @ by_reference)  # eq. 16
            same = float(_sigmas_of(stated.covariance)[k])
            yield BudgetSource(
                source=stated.source,
                type="B",
                distribution=stated.distribution,
                standard_uncertainty=same if same > 0.0 else contribution,
                unit=unit,
                contribution=contribution,
                degrees_of_freedom=stated.degrees_of_freedom,
                common=True,
            )
        shared = (
            ("local gravity", "m/s^2", self.gravity_sigma, figures["by_gravity"]),
            ("rates of the table", "1", self.table_sigma, figures["by_table"]),
        )
        for name, of, sigma, response in shared:
            if sigma > 0.0 and any(response):
                yield BudgetSource(
                    source=name,
                    type="B",
                    distribution="normal",
                    standard_uncertainty=sigma,
                    unit=of,
                    contribution=abs(float(gradient @ np.array(response))),  # eq. 16
                    common=True,
                )
        for error in own:
            contribution = _root(gradient @ error.covariance @ gradient)
            if contribution > 0.0:
                yield BudgetSource(
                    source=error.source,
                    type="B",
                    distribution=error.distribution,
                    standard_uncertainty=float(error.sigma[k % 3] if k < _ANGLES else error.sigma.max()),
                    unit=triad.unit,
                    contribution=contribution,
                )

    def _temperature(self, triad: TriadResult, unit: Imu) -> Iterator[OwnError]:
        """Yields the error by the range of temperatures of the target in the session, by its grade."""
        seen = unit.acquired.temperature
        if self.target_grade is None or seen is None:
            return
        low, mean, high = seen
        kelvin = max(mean - low, high - mean)
        coefficient = getattr(Grade.named(self.target_grade), triad.triad).temperature_coefficient
        sigma = np.full(3, coefficient * kelvin / math.sqrt(3.0))  # eq. 12
        if kelvin > 0.0:
            covariance = np.diag(np.concatenate([np.zeros(9), sigma**2]))
            name = f"temperature within {kelvin:.2g} K, grade {self.target_grade}"
            yield OwnError(name, "rectangular", sigma, covariance)


def _root(variance: float) -> float:
    return math.sqrt(max(0.0, float(variance)))


def _sigmas_of(covariance: FloatArray) -> FloatArray:
    """(12,) 1-sigma of bias, scale, non-orthogonality and mounting of `(I + E) u + e`, as printed."""
    jacobian = np.zeros((12, 12))
    jacobian[:3, 9:] = np.eye(3)
    jacobian[3:, :9] = factor_jacobian(np.eye(3))
    found: FloatArray = _PRINTED * np.sqrt(np.maximum(0.0, np.diag(jacobian @ covariance @ jacobian.T)))
    return found


def _resolution(triad: TriadResult, unit: Imu, rests: Sequence[Rest]) -> Iterator[OwnError]:
    """Yields the error of means over readings in whole steps, where noise does not spread these."""
    step, noise = _steps(triad.triad, unit), triad.noise_density * math.sqrt(_rate(unit))
    seen = step > 0.0
    sigma = np.zeros(3)
    # Steps add a twelfth of their square to the variance of readings (Sheppard).
    own_noise = np.nan_to_num((noise[seen] / step[seen]) ** 2 - 1.0 / 12.0)
    spread = np.exp(-2.0 * math.pi**2 * np.maximum(0.0, own_noise))
    sigma[seen] = step[seen] / math.sqrt(12.0) * spread  # eq. 14
    inverse = _normal_inverse(triad, rests)
    if inverse is None or not sigma.any():
        return
    covariance = np.zeros((12, 12))
    for axis in range(3):
        places = [3 * axis, 3 * axis + 1, 3 * axis + 2, 9 + axis]
        covariance[np.ix_(places, places)] = sigma[axis] ** 2 * inverse  # eq. 15
    yield OwnError("resolution", "rectangular", sigma, covariance)


def _normal_inverse(triad: TriadResult, rests: Sequence[Rest]) -> FloatArray | None:
    """(4, 4) covariance of a row of M and its bias by unit errors of the means at rest; None without rests.

    A gyroscope has its bias alone from these: while it turns, readings sweep over many steps.
    """
    used = [rest for rest in rests if rest.used]
    if triad.triad == "gyroscope":
        return np.diag([0.0, 0.0, 0.0, 1.0 / len(used)]) if used else None
    if "matrix" not in triad.estimated:
        return None
    readings = np.array([rest.specific_force for rest in used])
    rows = np.column_stack([(readings - triad.b) @ np.linalg.inv(triad.M).T, np.ones(len(used))])
    found: FloatArray = np.linalg.inv(rows.T @ rows)
    return found


def _steps(triad: CalibratedTriad, unit: Imu) -> FloatArray:
    """(3,) steps of the readings of a log, unit of the triad; 0 where they show none."""
    chunk = next(iter(unit.recording.chunks()), None)
    if chunk is None:
        return np.zeros(3)
    readings = getattr(chunk, triad)[:SAMPLES]
    return np.array([quantisation_step(column[np.isfinite(column)]) or 0.0 for column in readings.T])


def _rate(unit: Imu) -> float:
    """Hz."""
    duration = unit.log.duration
    return unit.acquired.samples / duration if duration > 0.0 else 0.0
