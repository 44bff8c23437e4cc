"""Files that a conversion wrote, as plain data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from tumble.foundation.arrival import Arrival
from tumble.foundation.plain import finite
from tumble.foundation.results import Row, Tabular
from tumble.foundation.words import count_of


@dataclass(frozen=True, slots=True)
class ConvertedImu:
    """One IMU in the file that holds it now."""

    imu: str
    """Name of the IMU in the log; empty where it needs no name."""
    path: Path
    name: str
    """Name after `LOG:` in the new file; empty where it needs no name."""
    samples: int
    rate: float
    """Hz."""
    jitter: float
    """1-sigma of the time between samples, s."""
    arrival: Arrival | None
    """Arrival; None where the log has only one time."""
    remarks: tuple[str, ...]
    """Remarks for the user, including what the new file cannot hold."""
    axes: str = ""
    """Directions of the axes as the format of the log defines them; they are not turned."""


@dataclass(frozen=True, slots=True)
class Converted(Tabular):
    """A log in another format."""

    source: str
    format: str
    imus: tuple[ConvertedImu, ...]

    @property
    def paths(self) -> tuple[Path, ...]:
        """Written files, each once."""
        return tuple(dict.fromkeys(each.path for each in self.imus))

    def rows(self) -> Iterator[Row]:
        """Returns a line for each IMU."""
        for each in self.imus:
            yield {
                "imu": each.imu,
                "path": str(each.path),
                "samples": each.samples,
                "rate": each.rate,
                "jitter": each.jitter,
                "skew": None if each.arrival is None else each.arrival.skew,
                "arrival_jitter": None if each.arrival is None else each.arrival.jitter,
            }

    def content(self) -> dict[str, Any]:
        """Plain mappings, lists, text and finite numbers, for JSON."""
        return cast("dict[str, Any]", finite(self))

    def __repr__(self) -> str:
        return "\n".join([f"Converted({self.source} to {self.format})", *map("  {}".format, self.lines())])

    def lines(self) -> list[str]:
        """Describes the written files."""
        return [line for each in self.imus for line in imu_lines(each)]


def imu_lines(imu: ConvertedImu) -> list[str]:
    """Describes the output for one IMU."""
    where = f"{imu.path}:{imu.name}" if imu.name else str(imu.path)
    lines = [
        f"{where}: {count_of('sample', imu.samples)}, {imu.rate:.6g} Hz, jitter {1e6 * imu.jitter:.3f} us"
    ]
    if imu.axes:
        lines.append(f"  axes, as in the log: {imu.axes}")
    if imu.arrival is not None:
        lines.append(
            f"  time is the sensor's; that of recording gains {1e6 * imu.arrival.skew:+.3f} us/s on it "
            f"(skew), with a jitter of {1e6 * imu.arrival.jitter:.3f} us"
        )
    return lines
