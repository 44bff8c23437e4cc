"""Errors that were found in flights before, as each monitor takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from typing import Any, TypeAlias

import numpy as np

from benchmarks.flights.folder import RecordedFlight
from benchmarks.flights.model.error import ARM, BIAS, STORED, Errors, nothing_known
from benchmarks.flights.model.monitor import flown
from benchmarks.redundancy_set import SENSORS, Samples
from tumble.foundation.recording import FloatArray

Pair: TypeAlias = tuple[int, int]
"""Primary and secondary."""
RESIDUAL: Mapping[str, float] = {"accelerometer": 0.08, "gyroscope": 0.002}
"""m/s^2 and rad/s that held-out pairs of these flights left (`docs/benchmarks`)."""
PAIRS = 400
"""Number of pairs that a stored record states."""


@dataclass(frozen=True, slots=True)
class Store:
    """Errors of each unit beside each other one."""

    errors: Mapping[Pair, Errors]
    """Those of sets of two, one run."""

    def of_set(self, numbers: Sequence[int]) -> Errors:
        """Returns the errors of a set, primary first, as they may have changed since."""
        pairs = [self.errors[numbers[0], other] for other in numbers[1:]]
        joined = {}
        for name in Errors.__slots__:
            of_pairs = [getattr(each, name)[:, 1:] for each in pairs]
            joined[name] = np.concatenate([np.zeros_like(of_pairs[0]), *of_pairs], axis=1)
        return Errors(**joined).aged(STORED)


def learnt(flights: Sequence[RecordedFlight]) -> Store:
    """Flies flights one after the other, all pairs of units, and keeps the errors after the last."""
    pairs = list(permutations(range(len(flights[0].units)), 2))
    known = nothing_known(len(pairs), 2)
    for flight in flights:
        ends = flown([[flight.units[one], flight.units[other]] for one, other in pairs], known)
        known = joined([each.errors for each in ends]).aged(STORED)
    return Store({pair: run_of(known, [index]) for index, pair in enumerate(pairs)})


def joined(errors: Sequence[Errors]) -> Errors:
    """Returns the errors of runs as those of one batch."""
    return Errors(*(np.concatenate([getattr(each, name) for each in errors]) for name in Errors.__slots__))


def run_of(errors: Errors, runs: Sequence[int]) -> Errors:
    """Returns the errors of some runs of a batch."""
    return Errors(*(getattr(errors, name)[list(runs)] for name in Errors.__slots__))


def records(errors: Errors) -> list[dict[str, Any]]:
    """Returns the records of the present monitor of the first run; identities are numbers of units from 1."""
    found = []
    for unit in range(1, errors.rate.shape[1]):
        for sensor in SENSORS:
            matrix, bias = _corrections(errors, unit, sensor)
            sigmas = np.sqrt(_variances(errors, unit, sensor))
            record: dict[str, Any] = {
                "identity": unit + 1,
                "sensor": sensor,
                "fit_model": "affine",
                "directions": 3,
                "pairs": PAIRS,
                "sequence": 1,
                "matrix": matrix,
                "bias": bias,
                "matrix_sigma": np.ascontiguousarray(sigmas[:9].reshape(3, 3)),
                "bias_sigma": np.ascontiguousarray(sigmas[9:12]),
                "residual": RESIDUAL[sensor],
                "followed": np.zeros(3),
            }
            if sensor == "accelerometer":
                arm = errors.force[0, unit, ARM].copy()
                record |= {
                    "fit_model": "affine and lever arm",
                    "lever_arm": arm,
                    "lever_arm_sigma": sigmas[12:],
                }
            found.append(record)
    return found


def _corrections(errors: Errors, unit: int, sensor: str) -> tuple[FloatArray, FloatArray]:
    if sensor == "gyroscope":
        rows = errors.rate[0, unit]
        return np.ascontiguousarray(np.eye(3) + rows[:, :3]), rows[:, 3].copy()
    force = errors.force[0, unit]
    return np.eye(3) + force[:9].reshape(3, 3), force[BIAS].copy()


def _variances(errors: Errors, unit: int, sensor: str) -> FloatArray:
    if sensor == "accelerometer":
        return np.array(np.diagonal(errors.force_covariance[0, unit]))
    row = np.diagonal(errors.rate_covariance[0, unit])
    return np.concatenate([np.tile(row[:3], 3), np.full(3, row[3])])


def corrected(units: Sequence[Samples], errors: Errors) -> list[Samples]:
    """Returns samples with the errors of the first run subtracted, but not those of their places."""
    found = [units[0]]
    for unit, samples in enumerate(units[1:], start=1):
        readings = []
        for sensor, given in zip(SENSORS, (samples.specific_force, samples.angular_rate), strict=True):
            matrix, bias = _corrections(errors, unit, sensor)
            readings.append(np.linalg.solve(matrix, (given - bias).T).T)
        found.append(replace(samples, specific_force=readings[0], angular_rate=readings[1]))
    return found
