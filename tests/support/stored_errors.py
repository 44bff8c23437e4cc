"""Errors as the store keeps them, made up."""

from __future__ import annotations

import numpy as np

from tumble.procedures.redundancy.result import UNKNOWN, SecondaryError
from tumble.procedures.redundancy.store import Identified

ONE, TWO = Identified("imu1", 1), Identified("imu2", 2)


def an_error(sensor="accelerometer", sequence=1, **changes):
    fields = {
        "matrix": np.eye(3) * 1.01,
        "bias": np.array([0.1, -0.2, 1.0 / 3.0]),
        "matrix_sigma": np.array([[1e-3, np.inf, 1e-3]] * 3),
        "bias_sigma": np.array([1e-3, 2e-3, np.inf]),
        "lever_arm": np.array([0.01, 0.02, 0.03]) if sensor == "accelerometer" else None,
        "lever_arm_sigma": np.array([1e-3, 1e-3, np.inf]) if sensor == "accelerometer" else None,
        "fit_model": "affine",
        "directions": 2,
        "residual": 0.02,
        "residual_before": 0.3,
        "pairs": 400,
        "followed": np.array([0.01, -0.02, 0.0]),
        "adopted": 12.0,
    }
    whose = {"unit": "imu2", "sensor": sensor, "sequence": sequence}
    return SecondaryError(**(UNKNOWN | whose | fields | changes))
