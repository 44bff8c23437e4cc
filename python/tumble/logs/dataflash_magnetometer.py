"""Compasses of logs of ArduPilot: messages MAG in milligauss, corrected, and how that is undone.

`MAG = D (s (raw + Ofs)) + MO`: offsets and motor compensation as each message states them, s of
`COMPASS_SCALE`, and the symmetric D of `COMPASS_DIA` and `COMPASS_ODI` (AP_Compass_Backend.cpp,
`correct_field`). Older firmware, which has no scale, gives `D (raw + Ofs + MO)`. All are in the axes of the
autopilot.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.logs.dataflash_file import BinaryLog, DataflashRecords, TextLog
from tumble.logs.flight import FlightMagnetometer, Times, at_times
from tumble.logs.track import RawMagnetic
from tumble.logs.walk import Damage, doubles

NAME = "MAG"
NAMES = (NAME, "MAG2", "MAG3")
BATTERIES = ("BAT", "CURR")
FIELD, OFFSET, MOTORS = ("MagX", "MagY", "MagZ"), ("OfsX", "OfsY", "OfsZ"), ("MOX", "MOY", "MOZ")
HEALTHY = "Health"
LARGEST_SCALE = 1.5
"""COMPASS_MAX_SCALE_FACTOR: a scale beyond it, or below its inverse, is not applied."""
SMALLEST_DETERMINANT = 1e-3
"""Matrices of a compass are near one; less is a garbled parameter."""


def by_instance(block: Mapping[str, DataflashRecords]) -> dict[int, DataflashRecords]:
    """Splits the messages of compasses: by field I, else, in older logs, by name, as MAG2."""
    found: dict[int, DataflashRecords] = {}
    for position, name in enumerate(NAMES):
        records = block.get(name)
        if records is None or not len(records) or not set(FIELD) <= set(records.dtype.names or ()):
            continue
        if "I" not in (records.dtype.names or ()):
            found[position] = records
            continue
        for instance in np.unique(records["I"]):
            found[int(instance)] = records[records["I"] == instance]
    return found


def time_of(records: DataflashRecords) -> FloatArray:
    """Returns (n,) s at which messages were logged."""
    for name, per_second in (("TimeUS", 1e6), ("TimeMS", 1e3)):
        if name in (records.dtype.names or ()):
            return doubles(records[name]) / per_second
    return np.full(len(records), np.nan)


def magnetometers_of(
    log: BinaryLog | TextLog,
    compasses: Mapping[int, Times],
    parameters: Mapping[str, float],
    remarks: tuple[str, ...],
) -> list[FlightMagnetometer]:
    """Returns the compasses of a log, the one of the highest priority first; raw."""
    return [
        FlightMagnetometer(
            f"mag_{instance}",
            "mG",
            partial(_read, log, instance, parameters),
            already_corrected=False,
            notices=(
                f"offsets, matrix and motor compensation of ArduPilot were taken off mag_{instance}"
                + ("" if _number(parameters, instance) else ", but for the matrix: it has no parameters"),
                *remarks,
            ),
        )
        for instance, times in sorted(compasses.items())
        if times.rate > 0.0
    ]


def _read(log: BinaryLog | TextLog, instance: int, parameters: Mapping[str, float]) -> RawMagnetic:
    """Reads all messages of a compass, in mG, with the current of the battery at their times."""
    times, fields = [np.empty(0)], [np.empty((0, 3))]
    powered, currents = [np.empty(0)], [np.empty(0)]
    number = _number(parameters, instance)
    for block in log.blocks([*NAMES, *BATTERIES], Damage()):
        records = by_instance(block).get(instance)
        if records is not None:
            times.append(time_of(records))
            fields.append(_undone(records, parameters, number))
        for name in BATTERIES:
            battery = _first_battery(block.get(name))
            if battery is not None:
                powered.append(time_of(battery))
                currents.append(doubles(battery["Curr"]))
    time = np.concatenate(times)
    return RawMagnetic(
        time, np.concatenate(fields), at_times(time, np.concatenate(powered), np.concatenate(currents))
    )


def _first_battery(records: DataflashRecords | None) -> DataflashRecords | None:
    if records is None or "Curr" not in (records.dtype.names or ()):
        return None
    for name in ("Inst", "I"):
        if name in (records.dtype.names or ()):
            first: DataflashRecords = records[records[name] == 0]
            return first
    return records


def _undone(records: DataflashRecords, parameters: Mapping[str, float], number: int | None) -> FloatArray:
    """Returns raw readings, (n, 3) mG; NaN where ArduPilot held the compass for faulty."""
    field, offset, motors = (_columns(records, names) for names in (FIELD, OFFSET, MOTORS))
    matrix, scale = _matrix(parameters, number), _scale(parameters, number)
    if scale is None:
        raw = field @ np.linalg.inv(matrix).T - motors - offset
    else:
        raw = (field - motors) @ np.linalg.inv(matrix).T / scale - offset
    raw = np.asarray(raw, np.float64)
    if HEALTHY in (records.dtype.names or ()):
        raw[records[HEALTHY] == 0] = np.nan
    return raw


def _columns(records: DataflashRecords, names: tuple[str, str, str]) -> FloatArray:
    if not set(names) <= set(records.dtype.names or ()):
        return np.zeros((len(records), 3))
    return np.stack([doubles(records[name]) for name in names], axis=-1)


def _number(parameters: Mapping[str, float], instance: int) -> int | None:
    """Returns the number under which parameters have a compass, from 1; None where they do not.

    Since 4.1 the instance is a place in the order of priority, whose parameter holds the id of the device.
    """
    wanted = parameters.get(f"COMPASS_PRIO{instance + 1}_ID")
    if wanted:
        for number in range(1, len(NAMES) + 1):
            if parameters.get(f"COMPASS_DEV_ID{_suffix(number)}") == wanted:
                return number
    return instance + 1 if f"COMPASS_OFS{_suffix(instance + 1)}_X" in parameters else None


def _suffix(number: int) -> str:
    return "" if number == 1 else str(number)


def _matrix(parameters: Mapping[str, float], number: int | None) -> FloatArray:
    """Returns D, (3, 3); one where there is none, or none that makes sense."""
    if number is None:
        return np.eye(3)
    x, y, z = (parameters.get(f"COMPASS_DIA{_suffix(number)}_{axis}", 0.0) for axis in "XYZ")
    xy, xz, yz = (parameters.get(f"COMPASS_ODI{_suffix(number)}_{axis}", 0.0) for axis in "XYZ")
    matrix = np.array([[x, xy, xz], [xy, y, yz], [xz, yz, z]])
    sound = np.isfinite(matrix).all() and abs(float(np.linalg.det(matrix))) > SMALLEST_DETERMINANT
    return matrix if sound else np.eye(3)


def _scale(parameters: Mapping[str, float], number: int | None) -> float | None:
    """Returns the factor of the field; one where ArduPilot ignores it, None of firmware that has none."""
    scale = parameters.get(f"COMPASS_SCALE{_suffix(number or 1)}")
    if scale is None:
        return None
    return scale if 1.0 / LARGEST_SCALE <= scale <= LARGEST_SCALE else 1.0
