"""Chi-square tests of differences against chance (docs/theory/compare.md, eq. 6 to 8)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.tools.compare.parameters import Differences
from tumble.tools.compare.result import Difference, JointTest

ALL = "all of them"
TEMPERATURE = "temperature drift"
_DEGENERATE = 1e-10
"""Share of the largest eigenvalue of a correlation below which a direction is none of its own."""


def joint_test(found: Differences) -> JointTest | None:
    """Tests all that can be compared together; None where that is nothing."""
    return _test(ALL, found, [k for k, row in enumerate(found.rows) if row.compared])


def group_tests(found: Differences) -> Iterator[JointTest]:
    """Tests each kind of parameter by itself."""
    for group in dict.fromkeys(row.group for row in found.rows):
        places = [k for k, row in enumerate(found.rows) if row.compared and row.group == group]
        if (test := _test(group, found, places)) is not None:
            yield test


def largest_of(rows: Sequence[Difference]) -> JointTest | None:
    """Tests the largest of differences whose correlations are not known, eq. 8."""
    squares = [row.sigmas**2 for row in rows if row.compared]
    if not squares:
        return None
    single = _core.chi_square_tail(max(squares), 1.0)
    return JointTest(TEMPERATURE, max(squares), len(squares), min(1.0, len(squares) * single))


def _test(name: str, found: Differences, places: Sequence[int]) -> JointTest | None:
    if not places:
        return None
    values = np.array([found.rows[k].value for k in places])
    statistic, freedom = chi_square(values, found.covariance[np.ix_(places, places)])
    return JointTest(name, statistic, freedom, _core.chi_square_tail(statistic, freedom))


def chi_square(values: FloatArray, covariance: FloatArray) -> tuple[float, int]:
    """Returns d^T P^+ d of (n,) differences and (n, n) covariance, and its degrees of freedom, eq. 7."""
    sigma = np.sqrt(np.diag(covariance))
    sizes, directions = np.linalg.eigh(covariance / np.outer(sigma, sigma))
    own = sizes > _DEGENERATE * sizes[-1]
    along = directions[:, own].T @ (values / sigma)
    return float(np.sum(along**2 / sizes[own])), int(own.sum())
