"""Jobs of fleets as they lie in a folder: done, running, killed, not begun, damaged."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tumble.fleet import ledger
from tumble.fleet.job import load_job
from tumble.fleet.ledger import JobStatus
from tumble.fleet.parts import Outcome, write_parts
from tumble.fleet.places import FileStore
from tumble.foundation import clock
from tumble.foundation.recording import FloatArray

NAME = "accelerometer bias x"
U = 1e-3
YEARS = (2023, 2024, 2025, 2026)
UNITS = 24
FAILURE = "logs/none.csv: no such file"
MOVED = "unit3"
"""A unit whose bias jumped at its last calibration."""


def write_fleets(folder: Path) -> None:
    """Writes job files and results into a folder."""
    done = JobStatus("done", UNITS * len(YEARS) + 1, UNITS * len(YEARS) + 1, 1, 0, 0, 40.0, 2.4, "local")
    _write(folder, "spins", done)
    write_parts(FileStore(str(folder / "spins-results")), [*outcomes_of(_values(), YEARS), _failed()])
    running = JobStatus("running", 1000, 250, 0, 3, 1, 12.5, 20.0, "ray", written=clock.utc() + 3600.0)
    _write(folder, "drives", running)
    _write(folder, "killed", JobStatus("running", 50, 10, 0, 0, 0, 2.0, 5.0, "local", written=1.0))
    _write(folder, "next", None)
    (folder / "broken.yaml").write_text("procedure: nonsense\ninputs: a.csv\nresults: r\n")


def _write(folder: Path, name: str, status: JobStatus | None) -> None:
    path = folder / f"{name}.yaml"
    path.write_text(f'procedure: spin\ninputs: "{name}/{{unit}}.csv"\nresults: {name}-results\n')
    if status is not None:
        results = FileStore(str(folder / f"{name}-results"))
        ledger.begin(results, load_job(path))
        ledger.write_status(results, status)


def _values() -> FloatArray:
    draws = np.random.default_rng(5)
    values = np.cumsum(draws.normal(0.0, 5e-3, (UNITS, len(YEARS))), axis=1)
    values += draws.normal(0.0, U, values.shape)
    values[int(MOVED.removeprefix("unit")), -1] += 0.2
    return values


def outcomes_of(values: FloatArray, years: Sequence[int], lot: str = "lot-") -> list[Outcome]:
    """Results of units, one calibration in each year: `values` is (units, years) of the bias, m/s^2."""
    return [
        Outcome(
            key=f"{unit:08d}{year:08d}".encode(),
            place=f"spins/unit{unit}-{year}.csv",
            unit=f"unit{unit}",
            model="M1",
            lot=f"{lot}{unit % 2}",
            day=f"{year}-03-01",
            verdict="calibrated",
            parameters=({"name": NAME, "unit": "m/s^2", "value": float(value), "u": U, "common": 0.0},),
        )
        for unit, own in enumerate(values)
        for year, value in zip(years, own, strict=True)
    ]


def _failed() -> Outcome:
    return Outcome(key=b"f" * 16, place="spins/none.csv", exit_code=2, failure=FAILURE)
