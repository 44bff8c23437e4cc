"""Which column of a table is which channel of which IMU."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from tumble.foundation.errors import LogError
from tumble.foundation.magnetic import MAGNETIC_CHANNELS, LoadUnit
from tumble.foundation.numbers import whole_number
from tumble.foundation.units import CHANNELS, TRIADS, Channel, Triad, channels_of, triad_of
from tumble.logs.options import ReadOptions
from tumble.logs.stated_units import unit_in, unknown_unit
from tumble.logs.track import COLUMN_NAME, StatedUnit, choose, joint_unit
from tumble.logs.units import SPELLINGS, Quantity, find_unit
from tumble.logs.unread_columns import columns_option, listed, option_for, triple_in

UNIT_NAMES = ("imu", "imu_id", "unit", "unit_id", "sensor", "sensor_id", "id")
"""Columns, in lower case, that name the IMU of a row, the surest first."""
COLUMN_KEYS = ("time", *CHANNELS, *MAGNETIC_CHANNELS, "temperature", "current", "throttle")
"""Columns that a user can name."""

_ACCELEROMETER = (
    "linear_acceleration",
    "linearacceleration",
    "beschleunigung",
    "aceleración",
    "aceleracion",
    "accélération",
    "accelerazione",
    "加速度",
    "specific_force",
    "lin_acc",
    "a_rs_s",
    "acceleration",
    "accelerometer",
    "accel",
    "accl",
    "acc",
    "a",
    "f",
)
_GYROSCOPE = (
    "winkelgeschwindigkeit",
    "velocidad_angular",
    "giroscopio",
    "drehrate",
    "gyroskop",
    "角速度",
    "ジャイロ",
    "陀螺仪",
    "angular_velocity",
    "angularvelocity",
    "angular_rate",
    "rotation_rate",
    "ang_vel",
    "w_rs_s",
    "rotationrate",
    "gyroscope",
    "omega",
    "gyro",
    "gyr",
    "as",
    "g",
    "w",
)
_MAGNETOMETER = (
    "magnetometer_uncalibrated",
    "magnetometeruncalibrated",
    "magnetic_flux_density",
    "uncalibrated_magnetometer",
    "magnetic_field",
    "magnetic field",
    "magneticfield",
    "magnetometer",
    "mag_field",
    "magfield",
    "magneto",
    "compass",
    "magn",
    "mag",
)
_TIME = (
    "time_since_start",
    "gps_tow",
    "seconds_elapsed",
    "elapsed_time",
    "timestamp_unix",
    "time_stamp",
    "timestamp",
    "datetime",
    "elapsed",
    "stamp",
    "zeit",
    "tiempo",
    "temps",
    "tempo",
    "时间",
    "時間",
    "時刻",
    "time",
    "ts",
    "t",
)
_TEMPERATURE = (
    "imu_temperature",
    "die_temperature",
    "chip_temperature",
    "sensor_temperature",
    "temperature",
    "temperatur",
    "temperatura",
    "温度",
    "imu_temp",
    "die_temp",
    "chip_temp",
    "sensor_temp",
    "temp",
)
_SELF_EXPLAINING = ReadOptions()
_AXIS = {"x": 0, "y": 1, "z": 2, "0": 0, "1": 1, "2": 2}
_SEPARATOR = r"[\s_./:\-\[\]]*"
_RANGE = r"\d|ln|wr|lo|hi|low|high|lg|hg"
"""Mark of one of several sensors of one kind: a number, or low noise, wide range, low and high."""
_STATE = re.compile(r"(?P<stem>.+)_(?P<state>CAL|UNCAL|RAW)")
"""Behind names of Shimmer Consensys."""
_LEFT_OUT = re.compile(
    r"(?i)(?:.*[\s_.])?(?:(?:linear |user_?)acceleration|lineare beschleunigung|aceleraci[oó]n lineal"
    r"|accélération linéaire|accelerazione lineare|线性加速度|線形加速度).*"
)
"""Acceleration without gravity, of phones: no specific force, which `linear_acceleration` of ROS is."""
_PREFIX = r"(?:(?P<imu>.*?)[\s_./:\-]+)??"


def _any(words: Sequence[str]) -> str:
    return "|".join(re.escape(word) for word in sorted(words, key=len, reverse=True))


def _long(words: Sequence[str]) -> list[str]:
    return [word for word in words if len(word) > 1]


class _Spelling(NamedTuple):
    """A way in which names spell a channel."""

    words: Sequence[str]
    """Every such name holds one of these."""
    pattern: str

    def match(self, name: str) -> re.Match[str] | None:
        """Matches a name in lower case."""
        # A pattern takes long to compile, and most tables need a few.
        joined = name.replace(" ", "_")
        return re.fullmatch(self.pattern, name) if any(word in joined for word in self.words) else None


def _spellings(words: Sequence[str], quantity: Quantity) -> tuple[_Spelling, ...]:
    """Ways in which names spell a channel of a triad, the surest first."""
    long, unit = _long(words), _any(list(SPELLINGS[quantity]))
    name, axis, in_unit = _any(long), f"{_SEPARATOR}(?P<axis>[xyz012])\\]?", f"(?:_(?P<unit>{unit}))?"
    return (
        _Spelling(long, f"{_PREFIX}(?:{name})_(?P<unit>{unit}){axis}"),
        _Spelling(words, f"{_PREFIX}(?:{_any(words)}){axis}{in_unit}"),
        _Spelling(long, f"{_PREFIX}(?P<axis>[xyz])[_ ]?(?:{name}){in_unit}"),
        _Spelling(
            long,
            f"{_PREFIX}(?:{name})_?(?P<range>{_RANGE}){_SEPARATOR}(?P<axis>[xyz])\\]?{in_unit}",
        ),
    )


def _scalar_spellings(words: Sequence[str], quantity: Quantity) -> tuple[_Spelling, ...]:
    """Ways in which names spell time or temperature: without a prefix, then with one."""
    name = _any(words).replace("_", "[_ ]")
    tail = f"(?:{name})(?:(?:_| in )?(?P<unit>{_any(list(SPELLINGS[quantity]))}))?"
    return _Spelling(words, f"(?P<imu>){tail}"), _Spelling(words, f"{_PREFIX}{tail}")


_TRIADS: Mapping[Quantity, tuple[_Spelling, ...]] = {
    "accelerometer": _spellings(_ACCELEROMETER, "accelerometer"),
    "gyroscope": _spellings(_GYROSCOPE, "gyroscope"),
}
_UNITS_OF_TIME = _long(list(SPELLINGS["time"]))
_SCALARS: Mapping[Quantity, tuple[_Spelling, ...]] = {
    "time": (
        *_scalar_spellings(_TIME, "time"),
        _Spelling(
            _UNITS_OF_TIME, f"(?P<imu>)(?P<unit>{_any(_UNITS_OF_TIME)})(?:_?(?:{_any(_long(_TIME))}))?"
        ),
    ),
    "temperature": _scalar_spellings(_TEMPERATURE, "temperature"),
}
_FRACTIONS = tuple(spelling for spelling, unit in SPELLINGS["time"].items() if unit != "s")
_MAGNETIC = (
    *_spellings(_MAGNETOMETER, "magnetometer"),
    _Spelling(
        ("mx", "my", "mz", "m_", "m."),
        f"{_PREFIX}m[_.]?(?P<axis>[xyz])(?:_(?P<unit>{_any(list(SPELLINGS['magnetometer']))}))?",
    ),
)
_MAGNETIC_TIME = (
    r"(?i)mag(?:n|netic(?:_?field)?|netometer)?[\s_./]*(?:time_?stamp|time|stamp)"
    rf"(?:_(?P<unit>{_any(_UNITS_OF_TIME)}|s))?"
)
"""Time of a magnetometer that is no reading of the IMU; compiled where there is one."""
_LOADS: Mapping[LoadUnit, str] = {
    "A": r"(?i)(?:motor_?|battery_?)?current(?:_?a| ?[\[(]a[\])])?",
    "1": r"(?i)throttle",
}
"""Names of what disturbs a magnetometer, by its unit."""
_COUNTER = f"(?!(?:d|dt|delta|diff|latency|delay|age|period|exposure)_).+_(?P<unit>{_any(_FRACTIONS)})"
"""Any name with a unit of time behind it, but for those of a duration."""
_DESCRIPTORS = {"x8004": "g", "x8005": "rad/s", "x8006": "G"}
"""Units by the descriptor of a MIP field, which MicroStrain's programs write behind a name."""
_DEGREES = ("°", "℃", "°c")
"""Brackets behind the `T` of WitMotion, which is no time then."""
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[(](?P<unit>[^\])]*[^\])0-9][^\])]*)[\])]\s*$")


@dataclass(frozen=True, slots=True)
class Column:
    """Meaning of the name of a column."""

    quantity: Quantity
    axis: int
    """0, 1, 2 for x, y, z; 0 for time and temperature."""
    imu: str
    """Prefix that distinguishes IMUs of one table, as written; empty if there is none."""
    unit: str | None
    unknown: str = ""
    """Text that states a unit that is none of the quantity; empty where its name states none, or one."""


@dataclass(frozen=True, slots=True)
class MagneticColumns:
    """Columns of a magnetometer, by name."""

    axes: tuple[str, str, str]
    unit: StatedUnit | None = None
    time: str | None = None
    """Its own time; None where it stands in the rows of the IMU."""
    time_unit: StatedUnit | None = None
    current: str | None = None
    current_unit: LoadUnit = "A"
    name: str = ""
    """Prefix by which it is distinguished from others; empty where there is none."""
    notices: tuple[str, ...] = ()

    def names(self, time: str | None) -> list[str]:
        """All columns to read, each once; `time` is that of the IMU."""
        own = self.time or time
        optional = [name for name in (own, self.current) if name is not None]
        return list(dict.fromkeys([*optional, *self.axes]))


@dataclass(frozen=True, slots=True)
class ImuColumns:
    """Columns of one IMU, by name."""

    accelerometer: tuple[str, str, str] | None
    gyroscope: tuple[str, str, str] | None
    """Columns of the gyroscope; None where the table has none."""
    time: str | None = None
    temperature: str | None = None
    accelerometer_unit: StatedUnit | None = None
    gyroscope_unit: StatedUnit | None = None
    time_unit: StatedUnit | None = None
    temperature_unit: StatedUnit | None = None
    magnetometer: MagneticColumns | None = None
    """Columns of the magnetometer, which are read in a pass of their own."""
    gyroscope_time: str | None = None
    """Stamps of the gyroscope where `time` are those of the accelerometer; None where both share them."""
    gyroscope_time_unit: StatedUnit | None = None

    @property
    def by_gyroscope(self) -> ImuColumns | None:
        """Returns the same with the stamps of the gyroscope; None where both triads share them."""
        if self.gyroscope_time is None:
            return None
        return replace(
            self, time=self.gyroscope_time, time_unit=self.gyroscope_time_unit, gyroscope_time=None
        )

    @property
    def names(self) -> list[str]:
        """All columns to read for samples of the IMU, each once."""
        optional = [name for name in (self.time, self.temperature) if name is not None]
        return list(dict.fromkeys([*optional, *(self.accelerometer or ()), *(self.gyroscope or ())]))

    @property
    def magnetic_names(self) -> list[str]:
        """All columns to read for the magnetometer, each once; none where there is none."""
        return self.magnetometer.names(self.time) if self.magnetometer else []

    @property
    def as_option(self) -> str:
        """Option that makes Tumble read these columns."""
        return columns_option(
            zip(CHANNELS, (*(self.accelerometer or ()), *(self.gyroscope or ())), strict=False)
        )

    @property
    def triads(self) -> tuple[Triad, ...]:
        """Those the table has."""
        return tuple(triad for triad in TRIADS if getattr(self, triad) is not None)


_LONGEST_NAME = 100
_IGNORED = re.compile("[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u3164\ufe00-\ufe0f\uffa0]")
"""Letters and marks without a width; others are of the class of format signs."""
_NAMES_TO_REMEMBER = 1024
"""Devices send the names of their columns again and again, when samples have no time to wait for them."""


def _is_certain(name: str) -> bool:
    """Returns whether what stands in the brackets behind a name is a unit: round ones may hold anything."""
    return name.rstrip().endswith("]")


def _bracketed(name: str) -> re.Match[str] | None:
    """Reads a name with brackets behind it; None where there are none, or the name is too long to be ours."""
    return _BRACKETS.match(name) if len(name) <= _LONGEST_NAME else None


@lru_cache(_NAMES_TO_REMEMBER)
def recognise(name: str) -> Column | None:
    """Reads the name of a column; None if it is none of ours."""
    if len(name) > _LONGEST_NAME:  # The patterns take time that grows with the square of it.
        return None
    name = _seen(name)
    bracketed = _bracketed(name)
    stem, bracket = (bracketed["name"], bracketed["unit"]) if bracketed else (name.strip(), None)
    if bracket is not None:
        bracket = _DESCRIPTORS.get(bracket.lower(), bracket)
        if stem == "T" and bracket.lower() in _DEGREES:
            return Column("temperature", 0, "", "degC")
    if _LEFT_OUT.fullmatch(stem):
        return None
    state = _STATE.fullmatch(stem)
    stem, raw = (
        (state["stem"], "" if state["state"] == "CAL" else f" {state['state']}") if state else (stem, "")
    )

    def column(quantity: Quantity, axis: int, match: re.Match[str]) -> Column:
        unknown = unknown_unit(bracket or "", quantity, is_certain=_is_certain(name))
        # Brackets that state no unit leave that of the name: `gx_dps (IMU1)`.
        in_name = None if unknown else find_unit(match["unit"] or "", quantity)
        unit = find_unit(bracket or "", quantity) or in_name
        return Column(quantity, axis, _prefix(stem, match) + raw, unit, unknown)

    for quantity, spellings in _TRIADS.items():
        for spelling in spellings:
            if match := spelling.match(stem.lower()):
                return column(quantity, _AXIS[match["axis"]], match)
    for spelling in _MAGNETIC:
        if match := spelling.match(stem.lower()):
            return column("magnetometer", _AXIS[match["axis"]], match)
    for quantity, spellings in _SCALARS.items():
        for spelling in spellings:
            if match := spelling.match(stem.lower()):
                return column(quantity, 0, match)
    return None


def _seen(name: str) -> str:
    """Returns a name as it is seen: composed, without letters that have no width."""
    if name.isascii():
        return name
    seen = (letter for letter in _IGNORED.sub("", name) if unicodedata.category(letter) != "Cf")
    return unicodedata.normalize("NFC", "".join(seen))


def _prefix(stem: str, match: re.Match[str]) -> str:
    """Returns the words that distinguish sensors of one kind: those before the name, and its range."""
    groups = [group for group in ("imu", "range") if match.groupdict().get(group)]
    return "_".join(stem[match.start(group) : match.end(group)] for group in groups)


def find_imus(
    names: Sequence[str], path: Path | str, options: ReadOptions = _SELF_EXPLAINING
) -> dict[str, ImuColumns]:
    """Returns the columns of every IMU of a table, by prefix, with what `options` state of them.

    An IMU of which all columns of one triad are missing has the other one. Where `options` ask for one
    channel, its column stands for all three of its triad, and the other triad is missing.

    Raises `LogError` that lists the columns found where no triad is complete, or none is that channel's.
    """
    stated = _stated(names, path, options.columns)
    recognised = {name: recognise(name) for name in names}
    recognised |= _counter(recognised)
    recognised |= dict.fromkeys(_taken_otherwise(recognised, stated))
    if options.channel is not None:
        return {"": _single_axis(names, path, options.channel, recognised, stated)}
    prefixes = dict.fromkeys(
        column.imu for column in recognised.values() if column and column.quantity in _TRIADS
    )
    if any(key in stated for key in CHANNELS):
        prefixes = {"": None}
    index = _Index.of(recognised)
    found = {prefix: _imu_columns(prefix, index, stated) for prefix in prefixes}
    magnetometers = _magnetometers(recognised)
    load = _load(recognised, stated)
    magnetometer = {
        prefix: _magnetic_columns(prefix, path, recognised, stated, options, magnetometers, load)
        for prefix in prefixes or {"": None}
    }
    imus = {
        prefix: replace(imu, magnetometer=magnetometer[prefix])
        for prefix, imu in found.items()
        if imu is not None
    }
    if not imus:
        alone = next(iter(magnetometer.values()))
        if alone is not None and not options.need_imu:
            return {"": _magnetometer_alone(alone, recognised, stated)}
        raise LogError(
            _without_gravity(names, path)
            or _incomplete(names, path, recognised, stated) + (READ_MAGNETOMETER if alone else "")
        )
    # Beside whole IMUs, a triad of another name is another sensor.
    whole = {prefix: imu for prefix, imu in imus.items() if imu.triads == TRIADS}
    read = whole or _with_shared_gyroscope(imus)
    _refuse_doubled(read.values(), names, path, recognised, stated)
    return read


def _taken_otherwise(recognised: Mapping[str, Column | None], stated: Mapping[str, str]) -> Iterator[str]:
    """Yields the columns that a user states for another triad than their name: they are not of that too."""
    for channel in CHANNELS:
        column = recognised.get(stated.get(channel, ""))
        if column is not None and column.quantity in _TRIADS and column.quantity != triad_of(channel):
            yield stated[channel]


READ_MAGNETOMETER = "; a magnetometer is there: tumble magnetometer reads it"
"""Ends the error of a log without an IMU."""


def _magnetic_columns(
    prefix: str,
    path: Path | str,
    recognised: Mapping[str, Column | None],
    stated: Mapping[str, str],
    options: ReadOptions,
    magnetometers: Mapping[str, tuple[str, str, str]],
    load: tuple[str | None, LoadUnit],
) -> MagneticColumns | None:
    """Finds the magnetometer of the IMU with a prefix: the one stated, that of its prefix, or the first.

    Raises `LogError` where the one that is wanted is not there.
    """
    if all(key in stated for key in MAGNETIC_CHANNELS):
        x, y, z = (stated[key] for key in MAGNETIC_CHANNELS)
        found: Mapping[str, tuple[str, str, str]] = {"": (x, y, z)}
    else:
        found = magnetometers
    if options.magnetometer_name is not None and options.magnetometer_name not in found:
        raise LogError(
            f"{path}: no magnetometer {options.magnetometer_name!r}; "
            f"found: {', '.join(filter(None, found)) or 'none with a name'}"
        )
    if not found:
        return None
    wanted = (options.magnetometer_name or prefix, prefix, "")
    name = next((each for each in wanted if each in found), next(iter(found)))
    others = [each for each in found if each not in (name, "")]
    time = next((each for each in recognised if re.fullmatch(_MAGNETIC_TIME, _seen(each))), None)
    current, current_unit = load
    return MagneticColumns(
        found[name],
        joint_unit(
            _stated_in(axis, recognised.get(axis), "magnetometer")
            or (_unit_behind(axis, "magnetometer") if axis in stated.values() else None)
            for axis in found[name]
        ),
        time,
        _time_stated_in(time),
        current,
        current_unit,
        name,
        (f"another magnetometer, {listed(others)}, is not read: name it with --magnetometer-name",)
        if others and options.magnetometer_name is None and prefix not in found
        else (),
    )


def _magnetometers(recognised: Mapping[str, Column | None]) -> dict[str, tuple[str, str, str]]:
    """Returns the columns of whole magnetometers, by prefix."""
    axes: dict[str, dict[int, str]] = {}
    for name, column in recognised.items():
        if column is not None and column.quantity == "magnetometer":
            axes.setdefault(column.imu, {}).setdefault(column.axis, name)
    return {prefix: (found[0], found[1], found[2]) for prefix, found in axes.items() if len(found) == 3}


def _load(recognised: Mapping[str, Column | None], stated: Mapping[str, str]) -> tuple[str | None, LoadUnit]:
    """Finds the column of current or throttle: the one stated, else one of that name."""
    for key, unit in (("current", "A"), ("throttle", "1")):
        if key in stated:
            return stated[key], unit  # type: ignore[return-value]
    for unit, spelling in _LOADS.items():
        for name in recognised:
            if re.fullmatch(spelling, _seen(name).strip()):
                return name, unit
    return None, "A"


def _stated_in(name: str | None, column: Column | None, quantity: Quantity) -> StatedUnit | None:
    if name is None or column is None or column.quantity != quantity:
        return None
    if column.unit is not None:
        return StatedUnit(column.unit, COLUMN_NAME)
    return StatedUnit("", COLUMN_NAME, unknown=column.unknown, column=name) if column.unknown else None


def _unit_behind(name: str | None, quantity: Quantity) -> StatedUnit | None:
    """Returns the unit in brackets behind the name of a column that a user states to be of a quantity."""
    bracketed = _bracketed(_seen(name)) if name else None
    if name is None or bracketed is None:
        return None
    return unit_in(bracketed["unit"], quantity, name, is_certain=_is_certain(name))


def _time_stated_in(name: str | None) -> StatedUnit | None:
    match = re.fullmatch(_MAGNETIC_TIME, _seen(name)) if name else None
    unit = find_unit(match["unit"] or "", "time") if match else None
    return StatedUnit(unit, COLUMN_NAME) if unit else None


def _magnetometer_alone(
    columns: MagneticColumns, recognised: Mapping[str, Column | None], stated: Mapping[str, str]
) -> ImuColumns:
    """Returns the columns of a table that holds no triad of an IMU: its time, and its magnetometer."""
    plain = (name for name, column in recognised.items() if column and column.quantity == "time")
    time = stated.get("time") or columns.time or next(plain, None)
    return ImuColumns(
        None,
        None,
        time,
        time_unit=columns.time_unit or _stated_in(time, recognised.get(time or ""), "time"),
        magnetometer=replace(columns, time=None, time_unit=None),
    )


def _single_axis(
    names: Sequence[str],
    path: Path | str,
    channel: Channel,
    recognised: Mapping[str, Column | None],
    stated: Mapping[str, str],
) -> ImuColumns:
    """Finds the column of one channel: the one stated, the one named so, or the only one left."""
    triad, axis = triad_of(channel), channels_of(triad_of(channel)).index(channel)
    named = [
        name
        for name, column in recognised.items()
        if column is not None and (column.quantity, column.axis) == (triad, axis)
    ]
    unknown = [name for name, column in recognised.items() if column is None]
    found = [stated[channel]] if channel in stated else named or unknown
    if len(found) != 1:
        raise LogError(
            f"{path}: {len(found) or 'no'} columns may be {channel}; columns found: {listed(names)}; name "
            f"one, as {channel}:{path}:COLUMN"
        )
    others = {key: name for key, name in stated.items() if key not in CHANNELS}
    alone = {
        name: column
        for name, column in recognised.items()
        if name == found[0] or (column is not None and column.quantity not in _TRIADS)
    }
    columns = _imu_columns("", _Index.of(alone), others | dict.fromkeys(channels_of(triad), found[0]))
    assert columns is not None
    return columns


def _with_shared_gyroscope(imus: Mapping[str, ImuColumns]) -> dict[str, ImuColumns]:
    """Pair each accelerometer with the gyroscope whose name begins as its own does, or with the only one."""
    accelerometers = {name: imu for name, imu in imus.items() if imu.gyroscope is None}
    gyroscopes = {name: imu for name, imu in imus.items() if imu.accelerometer is None}
    pairs = {}
    for name, imu in accelerometers.items():
        related = [other for other in gyroscopes if name.startswith(other)]
        partner = max(related, key=len) if related else next(iter(gyroscopes), None)
        if partner is None or (not related and len(gyroscopes) > 1):
            return dict(imus)
        gyroscope = gyroscopes[partner]
        pairs[name] = replace(
            imu,
            gyroscope=gyroscope.gyroscope,
            gyroscope_unit=gyroscope.gyroscope_unit,
            time=imu.time or gyroscope.time,
            time_unit=imu.time_unit or gyroscope.time_unit,
            gyroscope_time=None if imu.time is None or imu.time == gyroscope.time else gyroscope.time,
            gyroscope_time_unit=gyroscope.time_unit,
        )
    if len(pairs) == 1:
        return {"": next(iter(pairs.values()))}
    return pairs or dict(imus)


def choose_imu(path: Path, imus: Mapping[str, ImuColumns], wanted: str | None) -> str:
    """Picks one IMU of a table by its prefix.

    Raises `LogError` where several are there and none is wanted: with a `--columns` to copy, where they share
    a gyroscope.
    """
    shared = {imu.gyroscope for imu in imus.values()}
    if wanted is None and len(imus) > 1 and len(shared) == 1 and None not in shared:
        first = next(iter(imus))
        raise LogError(
            f"{path}: holds {len(imus)} accelerometers and one gyroscope: name one, as {path.name}:{first} "
            f"(found: {', '.join(imus)}), or give {imus[first].as_option}"
        )
    return choose(path, tuple(imus), wanted, "column prefix")


def unread_accelerometers(
    names: Sequence[str], columns: Mapping[str, str], imus: Mapping[str, ImuColumns]
) -> tuple[str, ...]:
    """Names the accelerometers that stand beside a whole IMU and are not read."""
    if columns or len(imus) != 1:
        return ()
    (read,) = imus.values()
    recognised = {name: recognise(name) for name in names}
    index = _Index.of(recognised)
    found = []
    for prefix in dict.fromkeys(column.imu for column in recognised.values() if column):
        other = _imu_columns(prefix, index, {})
        if other and other.accelerometer and other.accelerometer != read.accelerometer:
            option = replace(other, gyroscope=read.gyroscope).as_option
            found.append(
                f"another accelerometer, {', '.join(other.accelerometer)}, is not read: {option} reads it"
            )
    return tuple(found)


def _without_gravity(names: Sequence[str], path: Path | str) -> str:
    """Refuses acceleration from which gravity was removed; empty where there is none."""
    found = [name for name in names if _LEFT_OUT.fullmatch(name)]
    if not found:
        return ""
    return (
        f"{path}: {found[0]} is acceleration without gravity, which is no specific force: record the "
        "accelerometer with gravity (phyphox: Acceleration with g), or name its columns with --columns"
    )


def _counter(recognised: Mapping[str, Column | None]) -> dict[str, Column]:
    """Time column where no name states it: the only one with a unit of time behind it, as `mcu_us`."""
    if any(column and column.quantity == "time" for column in recognised.values()):
        return {}
    matches = {
        name: match
        for name, column in recognised.items()
        if column is None and (match := re.fullmatch(_COUNTER, _seen(name).strip().lower()))
    }
    if len(matches) != 1:
        return {}
    return {name: Column("time", 0, "", find_unit(match["unit"], "time")) for name, match in matches.items()}


def _stated(names: Sequence[str], path: Path | str, columns: Mapping[str, str]) -> dict[str, str]:
    stated = {}
    for key, wanted in columns.items():
        if key not in COLUMN_KEYS:
            raise LogError(f"--columns {key}={wanted}: {key} is none of {', '.join(COLUMN_KEYS)}")
        if wanted in names:
            stated[key] = wanted
        elif named := [name for name in names if (found := _bracketed(name)) and found["name"] == wanted]:
            stated[key] = named[0]
        elif 1 <= (number := whole_number(wanted) or 0) <= len(names):
            stated[key] = names[number - 1]
        else:
            raise LogError(f"{path}: no column {wanted!r} for {key}; columns found: {listed(names)}")
    return stated


def _refuse_doubled(
    imus: Iterable[ImuColumns],
    names: Sequence[str],
    path: Path | str,
    recognised: Mapping[str, Column | None],
    stated: Mapping[str, str],
) -> None:
    """Raises `LogError` where two columns may be one channel of an IMU, and nobody states which of them is.

    Columns of time are none of these: a log may state one moment by several clocks.
    """
    alike: dict[tuple[str, str], list[str]] = {}
    for name in names:
        column = recognised[name]
        if column is not None and column.quantity != "time":
            alike.setdefault((_channel_of(column), column.imu), []).append(name)
    read = {name for imu in imus for name in (*imu.names, *imu.magnetic_names)}
    for (channel, _), found in alike.items():
        if len(found) > 1 and channel not in stated and read.intersection(found):
            raise LogError(
                f"{path}: {listed(found)} may each be {channel}; name one, as --columns {channel}={found[0]}"
            )


def _channel_of(column: Column) -> str:
    """Returns the word of `COLUMN_KEYS` for the channel of a column."""
    if column.quantity == "magnetometer":
        return MAGNETIC_CHANNELS[column.axis]
    triad = next((each for each in TRIADS if each == column.quantity), None)
    return column.quantity if triad is None else channels_of(triad)[column.axis]


@dataclass(frozen=True, slots=True)
class _Index:
    """Columns that are recognised, by what they hold: to look through all for each IMU takes their square."""

    columns: Mapping[str, Column | None]
    places: Mapping[tuple[Quantity, int, str], str]
    """The first column of each quantity, axis and prefix."""
    only_time: str | None
    times: tuple[str, ...]

    @classmethod
    def of(cls, recognised: Mapping[str, Column | None]) -> _Index:
        """Returns the index of columns."""
        places: dict[tuple[Quantity, int, str], str] = {}
        for name, column in recognised.items():
            if column is not None:
                places.setdefault((column.quantity, column.axis, column.imu), name)
        times = tuple(name for name, column in recognised.items() if column and column.quantity == "time")
        return cls(recognised, places, _only(recognised, "time"), times)


def _imu_columns(prefix: str, index: _Index, stated: Mapping[str, str]) -> ImuColumns | None:
    def pick(key: str, quantity: Quantity, axis: int = 0, shared: bool = False) -> str | None:
        if key in stated:
            return stated[key]
        imus = (prefix, "") if shared else (prefix,)
        found = (index.places.get((quantity, axis, imu)) for imu in imus)
        return next((name for name in found if name is not None), None)

    acceleration = [pick(key, "accelerometer", axis) for axis, key in enumerate(("ax", "ay", "az"))]
    rate = [pick(key, "gyroscope", axis) for axis, key in enumerate(("gx", "gy", "gz"))]
    if any(None in triad and any(triad) for triad in (acceleration, rate)) or not any(acceleration + rate):
        return None
    time, gyroscope_time = _stamps(prefix, index, stated, pick("time", "time", shared=True))
    if None in (acceleration[0], rate[0]):
        gyroscope_time = None
    temperature = pick("temperature", "temperature", shared=True)

    def unit(name: str | None, quantity: Quantity) -> StatedUnit | None:
        known = _stated_in(name, index.columns.get(name) if name else None, quantity)
        return known or (_unit_behind(name, quantity) if name in stated.values() else None)

    return ImuColumns(
        _whole(acceleration),
        _whole(rate),
        time,
        temperature,
        joint_unit(unit(name, "accelerometer") for name in acceleration),
        joint_unit(unit(name, "gyroscope") for name in rate),
        unit(time, "time"),
        unit(temperature, "temperature"),
        gyroscope_time=gyroscope_time,
        gyroscope_time_unit=unit(gyroscope_time, "time"),
    )


def _stamps(
    prefix: str, index: _Index, stated: Mapping[str, str], usual: str | None
) -> tuple[str | None, str | None]:
    """Returns the stamps of an IMU, and those of its gyroscope where they are others.

    Stamps may be those of one triad: `gyro_timestamp`; `imu2_sample_time` are those of the IMU `imu2`.
    """
    if "time" in stated:
        return stated["time"], None
    own: dict[str, str] = {}
    for name in index.times:
        column = index.columns[name]
        assert column is not None
        if not column.imu.startswith(prefix):
            continue
        word = column.imu[len(prefix) :].strip("_ ./:-").lower()
        triad = next((triad for triad, words in _TRIAD_WORDS.items() if word in words), None)
        if triad is not None:
            own.setdefault(triad, name)
        elif prefix and column.imu[len(prefix) :][:1] in _BETWEEN and word and word not in _OTHER_WORDS:
            own.setdefault("", name)
    of_prefix = index.places.get(("time", 0, prefix))
    shared = of_prefix if prefix and of_prefix else own.get("") or usual or index.only_time
    force, rate = own.get("accelerometer") or shared, own.get("gyroscope") or shared
    force, rate = force or rate, rate or force
    return force, None if rate == force else rate


_BETWEEN = tuple("_ ./:-")
_TRIAD_WORDS = {"accelerometer": frozenset(_long(_ACCELEROMETER)), "gyroscope": frozenset(_long(_GYROSCOPE))}
_OTHER_WORDS = frozenset((*_long(_MAGNETOMETER), *_long(_TEMPERATURE), "header"))
"""Those of other sensors, and of headers of ROS, whose stamp its reader takes where there is one."""


def _whole(names: Sequence[str | None]) -> tuple[str, str, str] | None:
    x, y, z = names
    return None if x is None or y is None or z is None else (x, y, z)


def _only(recognised: Mapping[str, Column | None], quantity: Quantity) -> str | None:
    """Returns the one column of that quantity, whatever its prefix; None if there is none or a choice."""
    names = [name for name, column in recognised.items() if column and column.quantity == quantity]
    return names[0] if len(names) == 1 else None


def _incomplete(
    names: Sequence[str], path: Path | str, recognised: Mapping[str, Column | None], stated: Mapping[str, str]
) -> str:
    """Names what is missing for the prefix that comes nearest to an IMU."""
    have: dict[str, set[str]] = {"": set(stated)}
    for column in recognised.values():
        if column and column.quantity in _TRIADS:
            channel = ("a" if column.quantity == "accelerometer" else "g") + "xyz"[column.axis]
            have.setdefault(column.imu, set()).add(channel)
    best = max(have.values(), key=len) | set(stated)
    begun = [key for key in CHANNELS if any(other[0] == key[0] for other in best)]
    missing = [key for key in begun or CHANNELS if key not in best]
    spare = [name for name, column in recognised.items() if column is None and name not in stated.values()]
    three = triple_in(spare) if not begun else None
    if three is not None:
        as_force, as_rate = (option_for(triad, three) for triad in TRIADS)
        remedy = f"say what {listed(three)} are: {as_force}, or {as_rate}"
    elif len(spare) >= len(missing):
        remedy = "name them with --columns, as --columns ax=NAME"
    else:
        remedy = "a triad needs x, y and z: record all three"
    return f"{path}: no column for {', '.join(missing)}; columns found: {listed(names)}; {remedy}"
