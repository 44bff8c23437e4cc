"""The layout of imu_tk: two text files, one a triad, columns `t x y z`, `*_acc.*` beside `*_gyro.*`."""

from __future__ import annotations

import re
from pathlib import Path

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import entries, is_file, is_folder
from tumble.foundation.files import note_input
from tumble.logs.options import ReadOptions
from tumble.logs.pair import TriadFile, imu_of_pair
from tumble.logs.text import find_layout
from tumble.logs.track import LoggedImu

_COLUMNS = ("1", "2", "3", "4")
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
    accelerometer, gyroscope = (TriadFile(file, find_layout(file, options), _COLUMNS) for file in pair)
    return imu_of_pair(path, "imu_tk", accelerometer, gyroscope, options)
