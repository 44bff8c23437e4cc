"""Calibration files as the turntable writes them, with numbers that a test chooses."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from tumble.calibration.document import Calibration
from tumble.foundation.error_decomposition import factor_jacobian

BIAS_SIGMA = 1e-3
COMMON_SIGMA = 4e-4


def covariance_of(sigmas, matrix=None):
    """(12, 12) of M row by row and b that has these sigmas of bias, scale and angles, deg."""
    angles = [*sigmas["non-orthogonality"].values(), *sigmas["mounting"]]
    of_factors = np.concatenate([sigmas["scale"], np.radians(angles)])
    by_factors = np.linalg.inv(factor_jacobian(np.eye(3) if matrix is None else matrix))
    found = np.zeros((12, 12))
    found[:9, :9] = (by_factors * of_factors**2) @ by_factors.T
    found[9:, 9:] = np.diag(np.square(sigmas["bias"]))
    return found


def made_up(
    serial="0042",
    *,
    name="unit",
    bias=(0.1, -0.2, 0.3),
    date="2026-01-05T10:00:00Z",
    log="log",
    limits=None,
    verdict="calibrated",
    sigma=BIAS_SIGMA,
    common=COMMON_SIGMA,
    operator="Ann",
    **options,
):
    """A calibration of an accelerometer whose bias is chosen."""
    sigmas = {
        "bias": np.full(3, sigma),
        "scale": np.full(3, 1e-4),
        "non-orthogonality": dict.fromkeys(("xy", "yz", "zx"), 0.01),
        "mounting": np.full(3, 0.01),
    }
    shared = {
        "bias": np.full(3, common),
        "scale": np.full(3, 5e-5),
        "non-orthogonality": dict.fromkeys(("xy", "yz", "zx"), 0.005),
        "mounting": np.full(3, 0.005),
    }
    triad = {
        "unit": "m/s^2",
        "M": np.eye(3),
        "b": np.array(bias, float),
        "angles": {
            "non-orthogonality": dict.fromkeys(("xy", "yz", "zx"), 0.0),
            "mounting": np.zeros(3),
        },
        "sigma": sigmas,
        "estimated": ("bias", "matrix"),
        "inherited": {"source": "calibration", "sigma": shared, "covariance": covariance_of(shared)},
    }
    return Calibration.model_validate(
        {
            "name": name,
            "serial": serial,
            "software": "tumble 0.1.0",
            "date": date,
            "operator": operator,
            "station": "table 1",
            "log": {
                "file": f"{log}.csv",
                "sha256": hashlib.sha256(log.encode()).hexdigest(),
                "duration": 80.0,
            },
            "verdict": verdict,
            "limits": limits,
            "method": {"procedure": "turntable", "truth": "reference", "options": dict(options)},
            "temperature": {"low": 24.0, "mean": 25.0, "high": 26.0},
            "accelerometer": triad,
        }
    )


def save(folder: Path, *calibrations: Calibration) -> Path:
    """Write calibrations and pages beside them as the turntable does; the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, each in enumerate(calibrations):
        each.save(folder / f"result_{number}.yaml")
        (folder / f"result_{number}.html").write_text(
            f'<!doctype html><meta name="generator" content="Tumble"><p>{each.serial} {number}</p>'
        )
    return folder
