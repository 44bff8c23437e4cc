"""Results of a model whose bias drifts, as calibration files of some years."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np

from made_up_calibrations import made_up, save

LIMITS = {"accelerometer": {"bias": 0.5, "scale": 0.02}}


def drifting(folder: Path, *, units: int = 6, years: int = 5, drift: float = 0.05, seed: int = 3) -> Path:
    """Write results of units calibrated once a year whose bias drifts by so much, rms; the folder."""
    random = np.random.default_rng(seed)
    made = []
    for unit in range(units):
        bias = random.normal(0.0, 0.1, 3)
        for year in range(years):
            date = datetime(2020, 3, 1, tzinfo=timezone.utc) + timedelta(days=365.25 * year + unit)
            bias = bias + random.normal(0.0, drift, 3)
            made.append(
                made_up(
                    serial=f"{unit:04d}",
                    name=f"unit_{unit}",
                    bias=bias + random.normal(0.0, 1e-3, 3),
                    date=date.strftime("%Y-%m-%dT%H:%M:%SZ"),
                    log=f"{unit} {year}",
                    limits=LIMITS,
                    verdict="pass",
                )
            )
    return save(folder, *made)
