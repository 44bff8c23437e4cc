"""Errors that secondaries have from the factory: their turntable calibrations, against the primary's.

The secondary was found to read `y_s = M_s v + b_s` for the truth v in its own axes, where v = R u with the
nominal rotation R, and the primary reads `y_p = M_p u + b_p`. So `y_s = M_r y_p + b_r` with
`M_r = M_s R M_p^-1` and `b_r = b_s - M_r b_p`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from tumble.calibration.document import Calibration, TriadCalibration
from tumble.calibration.doubts import unmet
from tumble.foundation.error_decomposition import propagated
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import FloatArray
from tumble.foundation.serials import are_of_two
from tumble.procedures.redundancy.result import UNKNOWN, SecondaryError, Sensor
from tumble.procedures.redundancy.units import UnitSettings

Factory: TypeAlias = Mapping[str, Calibration | str | Path] | Sequence[Calibration | str | Path]
"""Calibrations by the names of their units, or calibrations that state whose they are."""


def by_unit(factory: Factory, serials: Mapping[str, str]) -> dict[str, Calibration]:
    """Each calibration by the name of its unit; `serials` are those of all secondaries, by their names.

    Raises `ProcedureError` where a calibration is of none of them, or two are of one.
    """
    named: dict[str, Calibration] = {}
    stated = factory.items() if isinstance(factory, Mapping) else ((None, each) for each in factory)
    for name, given in stated:
        calibration = given if isinstance(given, Calibration) else Calibration.load(given)
        unit = name or _unit_of(calibration, serials)
        if unit not in serials:
            raise ProcedureError(f"factory: {unit}: is none of {', '.join(serials)}; use one of these names")
        if unit in named:
            raise ProcedureError(f"factory: {unit}: has two calibrations; leave one out")
        if are_of_two(calibration.serial, serials[unit]):
            raise ProcedureError(
                f"factory: {unit}: has serial {serials[unit]}, the calibration is of {calibration.serial}; "
                "give that of the unit"
            )
        for doubt in unmet(calibration):
            raise ProcedureError(f"factory: {unit}: {doubt}; calibrate it again, or leave it out")
        named[unit] = calibration
    return named


def _unit_of(calibration: Calibration, serials: Mapping[str, str]) -> str:
    by_serial = [name for name, serial in serials.items() if serial and serial == calibration.serial]
    return by_serial[0] if len(by_serial) == 1 else calibration.name


def factory_errors(
    name: str, calibration: Calibration, unit: UnitSettings, primary: Calibration | None
) -> Iterator[SecondaryError]:
    """Returns the error of each calibrated sensor; a primary without calibration is taken to be right."""
    turn = np.eye(3) if unit.sensor_from_primary is None else np.array(unit.sensor_from_primary)
    sensors: tuple[Sensor, ...] = ("accelerometer", "gyroscope")
    for sensor in sensors:
        triad: TriadCalibration | None = getattr(calibration, sensor)
        if triad is not None:
            yield _error(name, sensor, triad, turn, getattr(primary, sensor, None))


def _error(
    name: str, sensor: Sensor, triad: TriadCalibration, turn: FloatArray, primary: TriadCalibration | None
) -> SecondaryError:
    first_matrix, first_bias = (np.eye(3), np.zeros(3)) if primary is None else (primary.M, primary.b)
    matrix = triad.M @ turn @ np.linalg.inv(first_matrix)
    sigma = np.sqrt(np.diag(_covariance(triad, turn, matrix, primary)))
    sigma = np.where(np.isnan(sigma), np.inf, sigma)
    known: dict[str, Any] = {
        "unit": name,
        "sensor": sensor,
        "matrix": matrix,
        "bias": triad.b - matrix @ first_bias,
        "matrix_sigma": sigma[:9].reshape(3, 3),
        "bias_sigma": sigma[9:],
        "fit_model": "affine",
        "directions": 3,
        "residual": triad.residual,
    }
    if sensor == "accelerometer":
        known |= {"lever_arm": np.zeros(3), "lever_arm_sigma": np.full(3, np.inf)}
    return SecondaryError(**{**UNKNOWN, **known})


def _covariance(
    triad: TriadCalibration, turn: FloatArray, matrix: FloatArray, primary: TriadCalibration | None
) -> FloatArray:
    """(12, 12) of [M_r row by row, b_r]; the two calibrations count as apart."""
    identity = np.eye(3)
    back, bias = (identity, np.zeros(3)) if primary is None else (np.linalg.inv(primary.M), primary.b)
    of_secondary = np.zeros((12, 12))
    of_secondary[:9, :9] = np.kron(identity, (turn @ back).T)
    of_secondary[9:, :9] = -np.kron(identity, (turn @ back @ bias)[None])
    of_secondary[9:, 9:] = identity
    covariance = propagated(of_secondary, _stated(triad))
    if primary is None:
        return covariance
    of_primary = np.zeros((12, 12))
    of_primary[:9, :9] = -np.kron(matrix, back.T)
    of_primary[9:, :9] = np.kron(matrix, (back @ bias)[None])
    of_primary[9:, 9:] = -matrix
    return covariance + propagated(of_primary, _stated(primary))


def _stated(triad: TriadCalibration) -> FloatArray:
    """(12, 12) of [M row by row, b], NaN where the file does not state it."""
    if triad.covariance is None:
        return np.full((12, 12), np.nan)
    stated: FloatArray = np.array(triad.covariance, dtype=np.float64)
    return stated
