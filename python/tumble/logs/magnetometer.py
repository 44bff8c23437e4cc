"""The magnetometer of a log: its readings in microtesla and the case frame, and remarks on them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.errors import LogError
from tumble.foundation.magnetic import MICROTESLA, MagneticTrack
from tumble.foundation.recording import ASSUMED, FloatArray
from tumble.foundation.units import FIELD_UNITS
from tumble.foundation.words import count_of
from tumble.logs.columns import ImuColumns, MagneticColumns
from tumble.logs.conversion import case_from_log, counts_per_axis, stated_unit
from tumble.logs.options import ReadOptions
from tumble.logs.repeated_readings import firsts_of_runs
from tumble.logs.set_clock import SetClock
from tumble.logs.track import (
    CHUNK_SAMPLES,
    DEFINED,
    LoggedImu,
    LoggedMagnetometer,
    RawMagnetic,
    RawSamples,
    StatedUnit,
    Transform,
    stack,
)
from tumble.logs.units import UNITS

RowNumbers: TypeAlias = NDArray[np.intp]

EARTH = (15.0, 100.0)
"""uT: the field of the Earth is 22 to 67 uT, and iron beside a sensor adds to it or takes from it."""
LARGEST_FIELD = 1e5
"""uT, beyond the range of any magnetometer of a compass."""
_COUNTED = "holds no time: its readings are counted, one a second"


def magnetometer_in(
    columns: ImuColumns, whole: Callable[[Sequence[str]], Mapping[str, FloatArray]]
) -> LoggedMagnetometer | None:
    """Finds the magnetometer in the columns of a table; `whole` reads some columns, all of them at once."""
    found = columns.magnetometer
    if found is None:
        return None

    def read() -> RawMagnetic:
        return raw_magnetic(whole(columns.magnetic_names), found, columns.time)

    return LoggedMagnetometer(
        read,
        unit=found.unit,
        time_unit=found.time_unit,
        name=found.name,
        row_wise=found.time is None,
        current_unit=found.current_unit,
        notices=found.notices,
    )


def raw_magnetic(table: Mapping[str, FloatArray], columns: MagneticColumns, time: str | None) -> RawMagnetic:
    """Gathers the columns of a magnetometer; `time` is that of the IMU, for one without times of its own."""
    own = columns.time or time
    return RawMagnetic(
        None if own is None else table[own],
        stack(table, columns.axes),
        None if columns.current is None else table[columns.current],
    )


def without_imu(track: LoggedImu) -> LoggedImu:
    """Returns a log that holds a magnetometer alone: its head has the times of that, and no sample follows.

    Raises `LogError` where it holds neither.
    """
    magnetometer = track.magnetometer
    assert magnetometer is not None

    def head() -> RawSamples:
        raw = magnetometer.read()
        unknown = np.full((min(len(raw.field), CHUNK_SAMPLES), 3), np.nan)
        if not len(unknown):
            raise LogError(f"{track.source}: holds no readings of its magnetometer")
        return RawSamples(None if raw.time is None else raw.time[:CHUNK_SAMPLES], unknown, unknown)

    def read(transform: Transform) -> Iterator[RawSamples]:
        return iter(())

    return replace(track, head=head, read=read, time_unit=magnetometer.time_unit or track.time_unit)


def magnetic_track(
    source: str,
    magnetometer: LoggedMagnetometer,
    options: ReadOptions,
    rate: float | None,
    time_scale: float,
) -> MagneticTrack:
    """Reads a magnetometer: times in s, the field in uT along the case axes.

    `rate`, Hz, is that of rows without time; `time_scale` is s in one unit of the time of the IMU. Readings
    that are no numbers, all zero or impossible, and repetitions of a slower sensor are left out.

    Raises `LogError` where the unit that an option names is none of the magnetic field.
    """
    raw = magnetometer.read()
    unit, scale = field_scale(source, magnetometer.unit, options)
    remarks = [*magnetometer.notices]
    time = _times(source, raw, magnetometer, options, rate, time_scale, remarks)
    field = (raw.field * scale) @ case_from_log(options.axes).T
    kept = _sound(time, raw.field, field, remarks)
    if magnetometer.row_wise:
        kept = _of_its_own(time, raw.field, kept, remarks)
    kept = kept[np.argsort(time[kept], kind="stable")]
    kept = kept[np.diff(time[kept], prepend=-np.inf) > 0.0]
    track = MagneticTrack(
        SetClock().follow(time[kept])[0] if len(kept) else time[kept],
        field[kept],
        _known(raw.current, kept),
        magnetometer.current_unit,
        magnetometer.name,
        unit.name,
        unit.reason,
        magnetometer.already_corrected,
    )
    return replace(track, remarks=(*remarks, *_unlikely(track, options)))


def _known(current: FloatArray | None, kept: RowNumbers) -> FloatArray | None:
    """Returns the current at some rows; None where no row has one."""
    return None if current is None or not np.isfinite(current).any() else current[kept]


def field_scale(source: str, found: StatedUnit | None, options: ReadOptions) -> tuple[StatedUnit, FloatArray]:
    """Returns the unit of a log or stream, and the uT of one of it for each of (3,) axes.

    `found` is what the log states. Raises `LogError` where an option names no unit of the magnetic field, or
    columns of the log state several.
    """
    stated = stated_unit(source, "magnetometer", found, options.magnetometer_unit, options.magnetometer_scale)
    unit = stated or StatedUnit(MICROTESLA, ASSUMED)
    scale = np.full(3, UNITS["magnetometer"][unit.name])
    if options.magnetometer_scale is None:
        return unit, scale
    counts = counts_per_axis(options.magnetometer_scale, "--magnetometer-scale")
    return StatedUnit(unit.name, "option: counts per unit"), scale / counts


def _times(
    source: str,
    raw: RawMagnetic,
    magnetometer: LoggedMagnetometer,
    options: ReadOptions,
    rate: float | None,
    time_scale: float,
    remarks: list[str],
) -> FloatArray:
    """Returns (m,) s; rows without time are counted."""
    if raw.time is None or (options.rate is not None and magnetometer.row_wise):
        if rate is None:
            remarks.append(_COUNTED)
        return np.arange(len(raw.field)) / (rate or 1.0)
    own = magnetometer.time_unit
    if own is not None and own.unknown:
        own = stated_unit(source, "time", own, options.time_unit)
    scale = UNITS["time"][own.name] if own else time_scale
    # Division by 1e9 rounds once where multiplication by 1e-9 would round twice.
    return raw.time / round(1.0 / scale) if scale != 1.0 else raw.time


def _sound(time: FloatArray, read: FloatArray, field: FloatArray, remarks: list[str]) -> RowNumbers:
    """Returns the rows that hold a reading; rows without any number hold none, and are no omission."""
    there = np.isfinite(read).any(axis=1) & np.isfinite(time)
    whole = there & np.isfinite(read).all(axis=1)
    zero = whole & ~read.any(axis=1)
    with np.errstate(invalid="ignore"):
        large = whole & ~(np.abs(field) < LARGEST_FIELD).all(axis=1)
    for mask, what in (
        (there & ~whole, "without all three numbers"),
        (zero, "of zero on all axes, as before a magnetometer is ready,"),
        (large, f"of more than {LARGEST_FIELD / 1e6:g} T"),
    ):
        if count := int(mask.sum()):
            remarks.append(f"magnetometer: {count_of('reading', count)} {what} left out")
    return np.flatnonzero(whole & ~zero & ~large)


def _of_its_own(
    time: FloatArray,
    read: FloatArray,
    kept: RowNumbers,
    remarks: list[str],
) -> RowNumbers:
    """Keeps the first of each run of equal rows, where a slower magnetometer made them."""
    firsts = firsts_of_runs(read[kept])
    if firsts is None:
        return kept
    own = kept[firsts]
    span = float(time[own[-1]] - time[own[0]])
    rate = f", about {(len(own) - 1) / span:.3g} Hz," if span > 0.0 else ""
    remarks.append(
        f"magnetometer is slower{rate} than the {len(kept)} rows that hold it: "
        f"the first row of each of {len(own)} readings is kept"
    )
    return own


def _unlikely(track: MagneticTrack, options: ReadOptions) -> tuple[str, ...]:
    """Reports a field that is none of the Earth, and the unit in which it would be one."""
    strength = track.strength
    if not len(track) or EARTH[0] <= strength <= EARTH[1]:
        return ()
    fitting = [
        name
        for name, scale in FIELD_UNITS.items()
        if EARTH[0] <= strength / FIELD_UNITS[track.unit] * scale <= EARTH[1]
    ]
    doubtful = not track.unit_reason.startswith(DEFINED)
    remedy = (
        f"it would be in {' or '.join(fitting)}; state it with --magnetometer-unit"
        if fitting and doubtful and options.magnetometer_scale is None
        else "for raw counts give --magnetometer-scale (counts per unit), else look for iron or a magnet"
        if doubtful
        else "look for iron or a magnet beside it"
    )
    return (
        f"magnetometer reads {strength:.4g} uT in the median, with its readings in {track.unit} "
        f"({track.unit_reason}), where the field of the Earth is 22 to 67 uT: {remedy}",
    )
