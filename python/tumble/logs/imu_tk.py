"""The layout of imu_tk: two text files, one a triad, columns `t x y z`, `*_acc.*` beside `*_gyro.*`.

OpenCamera Sensors and Gyroflow write time last: it is the column that increases, or the one that is stated.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import entries, is_file, is_folder
from tumble.foundation.files import note_input
from tumble.foundation.units import TRIADS, Triad, channels_of
from tumble.logs.options import ReadOptions
from tumble.logs.pair import TriadFile, imu_of_pair
from tumble.logs.text import find_layout, increases, numbers_delimiter, split_line
from tumble.logs.text_file import open_text
from tumble.logs.track import LoggedImu

_COLUMNS = ("1", "2", "3", "4")
_HEAD_BYTES = 1 << 16
_WORD = re.compile("[A-Za-z]+")
_PARTNERS = (("accelerometer", "gyroscope"), ("accel", "gyro"), ("acc", "gyro"), ("acc", "gyr"))


def find_pair(path: Path) -> tuple[Path, Path] | None:
    """Returns accelerometer and gyroscope file where `path` is one of a pair, or a folder with one."""
    if is_folder(path):
        pairs = {pair for file in entries(path) if is_file(file) and (pair := find_pair(file))}
        return pairs.pop() if len(pairs) == 1 else None
    for accelerometer, gyroscope in _PARTNERS:
        for here, there in ((accelerometer, gyroscope), (gyroscope, accelerometer)):
            partner = _with_word(path, here, there)
            if partner is not None and is_file(partner) and _has_four_columns(path, partner):
                return (path, partner) if here == accelerometer else (partner, path)
    return None


def _with_word(path: Path, here: str, there: str) -> Path | None:
    if here not in map(str.lower, _WORD.findall(path.name)):
        return None
    return path.with_name(_WORD.sub(lambda word: there if word[0].lower() == here else word[0], path.name))


def _has_four_columns(*paths: Path) -> bool:
    try:
        return all(find_layout(path, ReadOptions()).names == _COLUMNS for path in paths)
    except LogError:
        return False


def recognises(path: Path, head: bytes) -> bool:
    """Returns whether a file is one of a pair, or a folder holds one."""
    return find_pair(path) is not None


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the one IMU of a pair, which needs no name."""
    return ("",)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Reads both files side by side; `path` is what the user named: either of them, or their folder."""
    pair = find_pair(path)
    assert pair is not None
    for file in pair:
        note_input(file)
    accelerometer, gyroscope = (
        _triad_file(file, triad, options) for file, triad in zip(pair, TRIADS, strict=True)
    )
    return imu_of_pair(path, "imu_tk", accelerometer, gyroscope, options)


def _triad_file(path: Path, triad: Triad, options: ReadOptions) -> TriadFile:
    """Finds time and axes in one of the files; raises `LogError` where no column is time."""
    layout = find_layout(path, options)
    stated = options.columns
    other: Triad = "gyroscope" if triad == "accelerometer" else "accelerometer"
    axes = _stated_axes(path, stated, triad) or _stated_axes(path, stated, other)
    time = _stated_time(path, stated) or _increasing(path, axes)
    x, y, z = axes or [column for column in _COLUMNS if column != time]
    return TriadFile(path, layout, (time, x, y, z))


def _stated_axes(path: Path, stated: Mapping[str, str], triad: Triad) -> list[str] | None:
    """Returns the columns that the user states of a triad; None where none is stated."""
    found = [stated[channel] for channel in channels_of(triad) if channel in stated]
    if not found:
        return None
    if len(found) != len(channels_of(triad)) or not set(found) <= set(_COLUMNS):
        raise LogError(
            f"{path}: has four columns without names; give the positions of all three axes and of time, as "
            "--columns time=4,gx=1,gy=2,gz=3, which hold for both files"
        )
    return found


def _stated_time(path: Path, stated: Mapping[str, str]) -> str | None:
    time = stated.get("time")
    if time is not None and time not in _COLUMNS:
        raise LogError(f"{path}: no column {time!r} for time; it has the columns 1 to 4")
    return time


def _increasing(path: Path, axes: Sequence[str] | None) -> str:
    """Returns the one column that increases, of those that are no axis; the first where several do."""
    with open_text(path) as file:
        lines = file.read(_HEAD_BYTES).decode("utf-8", "replace").splitlines()[:-1]
    rows = [split_line(line, delimiter) for line in lines if (delimiter := numbers_delimiter(line))]
    for column in _COLUMNS:
        number = int(column) - 1
        if column not in (axes or ()) and increases([row[number] for row in rows if len(row) > number]):
            return column
    raise LogError(f"{path}: none of its four columns increases as time does; give it with --columns time=4")
