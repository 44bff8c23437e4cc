"""Choice of the powers of temperature that the plateaus bear (docs/theory/plateaus.md, Order).

The rule is that of `tumble thermal`: the simplest polynomial that does not predict a plateau that was left
out clearly worse than the best, and none simpler than one whose highest power is beyond doubt.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tumble import _core
from tumble.calibration.temperature_drift import HIGHEST_ORDER
from tumble.foundation.recording import FloatArray
from tumble.tools.plateaus.result import PolynomialScore

CERTAIN = 2.0
"""Sigmas beyond which a highest power is kept: a lost power costs more than one that is none."""
_BELOW = 0.975


def highest_order(plateaus: int) -> int:
    """Returns the highest power that leaves one plateau to check it."""
    return min(HIGHEST_ORDER, plateaus - 2)


def choose_order(
    x: FloatArray, beside: FloatArray, values: FloatArray, sigma: FloatArray, plateau: Sequence[int]
) -> tuple[PolynomialScore, ...]:
    """Scores each order for the values (n,) of one parameter, and marks the chosen one.

    `x` (n,) is the scaled temperature, `beside` (n, m) are columns that are fitted beside the powers,
    `plateau` (n,) numbers the temperatures, those of one plateau alike.
    """
    number = np.array(plateau)
    groups = [number == each for each in np.unique(number)]
    orders = range(1, highest_order(len(groups)) + 1)
    designs = [np.column_stack([beside, *(x**power for power in range(order + 1))]) for order in orders]
    squares = np.array([_left_out(design, values, sigma, groups) for design in designs])
    errors = squares.mean(axis=1)
    best = int(errors.argmin())
    simplest = next(k for k in range(len(orders)) if _is_as_good(squares[k] - squares[best]))
    known = max((k for k in range(len(orders)) if _is_certain(designs[k], values, sigma)), default=0)
    chosen = max(simplest, known)
    return tuple(
        PolynomialScore(order, float(np.sqrt(errors[k])), k == chosen) for k, order in enumerate(orders)
    )


def _left_out(
    design: FloatArray,
    values: FloatArray,
    sigma: FloatArray,
    groups: Sequence[np.typing.NDArray[np.bool_]],
) -> FloatArray:
    """(plateaus,) mean square error with which each is predicted from the others, eq. 5."""
    found = []
    for out in groups:
        solution = _fit(design[~out], values[~out], sigma[~out])[0]
        found.append(float(np.mean((values[out] - design[out] @ solution) ** 2)))
    return np.array(found)


def _is_as_good(worse: FloatArray) -> bool:
    """Tests whether a candidate is not clearly worse than the best, by its excess (plateaus,), eq. 6."""
    count = len(worse)
    error = float(worse.std(ddof=1)) / np.sqrt(count)
    return bool(worse.mean() <= _core.student_quantile(_BELOW, count - 1.0) * error)


def _is_certain(design: FloatArray, values: FloatArray, sigma: FloatArray) -> bool:
    """Tests whether the highest power is beyond chance, scatter beyond the sigmas included, eq. 7."""
    solution, covariance = _fit(design, values, sigma)
    freedom = len(values) - design.shape[1]
    if freedom < 1:
        return False
    chi_square = float(np.sum(((values - design @ solution) / sigma) ** 2))
    scatter = np.sqrt(max(1.0, chi_square / freedom))
    return bool(abs(solution[-1]) > CERTAIN * scatter * np.sqrt(covariance[-1, -1]))


def _fit(design: FloatArray, values: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weighted least squares: solution and covariance."""
    inverse = np.linalg.pinv(design / sigma[:, None])
    return inverse @ (values / sigma), inverse @ inverse.T
