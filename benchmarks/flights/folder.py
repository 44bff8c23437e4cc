"""A folder of flights with several IMUs and a satellite receiver: a folder each, a table a unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]

from benchmarks.redundancy_set import Samples
from tumble.foundation.recording import FloatArray

FORCE = ("ax", "ay", "az")
RATE = ("gx", "gy", "gz")
PLACE = ("north", "east", "down")
EVERY = 2
"""Positions, of which there are ten a second, from one velocity to the next."""
SIGMA = (0.1, 0.1, 0.2)
"""m/s of a velocity: heights are in steps of 0.1 m."""


@dataclass(frozen=True, slots=True)
class RecordedFlight:
    """A flight as it was recorded."""

    name: str
    units: tuple[Samples, ...]
    position_time: FloatArray
    """(m,) s by the clock of the first unit."""
    position: FloatArray
    """(m, 3) m."""

    @property
    def velocity(self) -> tuple[FloatArray, FloatArray]:
        """Times (k,) s, five a second, and velocities then (k, 3) m/s, level axes, z up, as of a receiver."""
        time, level = self.position_time[2::EVERY], self.position * [1.0, -1.0, -1.0]
        central = (level[2:] - level[:-2]) / (self.position_time[2:] - self.position_time[:-2])[:, None]
        return time[: len(central[1::EVERY])], central[1::EVERY]

    @property
    def duration(self) -> float:
        """Time from the first sample of the latest unit to the last of the earliest, s."""
        return float(min(each.time[-1] for each in self.units) - max(each.time[0] for each in self.units))


def flights(folder: Path) -> list[Path]:
    """Returns the folders of flights, by name."""
    return sorted(each for each in folder.iterdir() if (each / "imu_1.parquet").is_file())


def read(folder: Path) -> RecordedFlight:
    """Reads a flight, in s since its first sample."""
    tables = [pq.read_table(each) for each in sorted(folder.glob("imu_*.parquet"))]
    start = min(float(np.min(table["time"].to_numpy())) for table in tables)
    units = tuple(_samples(table, start) for table in tables)
    receiver = folder / "rtk.parquet"
    if not receiver.is_file():
        return RecordedFlight(folder.name, units, np.zeros(0), np.zeros((0, 3)))
    position = pq.read_table(receiver)
    return RecordedFlight(folder.name, units, position["time"].to_numpy() - start, _columns(position, PLACE))


def _samples(table: pa.Table, start: float) -> Samples:
    time = np.asarray(table["time"].to_numpy(), dtype=float) - start
    order = np.argsort(time, kind="stable")
    time = time[order]
    return Samples(time, time, _columns(table, FORCE)[order], _columns(table, RATE)[order])


def _columns(table: pa.Table, names: Sequence[str]) -> FloatArray:
    return np.column_stack([np.asarray(table[name].to_numpy(), dtype=float) for name in names])
