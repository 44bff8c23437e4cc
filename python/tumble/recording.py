"""A recording of one inertial measurement unit, read in chunks so that its length does not matter."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]

SampleProgress: TypeAlias = Callable[[int, int | None], None]
"""Told samples done, and samples expected where they are known."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """Successive samples of one IMU, in SI units and the case frame of the IMU."""

    time: FloatArray
    """(n,) seconds of the recording's own clock."""
    accelerometer: FloatArray
    """(n, 3) specific force, m/s^2: at rest and upright it reads +g up."""
    gyroscope: FloatArray
    """(n, 3) angular rate, rad/s."""
    temperature: FloatArray | None = None
    """(n,) degC, where the log has it."""

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True, slots=True)
class ResolvedUnit:
    """The unit a quantity was found in, and why it was taken to be that one."""

    name: str
    """As written in the field: `m/s^2`, `g`, `rad/s`, `deg/s`, `counts`, `s`, `ms`, `us`, `ns`, `degC`."""
    scale: float
    """SI value of one unit."""
    reason: str
    """`column name`, `option`, `norm at rest`, `message definition`, `assumed` ..."""


@dataclass(frozen=True, slots=True)
class Metadata:
    """What is known of a recording besides its samples."""

    name: str
    """Short name for tables and file names: `target_1`, `exp_3-imu2`."""
    source: str
    """What the user typed: path, and IMU where the file holds several."""
    format: str
    """`csv`, `parquet`, `imu_tk`, `ros1`, `ros2`, `mcap`, `arrays`, `folder`."""
    accelerometer_unit: ResolvedUnit
    gyroscope_unit: ResolvedUnit
    time_unit: ResolvedUnit
    frame: str = "case"
    """Frame the log declares (`frame_id`), else `case`."""
    clock: str = ""
    """Name of the time base: recordings with the same non-empty clock share it for certain."""
    rate: float | None = None
    """Declared sample rate in Hz where the log or the user states one."""
    already_corrected: bool | None = None
    """True where the source is known to apply a calibration before logging, None where nobody knows."""
    serial: str = ""
    """Serial number of the unit where the log or the user states one."""
    alone: bool = True
    """True where no other IMU was logged with this one."""
    remarks: tuple[str, ...] = ()
    """What the reader did that a user should know: signs turned, rows skipped."""


@dataclass(frozen=True, slots=True)
class Recording:
    """A source of chunks, with metadata. It can be read more than once."""

    metadata: Metadata
    open: Callable[[], Iterator[Chunk]] = field(repr=False)
    """Starts a fresh pass over the samples."""
    parts: tuple[Recording, ...] = ()
    """One recording a pose, where the recording is a folder of such files."""

    @property
    def name(self) -> str:
        """Short name for tables and file names."""
        return self.metadata.name

    def chunks(self) -> Iterator[Chunk]:
        """Pass over all samples, chunk by chunk."""
        return self.open()

    @classmethod
    def from_arrays(
        cls,
        name: str,
        time: FloatArray,
        accelerometer: FloatArray,
        gyroscope: FloatArray,
        temperature: FloatArray | None = None,
        *,
        serial: str = "",
        clock: str = "",
    ) -> Recording:
        """Wrap arrays in memory: time (n,) s, specific force (n, 3) m/s^2, angular rate (n, 3) rad/s."""
        chunk = Chunk(
            np.ascontiguousarray(time, dtype=np.float64),
            np.ascontiguousarray(accelerometer, dtype=np.float64),
            np.ascontiguousarray(gyroscope, dtype=np.float64),
            None if temperature is None else np.ascontiguousarray(temperature, dtype=np.float64),
        )
        metadata = Metadata(
            name=name,
            source=name,
            format="arrays",
            accelerometer_unit=ResolvedUnit("m/s^2", 1.0, "arrays are SI"),
            gyroscope_unit=ResolvedUnit("rad/s", 1.0, "arrays are SI"),
            time_unit=ResolvedUnit("s", 1.0, "arrays are SI"),
            serial=serial,
            clock=clock,
        )
        return cls(metadata, lambda: iter((chunk,)))


RecordingSource: TypeAlias = Recording | str | Path
"""A recording, or what names one: LOG, or LOG:NAME for one IMU of several."""
