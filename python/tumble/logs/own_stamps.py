"""Triads with stamps of their own: in columns of one table, or in a file each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import Triad
from tumble.logs.columns import ImuColumns
from tumble.logs.interpolation import TimedReadings
from tumble.logs.options import ReadOptions
from tumble.logs.track import LoggedImu, RawSamples, Transform

INTERPOLATED = "accelerometer brought to the times of the gyroscope by straight lines, which lowers its noise"


class TimedTriad(Protocol):
    """Rows of one triad, with their times."""

    @property
    def path(self) -> Path:
        """Returns the file."""
        ...

    def rows(self) -> Iterator[FloatArray]:
        """Returns (n, 4): time and three axes."""
        ...


def with_own_stamps(
    opened: Callable[[ImuColumns], LoggedImu], columns: ImuColumns, options: ReadOptions
) -> LoggedImu:
    """Opens an IMU of a table, each of whose triads may have stamps of its own.

    Raises `LogError` where stamps of a row differ, and the options do not ask to interpolate.
    """
    found = opened(columns)
    if columns.by_gyroscope is None or columns.time is None or options.rate is not None:
        return found
    other = opened(columns.by_gyroscope)
    stamps = columns.time, columns.by_gyroscope.time
    units = [each.time_unit.name for each in (found, other) if each.time_unit is not None]
    if len(set(units)) > 1:
        raise LogError(
            f"{found.path}: {stamps[0]} is in {units[0]}, {stamps[1]} in {units[1]}; write the stamps "
            "of both triads in one unit"
        )

    def same(transform: Transform) -> Iterator[RawSamples]:
        row = 0
        pairs = zip(found.read(_as_read), other.read(_as_read), strict=True)
        for force, rate in pairs:
            apart = _apart(force, rate)
            if apart.any():
                at = int(np.argmax(apart))
                raise LogError(_differ(found, row + at, stamps, force, rate, at))
            row += len(force)
            yield transform(force)

    def interpolated(transform: Transform) -> Iterator[RawSamples]:
        triads = _TriadOf(found, "accelerometer"), _TriadOf(other, "gyroscope")
        for left, right in brought_together(*triads):
            yield transform(RawSamples(right[:, 0].copy(), left[:, 1:].copy(), right[:, 1:].copy()))

    def differ() -> bool:
        pairs = zip(found.read(_as_read), other.read(_as_read), strict=True)
        return any(_apart(force, rate).any() for force, rate in pairs)

    if not options.interpolate or not differ():
        return replace(found, read=same)
    return replace(
        other,
        read=interpolated,
        head=lambda: next(interpolated(_as_read)),
        notices=(*found.notices, INTERPOLATED),
    )


def _as_read(samples: RawSamples) -> RawSamples:
    return samples


def _apart(force: RawSamples, rate: RawSamples) -> NDArray[np.bool_]:
    assert force.time is not None
    assert rate.time is not None
    if len(force) != len(rate):
        raise LogError("stamps of both triads cannot be read in the same lines; repair those, and read again")
    apart: NDArray[np.bool_] = (force.time != rate.time) & ~(np.isnan(force.time) & np.isnan(rate.time))
    return apart


def _differ(
    found: LoggedImu, row: int, columns: tuple[str, str | None], force: RawSamples, rate: RawSamples, at: int
) -> str:
    assert force.time is not None
    assert rate.time is not None
    return (
        f"{found.path}: {found.locate(row)}: {columns[0]} is {force.time[at]:.15g} and {columns[1]} "
        f"{rate.time[at]:.15g}: bring the accelerometer to the stamps of the gyroscope with --interpolate"
    )


@dataclass(frozen=True, slots=True)
class _TriadOf:
    """One triad of an IMU in a table."""

    found: LoggedImu
    triad: Triad

    @property
    def path(self) -> Path:
        return self.found.path

    def rows(self) -> Iterator[FloatArray]:
        """Returns (n, 4): time and three axes, in the units of the file."""
        for samples in self.found.read(_as_read):
            assert samples.time is not None
            yield np.column_stack([samples.time, getattr(samples, self.triad)])


def brought_together(
    accelerometer: TimedTriad, gyroscope: TimedTriad
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Returns the accelerometer at the times of the gyroscope; both streams advance together."""
    known = TimedReadings((rows[:, 0], rows[:, 1:]) for rows in _forwards(accelerometer))
    found = False
    for rows in _forwards(gyroscope):
        known.read_to(float(rows[-1, 0]))
        inside = known.spans(rows[:, 0])
        if inside.any():
            found = True
            right = rows[inside]
            yield np.column_stack([right[:, 0], known.at(right[:, 0])]), right
        known.forget(float(rows[-1, 0]))
    if not found:
        raise LogError(
            f"{accelerometer.path}: has no time in common with {gyroscope.path.name}; "
            "give two files of one recording"
        )


def _forwards(triad: TimedTriad) -> Iterator[FloatArray]:
    """Returns the rows that have a time; raises `LogError` where it runs backwards."""
    last = -np.inf
    for rows in triad.rows():
        kept = rows[np.isfinite(rows[:, 0])]
        steps = np.diff(kept[:, 0], prepend=last)
        if (steps < 0.0).any():
            at = int(np.argmax(steps < 0.0))
            raise LogError(
                f"{triad.path}: time runs backwards to {kept[at, 0]:.15g}; "
                "sort the file by time, as --interpolate needs it"
            )
        if len(kept):
            last = float(kept[-1, 0])
            yield kept
