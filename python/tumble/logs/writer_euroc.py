"""EuRoC (ASL) out: a folder for each IMU, with data.csv and sensor.yaml."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.csv  # type: ignore[import-untyped]

from tumble.foundation.files import NO_MARK, FileKind, no_empty_folder, prepare_folder, replacing, write_text
from tumble.foundation.recording import Chunk
from tumble.logs.writer_mcap import nanoseconds_of

_NAMES = (
    "#timestamp [ns]",
    *(f"w_RS_S_{axis} [rad s^-1]" for axis in "xyz"),
    *(f"a_RS_S_{axis} [m s^-2]" for axis in "xyz"),
)
_TABLE = FileKind("data.csv of a EuRoC folder", re.compile(rb"\A#timestamp \[ns\],w_RS_S_x"), NO_MARK)
_SENSOR = FileKind(
    "sensor.yaml of a EuRoC folder",
    re.compile(rb"sensor_type: *imu"),
    re.compile(rb"take it from tumble export"),
)
_SENSOR_TEXT = """\
# Noise is not known of a log: take it from tumble export CALIBRATION --format kalibr-noise.
sensor_type: imu
comment: {comment}
T_BS:
  cols: 4
  rows: 4
  data: [1.0, 0.0, 0.0, 0.0,
         0.0, 1.0, 0.0, 0.0,
         0.0, 0.0, 1.0, 0.0,
         0.0, 0.0, 0.0, 1.0]
rate_hz: {rate:.6g}
"""


class EurocWriter:
    """The table of one IMU."""

    def __init__(self, writer: pa.csv.CSVWriter, path: Path) -> None:
        self._writer = writer
        self._path = path

    def write(self, chunk: Chunk) -> None:
        """Appends rows; stamps are whole nanoseconds."""
        columns = [nanoseconds_of(chunk.time, self._path), *chunk.gyroscope.T, *chunk.accelerometer.T]
        arrays = [pa.array(np.ascontiguousarray(column)) for column in columns]
        self._writer.write_batch(pa.record_batch(arrays, schema=_schema()))


def _schema() -> pa.Schema:
    return pa.schema([(_NAMES[0], pa.int64()), *((name, pa.float64()) for name in _NAMES[1:])])


@contextmanager
def open_euroc_writer(folder: Path, inputs: tuple[Path, ...] = ()) -> Iterator[EurocWriter]:
    """Opens `folder/data.csv`, which is there once the block ends without error; folders are made."""
    path = folder / "data.csv"
    with no_empty_folder(folder), replacing(_in_folder(path), _TABLE, inputs=inputs) as file:
        file.write((",".join(_NAMES) + "\n").encode())
        options = pa.csv.WriteOptions(include_header=False, quoting_style="none")
        with pa.csv.CSVWriter(file, _schema(), write_options=options) as writer:
            yield EurocWriter(writer, path)


def write_sensor(folder: Path, comment: str, rate: float) -> None:
    """Writes `folder/sensor.yaml`, with what is known."""
    quoted = '"' + comment.replace("\\", "/").replace('"', "'") + '"'
    write_text(folder / "sensor.yaml", _SENSOR_TEXT.format(comment=quoted, rate=rate), _SENSOR)


def _in_folder(path: Path) -> Path:
    prepare_folder(path.parent)
    return path
