"""The same model in the core, in Rust: runs through it, and errors as it takes them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg

from benchmarks.flights.model.error import Errors
from benchmarks.redundancy_judgement import Event
from benchmarks.redundancy_set import Samples
from tumble import _core
from tumble.foundation.recording import FloatArray

ORDER = [0, 1, 2, 9, 3, 4, 5, 10, 6, 7, 8, 11, 12, 13, 14]
"""Parameters of an accelerometer as the core orders them: axis by axis, then the lever arm."""


def flown_by_core(
    samples: Sequence[Samples],
    errors: Errors | None = None,
    *,
    find_delays: bool = True,
    precision: str = "f64",
) -> tuple[list[Event], Errors | None]:
    """Flies one run: its events, and the errors at its end; nothing where the primary is wrong.

    Errors that are stored are those of the first run.
    """
    monitor = _core.SetMonitor(len(samples), find_delays, precision)
    if errors is not None:
        for unit in range(1, len(samples)):
            monitor.set_errors(unit, *triangles(errors, unit))
    events = monitor.replay(
        [np.ascontiguousarray(each.time) for each in samples],
        [np.ascontiguousarray(each.specific_force) for each in samples],
        [np.ascontiguousarray(each.angular_rate) for each in samples],
        [np.ascontiguousarray(each.arrival) for each in samples],
    )
    known = [monitor.errors(unit) for unit in range(1, len(samples))]
    found = [(float(time), unit, name, dict(figures)) for time, unit, name, figures in events]
    return found, _errors([each for each in known if each is not None])


def triangles(errors: Errors, unit: int) -> tuple[list[float], list[float]]:
    """Returns the rows of both triangles of a unit of the first run: information, and right sides."""
    rate = _triangle(errors.rate_covariance[0, unit], errors.rate[0, unit].T)
    force = _triangle(
        errors.force_covariance[0, unit][np.ix_(ORDER, ORDER)], errors.force[0, unit][ORDER, None]
    )
    return rate, force


def _triangle(covariance: FloatArray, mean: FloatArray) -> list[float]:
    upper = scipy.linalg.cholesky(np.linalg.inv(covariance))
    right = upper @ mean
    return [float(x) for i in range(len(upper)) for x in (*upper[i, i:], *right[i])]


def _errors(known: Sequence[tuple[list[float], list[float]]]) -> Errors | None:
    if not known:
        return None
    units = len(known) + 1
    found = Errors(
        np.zeros((1, units, 3, 4)),
        np.zeros((1, units, 4, 4)),
        np.zeros((1, units, 15)),
        np.zeros((1, units, 15, 15)),
    )
    for unit, (rate, force) in enumerate(known, start=1):
        found.rate_covariance[0, unit], mean = _moments(rate, 4, 3)
        found.rate[0, unit] = mean.T
        covariance, mean = _moments(force, 15, 1)
        found.force[0, unit, ORDER] = mean[:, 0]
        found.force_covariance[0, unit][np.ix_(ORDER, ORDER)] = covariance
    return found


def _moments(rows: Sequence[float], unknowns: int, sides: int) -> tuple[FloatArray, FloatArray]:
    """Returns covariance (n, n) and mean (n, m) of the rows of a triangle."""
    upper, right, left = np.zeros((unknowns, unknowns)), np.zeros((unknowns, sides)), np.array(rows)
    for i in range(unknowns):
        upper[i, i:], right[i] = left[: unknowns - i], left[unknowns - i : unknowns - i + sides]
        left = left[unknowns - i + sides :]
    inverse = scipy.linalg.solve_triangular(upper, np.eye(unknowns))
    return inverse @ inverse.T, inverse @ right
