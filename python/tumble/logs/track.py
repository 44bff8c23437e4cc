"""Contents of a file before any unit is decided: the common interface of all formats."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.magnetic import LoadUnit
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS, Triad
from tumble.logs.triads import gathered

LARGEST_RATIO = 1100
"""Compression ratio that no readings reach, and deflate cannot."""
CHUNK_SAMPLES = 1 << 15
"""Samples in a chunk: large enough for numpy to be quick, small enough for memory not to matter."""


@dataclass(slots=True)
class RawSamples:
    """Successive samples, in the units of the log until `Conversion` has made them SI."""

    time: FloatArray | None
    """(n,), None where the log holds no time."""
    accelerometer: FloatArray
    """(n, 3)."""
    gyroscope: FloatArray
    """(n, 3)."""
    temperature: FloatArray | None = None
    """(n,)."""
    bad_lines: tuple[str, ...] = ()
    """Error in each line that was left out among them."""
    received: FloatArray | None = None
    """(n,) s by the clock of the recorder, where the log has that besides the time of the sensor."""

    def __len__(self) -> int:
        return len(self.accelerometer)


@dataclass(frozen=True, slots=True)
class RawMagnetic:
    """All readings of a magnetometer, in the units of the log."""

    time: FloatArray | None
    """(m,), None where the log holds no time and readings stand in the rows of the IMU."""
    field: FloatArray
    """(m, 3); NaN in rows that hold no reading."""
    current: FloatArray | None = None
    """(m,)."""


DEFINED = "message definition"
"""Source of a unit: all messages of that name have it."""
DOCUMENTED = "documentation of the format"
"""Source of a unit: all files of the format have it, without stating it."""
COLUMN_NAME = "column name"
"""Source of a unit: the name holds it, as `ax [g]`."""
COLUMN_TYPE = "column type"
"""Source of a unit: a table of types holds dates."""
DATE_AND_TIME = "date and time"
"""Source of a unit of time: a text holds dates."""
TIME_OF_DAY = "time of day"
"""Source of a unit of time: a text holds hours, minutes and seconds."""


@dataclass(frozen=True, slots=True)
class StatedUnit:
    """A unit the log itself states, and where."""

    name: str
    reason: str
    """`DEFINED`, `DOCUMENTED` ..., or words of the one format where it stands in another place."""
    others: tuple[str, ...] = ()
    """Units that columns of the same sensor state as well, and that contradict it."""
    unknown: str = ""
    """Text that states it, where it is none that is known: then `name` is empty."""
    column: str = ""
    """Column that states an unknown unit."""


def joint_unit(units: Iterable[StatedUnit | None]) -> StatedUnit | None:
    """Returns the unit that any column of a sensor states, with others that contradict it; None without one.

    A head may state the unit behind the last axis alone. A unit that is unknown goes before those that are
    known: the column that states it is in none of these.
    """
    stated = [unit for unit in units if unit is not None]
    if not stated:
        return None
    if unknown := next((unit for unit in stated if unit.unknown), None):
        return unknown
    names = dict.fromkeys(unit.name for unit in stated)
    return replace(stated[0], others=tuple(name for name in names if name != stated[0].name))


Transform = Callable[[RawSamples], RawSamples]


@dataclass(frozen=True, slots=True)
class LoggedMagnetometer:
    """The magnetometer beside an IMU, or alone in a log, as its reader found it."""

    read: Callable[[], RawMagnetic]
    """Reads all of it, in a pass of its own."""
    unit: StatedUnit | None = None
    time_unit: StatedUnit | None = None
    """Unit of its own times; None where they are those of the IMU."""
    name: str = ""
    row_wise: bool = False
    """Indicates whether rows of the IMU hold it, which then may repeat the readings of a slower one."""
    current_unit: LoadUnit = "A"
    already_corrected: bool | None = None
    notices: tuple[str, ...] = ()


WRITTEN = "head of the file"
"""Source of a unit: a file that Tumble wrote states it."""
SI = "SI"
"""Word by which files that Tumble writes state that they hold m/s^2, rad/s, s and degC."""


def with_written_units(found: LoggedImu, stated: str | None) -> LoggedImu:
    """Returns an IMU whose units are those that the file states of all its columns, if it does."""
    if stated != SI:
        return found
    return replace(
        found,
        accelerometer_unit=found.accelerometer_unit or StatedUnit("m/s^2", WRITTEN),
        gyroscope_unit=found.gyroscope_unit or StatedUnit("rad/s", WRITTEN),
        time_unit=found.time_unit or StatedUnit("s", WRITTEN),
        temperature_unit=found.temperature_unit or StatedUnit("degC", WRITTEN),
    )


@dataclass(frozen=True, slots=True)
class LoggedImu:
    """One IMU of a file, as its reader found it."""

    path: Path
    imu: str
    """Name of the IMU in the file: a topic, a column prefix; empty where it needs none."""
    format: str
    """Format, as in `tumble.foundation.recording.Metadata.format`."""
    read: Callable[[Transform], Iterator[RawSamples]]
    """A fresh pass over all samples, each piece put through the transform, in the order of the file."""
    head: Callable[[], RawSamples]
    """The first samples, quickly, in the units of the log."""
    locate: Callable[[int], str]
    """Function that describes the place of a sample (counted from 0) in the file: `line 812`, `message 40 of
    /imu`."""
    accelerometer_unit: StatedUnit | None = None
    gyroscope_unit: StatedUnit | None = None
    time_unit: StatedUnit | None = None
    temperature_unit: StatedUnit | None = None
    frame: str = "case"
    clock: str = ""
    rate: float | None = None
    serial: str = ""
    already_corrected: bool | None = None
    correction: str = ""
    """Source of their correction, where the log names it."""
    undone: bool = False
    """Indicates whether a correction was undone, as the options ask; raw readings have nothing to undo."""
    notices: tuple[str, ...] = ()
    triads: tuple[Triad, ...] = TRIADS
    """Those that it holds; `accelerometer` or `gyroscope` of the samples is NaN where it holds but one."""
    pace_sigma: float = 0.0
    """Sigma of the pace of the clock, as in `tumble.foundation.recording.Metadata.pace_sigma`."""
    magnetometer: LoggedMagnetometer | None = None
    """The magnetometer on the clock of the IMU; where `triads` is empty, it is all that the log holds."""
    columns: tuple[str, ...] = ()
    """Names of all columns of a table; empty for messages."""
    alone: bool = True
    """True where the file holds no other IMU."""
    name: str = ""
    """Short name, where it is not made of those of the file and of the IMU."""
    expected: int | None = None
    """Number of samples, where it is known before reading; for a text table a fair guess."""

    @property
    def source(self) -> str:
        """Argument by which a user names this IMU."""
        return f"{self.path}:{self.imu}" if self.imu else str(self.path)


def choose(path: Path, names: tuple[str, ...], wanted: str | None, what: str) -> str:
    """Picks the wanted one of several IMUs; `what` is what names one here: `topic`, `column prefix`.

    Raises `LogError` where there is no such name, or where there are several and none is wanted.
    """
    if wanted is None:
        if len(names) == 1:
            return names[0]
        if "" in names:
            return ""
        raise several(path, path.name, names)
    matches = [name for name in names if name.strip("/") == wanted.strip("/")]
    if matches:
        return matches[0]
    raise none_such(path, what, wanted, names)


def one_name(source: Path | str, named: str | None, topic: str | None) -> str | None:
    """Name of an IMU, typed behind its source or with --topic; raises `LogError` for two names."""
    if named and topic and named != topic:
        raise LogError(f"{source}: {named!r} and --topic {topic!r} both name an IMU; give one")
    return named or topic


def several(source: Path | str, typed: str, names: Sequence[str]) -> LogError:
    """Reports that one of several IMUs has to be named; `typed` is the text before its name."""
    return LogError(
        f"{source}: holds {len(names)} IMUs: name one, as {typed}:{names[0]} (found: {', '.join(names)})"
    )


def none_such(source: Path | str, what: str, wanted: str, names: Sequence[str]) -> LogError:
    """Reports an unknown IMU; `what` is the kind of name that IMUs have here."""
    found = ", ".join(name for name in names if name) or "only one IMU, without a name"
    return LogError(f"{source}: no {what} {wanted!r}; found: {found}")


def stack(batch: Mapping[str, FloatArray], names: tuple[str, str, str] | None) -> FloatArray:
    """Gathers three columns as (n, 3), NaN where there are none."""
    if names is None:
        return np.full((len(next(iter(batch.values()))), 3), np.nan)
    return gathered([batch[name] for name in names])
