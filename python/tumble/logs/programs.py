"""Tables of text whose columns a program names in its own way: which are the channels, and in what unit."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tumble.foundation.errors import LogError
from tumble.foundation.file_status import is_file
from tumble.foundation.files import once_per_file
from tumble.foundation.numbers import number_of
from tumble.foundation.regular_files import open_regular
from tumble.logs.columns import ImuColumns, MagneticColumns
from tumble.logs.csv import CsvRows, imu_of_table, table_samples
from tumble.logs.options import ReadOptions
from tumble.logs.own_stamps import with_own_stamps
from tumble.logs.stated_units import unit_in
from tumble.logs.text import SoughtTable, TextLayout, find_layout
from tumble.logs.text_file import open_text
from tumble.logs.track import DOCUMENTED, LoggedImu, RawSamples, StatedUnit, choose, joint_unit
from tumble.logs.units import Quantity
from tumble.logs.unread_columns import listed

_HEADERS_BYTES = 1 << 16


@dataclass(frozen=True, slots=True)
class _Program:
    """Names of a program's columns, without the unit in brackets; of several the first that is there."""

    format: str
    accelerometer: tuple[tuple[str, str, str], ...]
    gyroscope: tuple[tuple[str, str, str], ...]
    time: tuple[str, ...]
    units: Mapping[Quantity, str]
    """Units where the name states none."""
    magnetometer: tuple[tuple[str, str, str], ...] = ()
    factor: Callable[[Path, TextLayout, ReadOptions, ImuColumns], float] = lambda *_: 1.0
    """Function that gives the factor of the accelerometer."""
    corrected: bool | None = None
    notices: tuple[str, ...] = ()
    gyroscope_time: tuple[str, ...] = ()
    """Stamps of each choice of the gyroscope."""
    rate: re.Pattern[bytes] | None = None
    """Finds, in the head of a file, the rate at which samples were counted; their time is the count."""


def _xyz(name: str) -> tuple[str, str, str]:
    return f"{name}X", f"{name}Y", f"{name}Z"


def _indexed(name: str) -> tuple[str, str, str]:
    return f"{name}[0]", f"{name}[1]", f"{name}[2]"


def _header(path: Path, layout: TextLayout, name: str) -> str:
    """Returns a header of a blackbox, before the columns or in a file beside; empty where there is none."""
    stated = layout.preamble.get(name.lower()) or layout.preamble.get(f'"{name.lower()}"', "")
    beside = path.with_suffix(".headers.csv")
    if not stated and is_file(beside):
        pattern = rb'(?m)^"?%b"?\s*,\s*"?([\w.+-]{1,24})' % re.escape(name.encode())
        match = re.search(pattern, _first_bytes(beside))
        stated = match[1].decode() if match else ""
    return stated.strip('"')


@once_per_file
def _first_bytes(path: Path) -> bytes:
    with open_regular(path) as file:
        return file.read(_HEADERS_BYTES)


def _refuse_scaled_rates(path: Path, layout: TextLayout, options: ReadOptions, columns: ImuColumns) -> None:
    """Raises `LogError` where headers state that raw rates are not in deg/s, and no option their scale.

    Betaflight logs them times ten at high resolution (blackbox.c, `blackboxHighResolutionScale`); firmware
    before it logs counts, of which `gyro_scale` is one.
    """
    if (
        columns.gyroscope is None
        or any(map(_unit_in, columns.gyroscope))
        or options.gyroscope_scale is not None
    ):
        return
    scale = _float_of(_header(path, layout, "gyro_scale"))
    fine = _header(path, layout, "blackbox_high_resolution")
    said = f"gyro_scale {scale:.4g}" if scale not in (None, 1.0) else ""
    said = "blackbox_high_resolution 1" if number_of(fine) == 1.0 else said
    if said:
        raise LogError(
            f"{path}: its header says {said}, so that raw rates are not in deg/s; decode the log with "
            "blackbox_decode --unit-rotation deg/s, or give the counts of a deg/s with --gyroscope-scale "
            "(10 at high resolution)"
        )


def _float_of(text: str) -> float | None:
    """Returns a number that stands in decimals, or as the bits of one in single precision: 0x3f800000."""
    if re.fullmatch(r"0x[0-9a-fA-F]{8}", text):
        (found,) = struct.unpack(">f", bytes.fromhex(text[2:]))
        return float(found)
    return number_of(text)


def _betaflight_factor(path: Path, layout: TextLayout, options: ReadOptions, columns: ImuColumns) -> float:
    """Divides counts of the accelerometer by `acc_1G`, which stands in the head or in a file beside."""
    assert columns.accelerometer is not None
    _refuse_scaled_rates(path, layout, options, columns)
    if any(map(_unit_in, columns.accelerometer)) or options.accelerometer_scale is not None:
        return 1.0
    counts = number_of(_header(path, layout, "acc_1G"))
    if not counts or counts <= 0.0:
        raise LogError(
            f"{path}: accSmooth is in counts, and acc_1G stands neither before the columns nor in "
            f"{path.with_suffix('.headers.csv').name}; "
            "decode the log with blackbox_decode --unit-acceleration g, or give acc_1G with "
            "--accelerometer-scale"
        )
    return 1.0 / counts


PROGRAMS = (
    _Program(
        # iOS reads -g upwards: developer.apple.com/documentation/coremotion/cmaccelerometerdata
        "sensorlog",
        (_xyz("accelerometerAcceleration"),),
        (_xyz("gyroRotation"), _xyz("motionRotationRate")),
        ("accelerometerTimestamp_sinceReboot", "motionTimestamp_sinceReboot", "loggingTime"),
        {"accelerometer": "g", "gyroscope": "rad/s", "time": "s", "magnetometer": "uT"},
        magnetometer=(_xyz("magnetometer"), _xyz("motionMagneticField")),
        factor=lambda *_: -1.0,
        gyroscope_time=("gyroTimestamp_sinceReboot", "motionTimestamp_sinceReboot"),
        notices=("sign of the accelerometer changed, as iOS reads -g upwards",),
    ),
    _Program(
        "physics_toolbox",
        (("gFx", "gFy", "gFz"),),
        (("wx", "wy", "wz"),),
        ("time",),
        {"accelerometer": "g", "gyroscope": "rad/s", "magnetometer": "uT"},
        magnetometer=(("Bx", "By", "Bz"),),
    ),
    _Program(
        # github.com/betaflight/blackbox-tools: raw rates are deg/s, raw accelerations counts, acc_1G a g.
        "betaflight",
        (_indexed("accSmooth"),),
        (_indexed("gyroUnfilt"), _indexed("gyroADC")),
        ("time",),
        {"accelerometer": "g", "gyroscope": "deg/s", "time": "us"},
        magnetometer=(_indexed("magADC"),),
        factor=_betaflight_factor,
        corrected=True,
        notices=("the firmware took off the bias of the gyroscope when it was armed, and filtered the rest",),
    ),
    _Program(
        # github.com/PLab-SI/PicoQuake, docs/acquisition_data.md; counts go on where samples were lost.
        "picoquake",
        (("a_x", "a_y", "a_z"),),
        (("g_x", "g_y", "g_z"),),
        ("count",),
        {"accelerometer": "g", "gyroscope": "deg/s", "time": "s"},
        rate=re.compile(rb"(?m)^# Config: (?:data|sample)_rate = ([\d.]{1,12}) Hz"),
    ),
)


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the one IMU of such a table, which needs no name."""
    return ("",)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Reads the table of the program whose names it has; raises `LogError` where some are missing."""
    choose(path, ("",), imu, "IMU")
    layout = find_layout(path, options, SoughtTable("log", "accSmooth[0], gFx", _is_known))
    names = {_stem(name): name for name in reversed(layout.names)}
    fitting = (each for each in PROGRAMS if any(name in names for name in each.accelerometer[0]))
    program = next(fitting, None)
    if program is None:
        raise LogError(
            f"{path}: names no column of an accelerometer once; columns found: {listed(layout.names)}"
        )
    columns = _columns(path, program, names, layout)
    factor = program.factor(path, layout, options, columns)
    rate = None if program.rate is None or options.rate is not None else _rate_in(path, program.rate)

    def opened(columns: ImuColumns) -> LoggedImu:
        def samples(rows: CsvRows) -> RawSamples:
            found = table_samples(rows, columns)
            if rate is not None and found.time is not None:
                found = replace(found, time=found.time / rate)
            return found if factor == 1.0 else replace(found, accelerometer=found.accelerometer * factor)

        return imu_of_table(path, layout, columns, options, samples)

    found = with_own_stamps(opened, columns, options)
    return replace(
        found,
        format=program.format,
        already_corrected=program.corrected,
        notices=(*found.notices, *program.notices, *([] if rate is None else [_counted(rate)])),
    )


def _rate_in(path: Path, pattern: re.Pattern[bytes]) -> float:
    with open_text(path) as file:
        match = pattern.search(file.read(_HEADERS_BYTES))
    rate = number_of(match[1].decode()) if match else None
    if rate is None or rate <= 0.0:
        raise LogError(
            f"{path}: states no rate of its samples before the columns; give it with --rate, in Hz"
        )
    return rate


def _counted(rate: float) -> str:
    return f"time is the count of samples at {rate:g} Hz, as stated before the columns"


def _is_known(name: str) -> bool:
    return any(_stem(name) in program.accelerometer[0] for program in PROGRAMS)


def _stem(name: str) -> str:
    return _parted(name)[0]


def _unit_in(name: str) -> str:
    return _parted(name)[1]


def _parted(name: str) -> tuple[str, str]:
    """Returns a name without the brackets behind it, and what stands in them."""
    stem, bracket, unit = name.rpartition("(")
    is_unit = bracket and unit.endswith(")") and ")" not in unit[:-1]
    return (stem.rstrip(), unit[:-1]) if is_unit else (name.rstrip(), "")


def _columns(path: Path, program: _Program, names: Mapping[str, str], layout: TextLayout) -> ImuColumns:
    def triad(choices: tuple[tuple[str, str, str], ...]) -> tuple[str, str, str] | None:
        for x, y, z in choices:
            if x in names and y in names and z in names:
                return names[x], names[y], names[z]
        return None

    def stated(name: str, quantity: Quantity) -> StatedUnit | None:
        return unit_in(_unit_in(name), quantity, name, is_certain=False)

    def unit(columns: Sequence[str], quantity: Quantity) -> StatedUnit | None:
        documented = StatedUnit(program.units[quantity], DOCUMENTED) if quantity in program.units else None
        return joint_unit(stated(name, quantity) for name in columns) or documented

    accelerometer, gyroscope = triad(program.accelerometer), triad(program.gyroscope)
    if accelerometer is None:
        raise LogError(
            f"{path}: lacks an axis of {program.accelerometer[0][0]}; columns found: {listed(layout.names)}; "
            "record all three"
        )
    field = triad(program.magnetometer)
    time = next((names[name] for name in program.time if name in names), None)
    of_rate = None
    if gyroscope is not None and program.gyroscope_time:
        choices = zip(program.gyroscope, program.gyroscope_time, strict=True)
        stamps = next(stamp for (x, _, _), stamp in choices if names.get(x) == gyroscope[0])
        of_rate = names.get(stamps)
    return ImuColumns(
        accelerometer,
        gyroscope,
        time,
        accelerometer_unit=unit(accelerometer, "accelerometer"),
        gyroscope_unit=unit(gyroscope or (), "gyroscope"),
        time_unit=unit([time] if time else (), "time"),
        magnetometer=None if field is None else MagneticColumns(field, unit(field, "magnetometer")),
        gyroscope_time=None if of_rate == time else of_rate,
        gyroscope_time_unit=unit([of_rate] if of_rate else (), "time"),
    )
