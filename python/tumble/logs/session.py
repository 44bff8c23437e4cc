"""A recorded session: a folder with `session.yaml` and the samples of each unit.

They are `NAME.parquet`, and after it in time what `NAME.parts` holds: files written while the session runs,
or left by one that was killed. A part is named by its number, or by the first and the last number of those
that were joined in it, so that none counts twice wherever joining was broken off.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from pydantic import Field, JsonValue

from tumble.foundation.documents import Document, Name, read_document
from tumble.foundation.errors import LogError
from tumble.foundation.file_names import SESSION_FILE
from tumble.foundation.file_status import is_file
from tumble.foundation.magnetic import MICROTESLA
from tumble.foundation.numbers import whole_number
from tumble.foundation.recording import FloatArray
from tumble.foundation.schemas import SESSION
from tumble.logs import parquet
from tumble.logs.arrow_floats import as_floats
from tumble.logs.options import ReadOptions
from tumble.logs.read_as import ReadAs
from tumble.logs.session_clock import STAMP, ClockLine, lines_of, steady
from tumble.logs.spec import parse_spec
from tumble.logs.track import (
    LoggedImu,
    LoggedMagnetometer,
    RawMagnetic,
    RawSamples,
    StatedUnit,
    Transform,
    choose,
)

SCHEMA: Literal["tumble-session/1"] = "tumble-session/1"
SessionClock: TypeAlias = Literal["host", "sensor", "log"]
MOVING = "moving"
"""Column of whether wheels turned."""
LAST_PART = "last-part"
"""Note of a Parquet file: the number of the last part that was joined in it."""
_PART = re.compile(r"(\d+)(?:-(\d+))?\.parquet")


class SessionUnit(Document):
    """One unit of a session."""

    name: str = Field(pattern=r"^[\w+-][\w.+-]*$")
    """Under which it was recorded; `SESSION:NAME` reads it."""
    source: str
    """Source as typed by the user."""
    serial: Name = ""
    """Serial number of the unit, where it is known."""
    samples: int | None = Field(default=None, ge=0)
    """Once the session has ended."""
    read_as: ReadAs | None = None
    """Columns and units of its source, so that a session that goes on reads it as before."""
    remarks: tuple[str, ...] = Field(default=(), strict=False)
    """Remarks on its samples: units assumed, gaps, the error of its clock."""


class SessionProcedure(Document):
    """The procedure that a session was recorded for; a run on the session takes who and what from here."""

    name: str
    """`turntable`."""
    operator: Name = ""
    station: Name = ""
    options: dict[str, JsonValue] = Field(default_factory=dict)
    """Options of the user, and how far they were met."""


class Session(Document):
    """Contents of a recorded session: time, sources, and its end."""

    schema_: Literal["tumble-session/1"] = Field(default=SCHEMA, alias="schema")
    started: str
    """UTC, ISO 8601."""
    clock: SessionClock
    """Clock of `time`: the monotonic clock of the computer that recorded, the one sensor's own, or that of
    replayed logs."""
    clock_origin: float = 0.0
    """s since 1970 at which that clock of the computer was zero."""
    clock_rate: float = Field(default=1.0, gt=0.0)
    """s of `time` in a second of `arrival`: not one on a simulated bench that runs faster than life."""
    ended: str | None = None
    """UTC, ISO 8601; absent while it runs, or where it was killed."""
    reason: str | None = None
    """Reason of the end."""
    closed: float | None = None
    """s of the clock of `arrival` at which it ended: since the last sample all units were silent."""
    units: tuple[SessionUnit, ...] = Field(min_length=1, strict=False)
    """Units in the order in which they were typed."""
    software: str = ""
    procedure: SessionProcedure | None = None

    @classmethod
    def load(cls, folder: Path) -> Session:
        """Read that of a folder; raises `CalibrationFileError` where it is none."""
        return read_document(folder / SESSION_FILE, cls, SESSION)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the units."""
        return tuple(unit.name for unit in self.units)


def unit_names(source: str) -> tuple[str, ...]:
    """Returns the names of the units of a recorded session; none where `source` is none."""
    folder = Path(source)
    return Session.load(folder).names if is_file(folder / SESSION_FILE) else ()


def procedure_of(source: object) -> SessionProcedure | None:
    """Purpose of `SESSION` or `SESSION:NAME`; None where that is no session, or not known."""
    if not isinstance(source, str | Path):
        return None
    folder = parse_spec(source).path
    return Session.load(folder).procedure if is_file(folder / SESSION_FILE) else None


def parts_folder(folder: Path, name: str) -> Path:
    """Returns where parts of a unit are."""
    return folder / f"{name}.parts"


def joined_file(folder: Path, name: str) -> Path:
    """Returns where all samples of a unit are once the session has ended."""
    return folder / f"{name}.parquet"


def numbers_of(part: Path) -> tuple[int, int] | None:
    """Returns first and last number of what is in a part; None for what is no part."""
    match = _PART.fullmatch(part.name)
    return (int(match[1]), int(match[2] or match[1])) if match else None


def unit_files(folder: Path, name: str) -> list[Path]:
    """Returns the files with the samples of a unit, in order of time, each sample once."""
    whole = joined_file(folder, name)
    done = last_part(whole) if is_file(whole) else 0
    files = [whole] if is_file(whole) else []
    parts = {part: numbers for part in parts_folder(folder, name).glob("*") if (numbers := numbers_of(part))}
    # The longest of those that begin alike was joined last.
    for part, (first, last) in sorted(parts.items(), key=lambda item: (item[1][0], -item[1][1])):
        if first > done:
            files.append(part)
            done = last
    return files


def last_part(path: Path) -> int:
    """Returns the number of the last part that a file holds; 0 where it was not made of parts."""
    with parquet.opened(path) as file:
        stated = (file.schema_arrow.metadata or {}).get(f"tumble.{LAST_PART}".encode(), b"")
    return whole_number(stated.decode("ascii", "replace")) or 0


@dataclass(frozen=True, slots=True)
class Recorded:
    """Extent of a unit's samples on disk."""

    samples: int
    last: float
    """s of the last sample; -inf where there is none."""
    columns: tuple[str, ...]


def recorded_so_far(folder: Path, name: str) -> Recorded:
    """Returns the extent of a unit on disk, without reading all of it."""
    samples, last, columns = 0, -math.inf, ()
    for path in unit_files(folder, name):
        with parquet.opened(path) as file:
            samples += file.metadata.num_rows
            last = file.read_row_group(file.num_row_groups - 1, columns=["time"])["time"][-1].as_py()
            columns = tuple(file.schema_arrow.names)
    return Recorded(samples, last, columns)


class RecordedColumn:
    """A column of a recorded unit that logs do not have, taken off in order."""

    def __init__(self, folder: Path, name: str, column: str) -> None:
        self._pieces = _pieces(folder, name, column)
        self._waiting = next(self._pieces, np.empty(0))

    @property
    def is_known(self) -> bool:
        """Returns whether it was recorded: an unknown column is NaN throughout."""
        return len(self._waiting) > 0 and bool(np.isfinite(self._waiting[0]))

    def take(self, count: int) -> FloatArray:
        """Removes and returns so many values."""
        pieces = [self._waiting]
        while sum(map(len, pieces)) < count:
            pieces.append(next(self._pieces))
        joined = np.concatenate(pieces)
        self._waiting = joined[count:]
        return joined[:count]


def _pieces(folder: Path, name: str, column: str) -> Iterator[FloatArray]:
    for path in unit_files(folder, name):
        with parquet.opened(path) as file:
            if column not in file.schema_arrow.names:
                return
            for batch in file.iter_batches(columns=[column], use_threads=False):
                yield as_floats(batch.column(0))


def wheels_of(source: str) -> RecordedColumn | None:
    """Returns whether the wheels turned, of a unit of a recorded session; None where that is not known."""
    spec = parse_spec(source)
    if not is_file(spec.path / SESSION_FILE):
        return None
    names = Session.load(spec.path).names
    name = spec.imu or names[0]
    is_there = MOVING in recorded_so_far(spec.path, name).columns
    return RecordedColumn(spec.path, name, MOVING) if is_there else None


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the names of the units."""
    return Session.load(path).names


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Opens one unit of a session.

    Raises `LogError` where there is no such unit, or nothing of it was recorded.
    """
    session = Session.load(path)
    name = choose(path, session.names, imu, "unit")
    unit = next(unit for unit in session.units if unit.name == name)
    files = unit_files(path, name)
    if not files:
        raise LogError(f"{path}: no sample of {name} was recorded; give another unit")
    lines = lines_of(files, session.clock_rate) if session.clock == "host" and not options.live_times else []
    if lines:
        options = replace(options, columns={**options.columns, "time": STAMP})
    first = parquet.open_logged_imu(files[0], None, options)
    tracks = [first, *(parquet.open_logged_imu(file, None, options) for file in files[1:])]

    def recorded() -> Iterator[RawSamples]:
        for track in tracks:
            yield from track.read(lambda samples: samples)

    def read(transform: Transform) -> Iterator[RawSamples]:
        return map(transform, steady(recorded(), lines) if lines else recorded())

    return replace(
        first,
        path=path,
        imu=name,
        name=name,
        format="session",
        read=read,
        accelerometer_unit=first.accelerometer_unit or StatedUnit("m/s^2", _REASON),
        gyroscope_unit=first.gyroscope_unit or StatedUnit("rad/s", _REASON),
        time_unit=first.time_unit or StatedUnit("s", _REASON),
        temperature_unit=first.temperature_unit or StatedUnit("degC", _REASON),
        magnetometer=_magnetometer(tracks, lines),
        clock=str(path.resolve()),
        serial=unit.serial or first.serial,
        alone=len(session.units) == 1,
        pace_sigma=max((line.pace_sigma for line in lines), default=0.0),
        expected=sum(track.expected or 0 for track in tracks),
        notices=(*first.notices, *unit.remarks, *_unfinished(session)),
    )


def _magnetometer(tracks: Sequence[LoggedImu], lines: list[ClockLine]) -> LoggedMagnetometer | None:
    """Returns the magnetometer of all files of a unit, with the times of its samples."""
    parts = [track.magnetometer for track in tracks if track.magnetometer is not None]
    if len(parts) < len(tracks):
        return None

    def samples(raw: RawMagnetic) -> RawSamples:
        return RawSamples(raw.time, raw.field, raw.field)

    def read() -> RawMagnetic:
        rows = map(samples, (part.read() for part in parts))
        found = list(steady(rows, lines) if lines else rows)
        times = [each.time for each in found if each.time is not None]
        return RawMagnetic(np.concatenate(times), np.concatenate([each.accelerometer for each in found]))

    return replace(parts[0], read=read, unit=parts[0].unit or StatedUnit(MICROTESLA, _REASON))


_REASON = "session"


def _unfinished(session: Session) -> tuple[str, ...]:
    return () if session.ended else ("the session was not ended: it still runs, or was killed",)
