"""Files that MetaBase writes of MetaWear sensors: one a sensor, `..._Accelerometer_12.500Hz_1.4.4.csv`.

Columns are `epoch (ms)` (older: `epoc (ms)`), a date, `elapsed (s)` since the first sample of the file, and
`x-axis (g)` or `x-axis (deg/s)`. Source: github.com/mbientlab, MetaWear-MetaBase-iOS-macOS-App.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import entries, is_file, is_folder
from tumble.foundation.files import note_input
from tumble.foundation.units import TRIADS, Triad
from tumble.foundation.words import join
from tumble.logs.columns import ImuColumns, MagneticColumns
from tumble.logs.csv import imu_of_table
from tumble.logs.options import ReadOptions
from tumble.logs.pair import TriadFile, imu_of_pair, magnetometer_of_file
from tumble.logs.text import SoughtTable, TextLayout, find_layout
from tumble.logs.track import COLUMN_NAME, LoggedImu, LoggedMagnetometer, StatedUnit, choose
from tumble.logs.unread_columns import listed

_FILE = re.compile(
    r"(?P<start>.*_)(?P<sensor>Accelerometer|Gyroscope|Magnetometer)(?P<end>_[\d.]+Hz_.*\.csv.*)"
)
_SENSORS = ("Accelerometer", "Gyroscope")
_G, _DEGREES, _MILLISECONDS = (StatedUnit(unit, COLUMN_NAME) for unit in ("g", "deg/s", "ms"))
_UNITS: dict[str, Triad] = {"g": "accelerometer", "deg/s": "gyroscope"}
_TIME = re.compile(r"epoch? \(ms\)")
_AXIS = re.compile(r"[xyz]-axis \((?P<unit>g|deg/s|T)\)")
_MAGNETOMETER = "Magnetometer"
_TESLA = "T"


def recognises(path: Path, head: bytes) -> bool:
    """Returns whether a file is of MetaBase, by its first bytes, or a folder holds one pair."""
    return is_file(path) or _pair_of(path) is not None


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the one IMU of a sensor, which needs no name."""
    return ("",)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Reads the files of accelerometer and gyroscope side by side, or the one that is there.

    Raises `LogError` where columns are missing or several files may belong to the one that is named.
    """
    choose(path, ("",), imu, "IMU")
    pair = _pair_of(path)
    return _alone(path, options) if pair is None else _both(path, pair, options)


def _pair_of(path: Path) -> tuple[Path, Path] | None:
    """Returns the files of accelerometer and gyroscope; None where one of them is alone, or not named so."""
    named = _FILE.fullmatch(path.name)
    if not is_folder(path) and named is None:
        return None
    folder = path if is_folder(path) else path.parent
    found: dict[str, list[Path]] = {sensor: [] for sensor in _SENSORS}
    for file in entries(folder):
        match = _FILE.fullmatch(file.name)
        if (
            match
            and match["sensor"] in found
            and is_file(file)
            and (named is None or match["start"] == named["start"])
        ):
            found[match["sensor"]].append(file)
    if named is not None and named["sensor"] == _MAGNETOMETER:
        return None
    if named is not None and is_file(path):
        # The named file counts where a sensor has two, such as a copy.
        found[named["sensor"]] = [path]
    if any(len(files) != 1 for files in found.values()):
        return None
    (accelerometer,), (gyroscope,) = found.values()
    return accelerometer, gyroscope


def _both(path: Path, pair: tuple[Path, Path], options: ReadOptions) -> LoggedImu:
    accelerometer, gyroscope = (
        _triad(file, triad, options) for file, triad in zip(pair, TRIADS, strict=True)
    )
    found = imu_of_pair(path, "metawear", accelerometer, gyroscope, options)
    return replace(
        found,
        accelerometer_unit=_G,
        gyroscope_unit=_DEGREES,
        time_unit=_MILLISECONDS,
        magnetometer=_magnetometer(pair[0], options),
    )


def _magnetometer(accelerometer: Path, options: ReadOptions) -> LoggedMagnetometer | None:
    """Finds the file of the magnetometer beside that of the accelerometer; None where there is not one."""
    named = _FILE.fullmatch(accelerometer.name)
    assert named is not None
    files = [
        file
        for file in entries(accelerometer.parent)
        if (match := _FILE.fullmatch(file.name))
        and (match["start"], match["sensor"]) == (named["start"], _MAGNETOMETER)
    ]
    if len(files) != 1:
        return None
    note_input(files[0])
    layout = _layout(files[0], options)
    time, axes, unit = _columns(files[0], layout)
    if unit != _TESLA:
        raise LogError(f"{files[0]}: its name says magnetometer, its columns {unit}; export it again")
    return magnetometer_of_file(TriadFile(files[0], layout, (time, *axes)), StatedUnit("T", COLUMN_NAME))


def _triad(file: Path, triad: Triad, options: ReadOptions) -> TriadFile:
    note_input(file)
    layout = _layout(file, options)
    time, axes, unit = _columns(file, layout)
    found = _UNITS.get(unit, "magnetometer")
    if found != triad:
        raise LogError(f"{file}: its name says {triad}, its columns {found}; export it again")
    return TriadFile(file, layout, (time, *axes))


def _alone(path: Path, options: ReadOptions) -> LoggedImu:
    layout = _layout(path, options)
    time, axes, unit = _columns(path, layout)
    triad = _UNITS.get(unit)
    if triad is None and options.need_imu:
        raise LogError(f"{path}: holds a magnetometer alone; tumble magnetometer reads it")
    columns = ImuColumns(
        axes if triad == "accelerometer" else None,
        axes if triad == "gyroscope" else None,
        time,
        accelerometer_unit=_G,
        gyroscope_unit=_DEGREES,
        time_unit=_MILLISECONDS,
        magnetometer=None if triad else MagneticColumns(axes, StatedUnit("T", COLUMN_NAME)),
    )
    return replace(imu_of_table(path, layout, columns, options), format="metawear")


def _layout(file: Path, options: ReadOptions) -> TextLayout:
    sought = SoughtTable(
        "log of MetaWear", "epoch (ms), x-axis (g)", lambda name: bool(_AXIS.fullmatch(name))
    )
    return find_layout(file, options, sought)


def _columns(file: Path, layout: TextLayout) -> tuple[str, tuple[str, str, str], str]:
    """Returns the columns of time and of the axes, and their unit."""
    time = next((name for name in layout.names if _TIME.fullmatch(name)), None)
    unit = next((match["unit"] for name in layout.names if (match := _AXIS.fullmatch(name))), "g")
    x, y, z = wanted = tuple(f"{axis}-axis ({unit})" for axis in "xyz")
    missing = [name for name in wanted if name not in layout.names]
    if time is None or missing:
        lacks = join(missing or ["epoch (ms)"])
        raise LogError(
            f"{file}: has no column {lacks}; columns found: {listed(layout.names)}; export it again"
        )
    return time, (x, y, z), unit
