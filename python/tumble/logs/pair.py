"""Accelerometer and gyroscope in files of their own: read side by side, row by row."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of
from tumble.logs.csv import CsvRows, TextTable, expected_rows
from tumble.logs.options import ReadOptions
from tumble.logs.own_stamps import INTERPOLATED, brought_together
from tumble.logs.text import TextLayout
from tumble.logs.track import (
    LoggedImu,
    LoggedMagnetometer,
    RawMagnetic,
    RawSamples,
    StatedUnit,
    Transform,
    stack,
)

_WIDTH = 4
"""Time and three axes."""


def magnetometer_of_file(file: TriadFile, unit: StatedUnit) -> LoggedMagnetometer:
    """Creates the magnetometer of a file of its own, whose times are those of the files beside it."""

    def read() -> RawMagnetic:
        rows = np.concatenate([np.empty((0, _WIDTH)), *file.rows()])
        return RawMagnetic(rows[:, 0], rows[:, 1:])

    notice = f"magnetometer from {file.path.name}"
    return LoggedMagnetometer(read, unit, name=file.path.name, notices=(notice,))


@dataclass(frozen=True, slots=True)
class TriadFile:
    """A table of one triad."""

    path: Path
    layout: TextLayout
    columns: tuple[str, str, str, str]
    """Names of time, x, y, z."""

    @property
    def table(self) -> TextTable:
        """Its columns, to be read."""
        return TextTable(self.path, self.layout, self.columns)

    def rows(self) -> Iterator[FloatArray]:
        """Returns its rows, (n, 4): time and three axes, in the units of the file."""
        for samples in self.table.read(self._triad):
            assert samples.time is not None
            yield np.column_stack([samples.time, samples.accelerometer])

    def _triad(self, rows: CsvRows) -> RawSamples:
        time, x, y, z = self.columns
        return RawSamples(rows.columns[time], stack(rows.columns, (x, y, z)), np.empty((0, 3)))


def imu_of_pair(
    path: Path, log_format: str, accelerometer: TriadFile, gyroscope: TriadFile, options: ReadOptions
) -> LoggedImu:
    """Creates one IMU of two files; `path` is what the user named."""

    def pieces(transform: Transform) -> Iterator[RawSamples]:
        return read_pair(accelerometer, gyroscope, transform, interpolate=options.interpolate)

    def head() -> RawSamples:
        for samples in pieces(lambda samples: samples):
            return samples
        raise LogError(f"{gyroscope.path}: holds no samples")

    return LoggedImu(
        path=path,
        imu="",
        format=log_format,
        read=pieces,
        head=head,
        locate=lambda sample: f"line {gyroscope.table.line_of(sample)} of {gyroscope.path.name}",
        expected=expected_rows(gyroscope.path, gyroscope.layout),
        notices=(
            f"accelerometer from {accelerometer.path.name}, gyroscope from {gyroscope.path.name}",
            *((INTERPOLATED,) if options.interpolate else ()),
        ),
    )


def read_pair(
    accelerometer: TriadFile, gyroscope: TriadFile, transform: Transform, *, interpolate: bool
) -> Iterator[RawSamples]:
    """Joins the rows of both files.

    Those of equal time or, with `interpolate`, the accelerometer brought to the times of the
    gyroscope by straight lines, over the time in which both were recorded.

    Raises `LogError` where times differ without `interpolate`.
    """
    joined = brought_together(accelerometer, gyroscope) if interpolate else _equal(accelerometer, gyroscope)
    for left, right in joined:
        yield transform(RawSamples(right[:, 0].copy(), left[:, 1:].copy(), right[:, 1:].copy()))


def _equal(accelerometer: TriadFile, gyroscope: TriadFile) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Joins rows of equal time; blocks of the two files need not hold the same number of rows."""
    row = 0
    for left, right in _even(accelerometer, gyroscope):
        apart = left[:, 0] != right[:, 0]
        if apart.any():
            at = int(np.argmax(apart))
            line = accelerometer.table.line_of(row + at)
            raise LogError(
                f"{accelerometer.path}: line {line}: time {left[at, 0]:.15g} is {right[at, 0]:.15g} in "
                f"{gyroscope.path.name}; both files need the same times: bring the accelerometer to those "
                "of the gyroscope with --interpolate"
            )
        row += len(left)
        yield left, right


def _even(accelerometer: TriadFile, gyroscope: TriadFile) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Cuts two streams of rows into pieces of equal length."""
    none = np.empty((0, _WIDTH))
    left, right = none, none
    for new_left, new_right in zip_longest(accelerometer.rows(), gyroscope.rows(), fillvalue=none):
        left, right = np.vstack([left, new_left]), np.vstack([right, new_right])
        rows = min(len(left), len(right))
        if rows:
            yield left[:rows], right[:rows]
        left, right = left[rows:], right[rows:]
    if len(left) or len(right):
        shorter, longer = (gyroscope, accelerometer) if len(left) else (accelerometer, gyroscope)
        raise LogError(
            f"{shorter.path}: ends {count_of('row', len(left) + len(right))} before {longer.path.name}; "
            "copy it again, cut the longer file to the same rows, or bring both to the same times with "
            "--interpolate"
        )
