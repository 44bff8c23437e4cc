"""Output of `rostopic echo -p` and `ros2 topic echo --csv` for `sensor_msgs/Imu`."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from tumble.logs.columns import ImuColumns, find_imus
from tumble.logs.csv import CsvRows, TextTable, imu_of_table, table_samples
from tumble.logs.options import ReadOptions
from tumble.logs.text import TextLayout, find_layout
from tumble.logs.text_file import open_text
from tumble.logs.track import DEFINED, LoggedImu, RawSamples, StatedUnit, choose

_HEADER_STAMP, _FRAME = "field.header.stamp", "field.header.frame_id"
_COVARIANCE = tuple(f"covariance {number}" for number in range(27))
_NAMES = (
    *("sec", "nanosec", "frame_id", "qx", "qy", "qz", "qw", *_COVARIANCE[:9]),
    *("gx", "gy", "gz", *_COVARIANCE[9:18], "ax", "ay", "az", *_COVARIANCE[18:]),
)
"""Fields of a message in the order of its definition; ROS 2 prints no names."""
_ROW = re.compile(rb"^\d+,\d+,([^,\r\n]*)(?:,[^,\r\n]*){37}\r?$", re.MULTILINE)
_HEAD_BYTES = 1 << 16


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the one topic that was printed, which needs no name."""
    return ("",)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Reads a topic that was printed; its time is that of the headers where they have one."""
    choose(path, ("",), imu, "topic")
    with open_text(path) as file:
        head = file.read(_HEAD_BYTES)
    row = _ROW.search(head)
    found = _of_ros_1(path, options) if row is None else _of_ros_2(path, head, row, options)
    return replace(
        found,
        format="ros_echo",
        columns=(),
        accelerometer_unit=StatedUnit("m/s^2", DEFINED),
        gyroscope_unit=StatedUnit("rad/s", DEFINED),
    )


def _of_ros_1(path: Path, options: ReadOptions) -> LoggedImu:
    layout = find_layout(path, options)
    columns = next(iter(find_imus(layout.names, path, options).values()))
    frame = ""
    if _FRAME in layout.names:
        frame = layout.first_field(_FRAME)
    recorded = imu_of_table(path, layout, columns, options)
    stamped = _HEADER_STAMP in layout.names and "time" not in options.columns
    by_header = (
        imu_of_table(path, layout, replace(columns, time=_HEADER_STAMP), options) if stamped else recorded
    )
    if stamped and not np.any(by_header.head().time):
        by_header = replace(recorded, notices=("headers carry no stamp: time is that of recording",))
    return replace(by_header, frame=frame or "case", time_unit=StatedUnit("ns", DEFINED))


def _of_ros_2(path: Path, head: bytes, row: re.Match[bytes], options: ReadOptions) -> LoggedImu:
    fields = tuple(row[0].decode("utf-8", "replace").strip().split(","))
    before = head[: row.start()]
    layout = TextLayout(",", _NAMES, len(before), before.count(b"\n"), fields, float(len(row[0]) + 1))
    columns = ImuColumns(("ax", "ay", "az"), ("gx", "gy", "gz"), time="sec")
    names = [*columns.names, "nanosec"]
    table = TextTable(path, layout, names, skip_bad_lines=options.skip_bad_lines)

    def samples(rows: CsvRows) -> RawSamples:
        found = table_samples(rows, columns)
        assert found.time is not None
        return replace(found, time=found.time + rows.columns["nanosec"] / 1e9)

    found = imu_of_table(path, layout, columns, options, samples, table)
    return replace(found, frame=fields[2] or "case", time_unit=StatedUnit("s", DEFINED))
