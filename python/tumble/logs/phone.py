"""Folders of phone apps that write a file a sensor: Sensor Logger and phyphox.

Source: github.com/tszheichoi/awesome-sensor-logger, phyphox.org/wiki (exports of raw data).
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import is_file, is_folder
from tumble.foundation.files import note_input
from tumble.logs.options import ReadOptions
from tumble.logs.pair import TriadFile, imu_of_pair, magnetometer_of_file
from tumble.logs.stated_units import unit_in
from tumble.logs.text import SoughtTable, TextLayout, find_layout, split_line
from tumble.logs.text_file import open_text
from tumble.logs.track import (
    DOCUMENTED,
    LoggedImu,
    LoggedMagnetometer,
    RawSamples,
    StatedUnit,
    choose,
    joint_unit,
)
from tumble.logs.units import Quantity

_PAIRS = (
    ("TotalAcceleration.csv", "Gyroscope.csv"),
    ("AccelerometerUncalibrated.csv", "GyroscopeUncalibrated.csv"),
    ("AccelerometerUncalibrated.csv", "Gyroscope.csv"),
    ("Accelerometer.csv", "Gyroscope.csv"),
)
"""The surest first: Accelerometer.csv of Sensor Logger is without gravity, that of phyphox is not."""
_MAGNETOMETERS = ("MagnetometerUncalibrated.csv", "Magnetometer.csv")
"""Raw before corrected by the phone."""
_AXIS = re.compile(
    r"(?i)(?:(?:magnetic[ _]field|magnetometer|accel(?:eration|erometer)?|gyro(?:scope)?)[\s_]*)?"
    r"(?P<axis>[xyz])(?:\s*\((?P<unit>.*)\))?"
)
_TIME = re.compile(r"(?i)time(?:\s*\((?P<unit>.*)\))?")
_METADATA = "Metadata.csv"
"""Facts that Sensor Logger states of a recording: a line of names, and a line of values."""
_METADATA_BYTES = 1 << 14
_NEAR_G = 3.0
"""Factor about 1 within which the middle of lengths in g lies: in m/s^2 it is near 9.8."""
_WITHOUT_GRAVITY = "seconds_elapsed"
"""A column of Sensor Logger."""


def find_files(path: Path) -> tuple[Path, Path] | None:
    """Returns accelerometer and gyroscope file of a folder, or of that in which a file is."""
    folder = path if is_folder(path) else path.parent
    for accelerometer, gyroscope in _PAIRS:
        pair = folder / accelerometer, folder / gyroscope
        if all(is_file(file) for file in pair) and (path == folder or path in pair):
            return pair
    return None


def recognises(path: Path, head: bytes) -> bool:
    """Returns whether a folder, or that in which a file is, holds a file a sensor."""
    return find_files(path) is not None


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the one IMU of a phone, which needs no name."""
    return ("",)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Reads both files side by side; their times differ, as a rule, so that `--interpolate` is needed."""
    choose(path, ("",), imu, "IMU")
    pair = find_files(path)
    assert pair is not None
    for file in pair:
        note_input(file)
    accelerometer, gyroscope = (_triad(file, options) for file in pair)
    if pair[0].name == _PAIRS[-1][0] and _WITHOUT_GRAVITY in accelerometer.layout.names:
        raise LogError(
            f"{pair[0]}: gravity was removed; switch on Total Acceleration in Sensor Logger, and record again"
        )
    found = imu_of_pair(path, "phone", accelerometer, gyroscope, options)
    unit = _stated(accelerometer, "accelerometer")
    folder = pair[0].parent
    is_bare = _WITHOUT_GRAVITY in accelerometer.layout.names and not is_file(folder / _METADATA)
    shows = unit is None and is_bare and _reads_g(found)
    if shows or _is_raw_of_ios(folder):
        found = _with_sign_changed(found, "readings in g" if shows else _METADATA)
        unit = unit or StatedUnit("g", DOCUMENTED)
    return replace(
        found,
        accelerometer_unit=unit,
        gyroscope_unit=_stated(gyroscope, "gyroscope") or StatedUnit("rad/s", DOCUMENTED),
        time_unit=_stated(gyroscope, "time"),
        magnetometer=_magnetometer(pair[1].parent, options),
    )


def _is_raw_of_ios(folder: Path) -> bool:
    """Returns whether Sensor Logger states that it wrote readings as iOS gives them: "Standardise" was off.

    They are in g, and gravity with its sign: UNITS.md and COORDINATES.md of awesome-sensor-logger.
    """
    file = folder / _METADATA
    if not is_file(file):
        return False
    note_input(file)
    with open_text(file) as stream:
        lines = stream.read(_METADATA_BYTES).decode("utf-8", "replace").splitlines()
    names, values = ([field.lower() for field in split_line(line, ",")] for line in (*lines, "", "")[:2])
    stated = dict(zip(names, values, strict=False))
    return stated.get("platform") == "ios" and stated.get("standardisation") == "false"


def _reads_g(found: LoggedImu) -> bool:
    """Returns whether lengths are about 1: Android, and iOS with "Standardise" on, are in m/s^2."""
    lengths = np.linalg.norm(found.head().accelerometer, axis=1)
    known = lengths[np.isfinite(lengths)]
    return len(known) > 0 and 1.0 / _NEAR_G < float(np.median(known)) < _NEAR_G


def _with_sign_changed(found: LoggedImu, shown_by: str) -> LoggedImu:
    def changed(samples: RawSamples) -> RawSamples:
        return replace(samples, accelerometer=-samples.accelerometer)

    return replace(
        found,
        read=lambda transform: found.read(lambda samples: transform(changed(samples))),
        head=lambda: changed(found.head()),
        notices=(*found.notices, f"sign of the accelerometer changed, as iOS reads -g upwards ({shown_by})"),
    )


def _magnetometer(folder: Path, options: ReadOptions) -> LoggedMagnetometer | None:
    """Finds the file of the magnetometer beside those of the IMU; phones state microtesla."""
    file = next((folder / name for name in _MAGNETOMETERS if is_file(folder / name)), None)
    if file is None:
        return None
    note_input(file)
    triad = _triad(file, options)
    unit = _stated(triad, "magnetometer") or StatedUnit("uT", DOCUMENTED)
    return replace(magnetometer_of_file(triad, unit), already_corrected=file.name == _MAGNETOMETERS[1])


def _stated(file: TriadFile, quantity: Quantity) -> StatedUnit | None:
    """Returns the unit that stands in the names of columns."""
    time, *axes = file.columns
    of_time = quantity == "time"
    matches = ((_TIME if of_time else _AXIS).fullmatch(name) for name in ([time] if of_time else axes))
    return joint_unit(
        unit_in(match["unit"] or "", quantity, match[0], is_certain=False) for match in matches if match
    )


def _triad(file: Path, options: ReadOptions) -> TriadFile:
    layout = find_layout(file, options, SoughtTable("log", "time, x, y, z", _is_known))
    return TriadFile(file, layout, _columns(file, layout))


def _is_known(name: str) -> bool:
    return _AXIS.fullmatch(name) is not None


def _columns(file: Path, layout: TextLayout) -> tuple[str, str, str, str]:
    axes = {match["axis"].lower(): name for name in layout.names if (match := _AXIS.fullmatch(name))}
    time = next((name for name in layout.names if _TIME.fullmatch(name)), None)
    if time is None or len(axes) < 3:
        raise LogError(f"{file}: names no columns time, x, y, z; export it again")
    return time, axes["x"], axes["y"], axes["z"]
