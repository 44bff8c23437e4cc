"""The layout of imu_tk: two text files, one a triad, columns `t x y z`, `*_acc.*` beside `*_gyro.*`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import zip_longest
from pathlib import Path

import numpy as np

from tumble.errors import LogError
from tumble.files import note_input
from tumble.logs.csv import TextTable
from tumble.logs.options import ReadOptions
from tumble.logs.text import find_layout
from tumble.logs.track import LoggedImu, RawSamples, Transform, stack
from tumble.recording import FloatArray
from tumble.words import count_of

_COLUMNS = ("1", "2", "3", "4")
_PARTNERS = (("accelerometer", "gyroscope"), ("accel", "gyro"), ("acc", "gyro"), ("acc", "gyr"))


def find_pair(path: Path) -> tuple[Path, Path] | None:
    """Give accelerometer and gyroscope file where `path` is one of a pair, or a folder with one."""
    if path.is_dir():
        pairs = {pair for file in sorted(path.iterdir()) if file.is_file() and (pair := find_pair(file))}
        return pairs.pop() if len(pairs) == 1 else None
    for accelerometer, gyroscope in _PARTNERS:
        for here, there in ((accelerometer, gyroscope), (gyroscope, accelerometer)):
            partner = _with_word(path, here, there)
            if partner is not None and partner.is_file() and _has_four_columns(path, partner):
                return (path, partner) if here == accelerometer else (partner, path)
    return None


def _with_word(path: Path, here: str, there: str) -> Path | None:
    name, count = re.subn(f"(?<![A-Za-z]){here}(?![A-Za-z])", there, path.name, flags=re.IGNORECASE)
    return path.with_name(name) if count else None


def _has_four_columns(*paths: Path) -> bool:
    try:
        return all(find_layout(path, ReadOptions()).names == _COLUMNS for path in paths)
    except LogError:
        return False


def open_logged_imu(pair: tuple[Path, Path], source: Path, options: ReadOptions) -> LoggedImu:
    """Read both files side by side; `source` is what the user named."""
    for path in pair:
        note_input(path)
    tables = tuple(TextTable(path, find_layout(path, options), _COLUMNS) for path in pair)
    accelerometer, gyroscope = tables
    return LoggedImu(
        path=source,
        imu="",
        format="imu_tk",
        read=lambda transform: _read(pair, accelerometer, gyroscope, transform),
        head=lambda: next(_read(pair, accelerometer, gyroscope, lambda samples: samples)),
        locate=lambda sample: f"line {accelerometer.line_of(sample)} of {pair[0].name}",
        expected=int(pair[0].stat().st_size / find_layout(pair[0], options).row_bytes),
        notices=(f"accelerometer from {pair[0].name}, gyroscope from {pair[1].name}",),
    )


def _read(
    pair: tuple[Path, Path], accelerometer: TextTable, gyroscope: TextTable, transform: Transform
) -> Iterator[RawSamples]:
    """Join rows of equal time; blocks of the two files need not hold the same number of rows."""
    row = 0
    for left, right in _even(_rows(accelerometer), _rows(gyroscope), pair):
        apart = left[:, 0] != right[:, 0]
        if apart.any():
            at = int(np.argmax(apart))
            line = accelerometer.line_of(row + at)
            raise LogError(
                f"{pair[0]}: line {line}: time {left[at, 0]:.9g} is {right[at, 0]:.9g} "
                f"in {pair[1].name}; both files need the same times: resample one and write a table instead"
            )
        row += len(left)
        yield transform(RawSamples(left[:, 0].copy(), left[:, 1:].copy(), right[:, 1:].copy()))


def _even(
    left_pieces: Iterator[FloatArray], right_pieces: Iterator[FloatArray], pair: tuple[Path, Path]
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Cut two streams of rows into pieces of equal length."""
    none = np.empty((0, len(_COLUMNS)))
    left, right = none, none
    for new_left, new_right in zip_longest(left_pieces, right_pieces, fillvalue=none):
        left, right = np.vstack([left, new_left]), np.vstack([right, new_right])
        rows = min(len(left), len(right))
        if rows:
            yield left[:rows], right[:rows]
        left, right = left[rows:], right[rows:]
    if len(left) or len(right):
        shorter, longer = (pair[1], pair[0]) if len(left) else (pair[0], pair[1])
        raise LogError(
            f"{shorter}: ends {count_of('row', len(left) + len(right))} before {longer.name}; "
            "copy it again, or cut the longer file to the same rows"
        )


def _rows(table: TextTable) -> Iterator[FloatArray]:
    """Rows of one file, (n, 4): time and three axes."""
    for samples in table.read(lambda rows: _triad(rows.columns)):
        assert samples.time is not None
        yield np.column_stack([samples.time, samples.accelerometer])


def _triad(columns: Mapping[str, FloatArray]) -> RawSamples:
    return RawSamples(columns["1"], stack(columns, ("2", "3", "4")), np.empty((0, 3)))
