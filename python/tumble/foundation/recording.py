"""A recording of one inertial measurement unit, read in chunks so that its length does not matter."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike

from tumble.foundation import arrays, frames
from tumble.foundation.arrays import FloatArray as FloatArray  # where the rest of the package looks for it
from tumble.foundation.errors import ArrayError, LogError
from tumble.foundation.log_reading import LogReading
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.names import LONGEST_NAME, normal_name
from tumble.foundation.units import TRIADS, UNITS, Channel, Triad, channels_of
from tumble.foundation.words import plain, printable

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

FEW_SAMPLES = 10
"""Samples that are looked at sooner one by one than by numpy."""

SampleProgress: TypeAlias = Callable[[int, int | None], None]
"""Callback that receives the samples done, and those expected where they are known."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """Successive samples of one IMU, in SI units and the case frame of the IMU.

    Raises `ArrayError` for what is no such array; what can be made one is.
    """

    time: FloatArray
    """(n,) seconds of the recording's own clock."""
    accelerometer: FloatArray
    """(n, 3) specific force, m/s^2: at rest and upright it reads +g up."""
    gyroscope: FloatArray
    """(n, 3) angular rate, rad/s."""
    temperature: FloatArray | None = None
    """(n,) degC, where the log has it."""
    received: FloatArray | None = field(default=None, kw_only=True)
    """(n,) s by the clock of the recorder at which each came, where the log has that besides `time`."""

    def __post_init__(self) -> None:
        if arrays.are_samples(self.time, self.accelerometer, self.gyroscope, self.temperature):
            return
        object.__setattr__(self, "time", arrays.times(self.time))
        object.__setattr__(self, "accelerometer", arrays.triad(self.accelerometer, "accelerometer"))
        object.__setattr__(self, "gyroscope", arrays.triad(self.gyroscope, "gyroscope"))
        if self.temperature is not None:
            object.__setattr__(self, "temperature", arrays.column(self.temperature, "temperature"))
        arrays.refuse_other_lengths(
            [(name, getattr(self, name)) for name in ("time", "accelerometer", "gyroscope", "temperature")]
        )

    def __len__(self) -> int:
        return len(self.time)


def recorded_rows(chunk: Chunk, triads: Sequence[Triad]) -> Iterator[FloatArray | None]:
    """Yields the (n, 3) readings of accelerometer and gyroscope, SI; None for one that was not recorded."""
    for triad in TRIADS:
        yield np.ascontiguousarray(getattr(chunk, triad)) if triad in triads else None


ASSUMED = "assumed"
"""Reason of a unit that neither log nor user states, and that readings leave open."""
AT_REST = "bias and noise at rest"
"""Reason of a unit of the gyroscope that readings at rest show."""


@dataclass(frozen=True, slots=True)
class ResolvedUnit:
    """The unit a quantity was found in, and why it was taken to be that one."""

    name: str
    """Name of the unit as in the field: `m/s^2`, `g`, `rad/s`, `deg/s`, `counts`, `s`, `ms`, `us`, `ns`,
    `degC`."""
    scale: float
    """SI value of one unit."""
    reason: str
    """`column name`, `option`, `norm at rest`, `message definition`, `ASSUMED` ..."""
    doubt: str = ""
    """Sentence on what else it may be, and the option that states it; empty where nothing else fits."""
    per: str = ""
    """Unit of which a scale states the counts; empty for others."""

    @property
    def is_assumed(self) -> bool:
        """Returns whether the unit is an assumption that neither log nor user states."""
        return self.reason == ASSUMED

    @property
    def is_guessed_radians(self) -> bool:
        """Returns whether it is rad/s that nobody states, and that later rates may contradict."""
        return self.name == "rad/s" and self.reason in (ASSUMED, AT_REST)


@dataclass(frozen=True, slots=True)
class Metadata:
    """Facts about a recording besides its samples."""

    name: str
    """Short name for tables and file names: `target_1`, `exp_3-imu2`."""
    source: str
    """Argument as typed by the user: path, and IMU where the file holds several."""
    format: str
    """Name of a row of `log_formats.LOG_FORMATS`, or `folder`, `arrays`, `table`, `single axes`."""
    accelerometer_unit: ResolvedUnit
    gyroscope_unit: ResolvedUnit
    time_unit: ResolvedUnit
    frame: str = "case"
    """Frame the log declares (`frame_id`), else `case`."""
    axes: str = ""
    """Directions of the axes as the format defines them, in words; empty where it does not."""
    body: str = ""
    """Directions of the case axes in a vehicle, such as FRD, where the format defines them; else empty."""
    clock: str = ""
    """Name of the time base: recordings with the same non-empty clock share it for certain."""
    rate: float | None = None
    """Declared sample rate in Hz where the log or the user states one."""
    already_corrected: bool | None = None
    """True where the source is known to apply a calibration before logging, None where nobody knows."""
    reading: LogReading = field(default_factory=dict)
    """Options that changed its readings; empty for arrays in memory, which are taken as they are."""
    serial: str = ""
    """Serial number of the unit where the log or the user states one."""
    triads: tuple[Triad, ...] = TRIADS
    """Those that were recorded; the samples of the other are NaN."""
    missing: tuple[Channel, ...] = ()
    """Channels of these triads that the unit lacks; their samples are NaN."""
    temperature_fault: str = ""
    """Reason why its temperatures are not used, for the user; empty where they are, or none were recorded."""
    unread: tuple[str, ...] = ()
    """Names of columns that are not read, as neither their names nor the user explain them."""
    alone: bool = True
    """True where no other IMU was logged with this one."""
    pace_sigma: float = 0.0
    """1-sigma of the pace of `time`, relative, where times were fitted; zero for stamps taken as they are."""
    fit_sigmas: tuple[float, float] = (0.0, 0.0)
    """1-sigma of the shift, s, and of the pace of times that were fitted to late stamps; zeros elsewhere."""
    stamp_sigma: float = 0.0
    """s, 1-sigma of times in the mean over 0.25 s, of samples taken neither evenly nor when stamped."""
    remarks: tuple[str, ...] = ()
    """Remarks of the reader for the user: signs inverted, rows skipped."""

    def __post_init__(self) -> None:
        """Escapes control characters in the names of a log, which reach terminals and file names.

        Raises `LogError` where a name is longer than any.
        """
        try:
            for name in ("name", "serial"):
                object.__setattr__(self, name, normal_name(getattr(self, name)))
        except ValueError as error:
            raise LogError(f"{str(self.source)[:LONGEST_NAME]}: states {error}; correct it") from error
        for name in ("name", "frame", "serial", "axes"):
            object.__setattr__(self, name, plain(getattr(self, name)))
        object.__setattr__(self, "remarks", tuple(map(plain, self.remarks)))

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Sentences on the units that neither log nor user states, and that something else may be."""
        return self.assumptions_but()

    def assumptions_but(self, *confirmed: Triad) -> tuple[str, ...]:
        """Returns those, but for the units of sensors whose readings something confirms."""
        units = {"accelerometer": self.accelerometer_unit, "gyroscope": self.gyroscope_unit}
        open_units = [unit for triad, unit in units.items() if triad not in confirmed]
        return tuple(unit.doubt for unit in (*open_units, self.time_unit) if unit.doubt)

    @classmethod
    def of_arrays(
        cls, name: str, *, serial: str = "", clock: str = "", triads: tuple[Triad, ...] = TRIADS
    ) -> Metadata:
        """Creates the metadata of arrays in SI units."""
        accelerometer, gyroscope, time = (
            ResolvedUnit(unit, 1.0, "arrays are SI") for unit in (*UNITS.values(), "s")
        )
        return cls(
            name, name, "arrays", accelerometer, gyroscope, time, serial=serial, clock=clock, triads=triads
        )

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels that were recorded."""
        recorded = (channel for triad in self.triads for channel in channels_of(triad))
        return tuple(channel for channel in recorded if channel not in self.missing)

    @property
    def in_memory(self) -> bool:
        """Returns whether the samples come from no file, so that `source` names none."""
        return self.format in ("arrays", "table")


@dataclass(frozen=True, slots=True)
class Recording:
    """A source of chunks, with metadata. It can be read more than once."""

    metadata: Metadata
    open: Callable[[], Iterator[Chunk]] = field(repr=False)
    """Starts a fresh pass over the samples."""
    parts: tuple[Recording, ...] = ()
    """One recording a pose, where the recording is a folder of such files."""
    read_magnetic: Callable[[], MagneticTrack] | None = field(default=None, repr=False)
    """Reads all of the magnetometer, in a pass of its own; None where the log has none."""
    files: tuple[Recording, ...] = field(default=(), repr=False)
    """The files of a folder, where parts, or the whole, may be joined from several; else empty."""

    @property
    def name(self) -> str:
        """Short name for tables and file names."""
        return self.metadata.name

    @property
    def has_magnetometer(self) -> bool:
        """Returns whether the log names a magnetometer, without reading it."""
        return self.read_magnetic is not None

    @property
    def magnetic(self) -> MagneticTrack | None:
        """Reads the magnetometer, all of it and each time anew; None where the log has none.

        Raises `LogError` where it cannot be read.
        """
        return None if self.read_magnetic is None else self.read_magnetic()

    def need_both_triads(self, purpose: str) -> None:
        """Raises `LogError`, in one line, where only one triad was recorded and `purpose` needs both."""
        if len(self.metadata.triads) < len(TRIADS):
            held = next(iter(self.metadata.triads), "magnetometer")
            raise LogError(
                f"{self.metadata.source}: holds {held} readings only; {purpose} needs "
                "accelerometer and gyroscope of one unit"
            )

    def chunks(self) -> Iterator[Chunk]:
        """Passes over all samples, chunk by chunk."""
        return self.open()

    @classmethod
    def from_arrays(
        cls,
        name: str,
        time: ArrayLike,
        accelerometer: ArrayLike | None,
        gyroscope: ArrayLike | None,
        temperature: ArrayLike | None = None,
        *,
        serial: str = "",
        clock: str = "",
        magnetic: MagneticTrack | None = None,
    ) -> Recording:
        """Wraps arrays in memory: time (n,) s, specific force (n, 3) m/s^2, angular rate (n, 3) rad/s.

        Lists, any kind of float, and columns of tables will do; dates become s since 1970. None is for a
        triad that was not recorded. `magnetic` is a magnetometer on the same clock, with times of its own.

        Raises `ArrayError` where they have other shapes, or hold no numbers.
        """
        given = {"accelerometer": accelerometer, "gyroscope": gyroscope}
        triads = tuple(triad for triad in TRIADS if given[triad] is not None)
        if not triads:
            raise ArrayError(
                "holds neither accelerometer nor gyroscope readings; give one of them", about=name
            )
        try:
            stamps = arrays.times(time)
            _refuse_useless_times(stamps)
            chunk = Chunk(
                stamps,
                arrays.triad_or_unknown(accelerometer, "accelerometer", len(stamps)),
                arrays.triad_or_unknown(gyroscope, "gyroscope", len(stamps)),
                None if temperature is None else arrays.column(temperature, "temperature"),
            )
        except ArrayError as error:
            raise ArrayError(error.why, about=name) from None
        metadata = Metadata.of_arrays(name, serial=serial, clock=clock, triads=triads)
        read_magnetic = None if magnetic is None else lambda: magnetic
        chunks = (chunk,) if len(chunk) else ()
        return cls(metadata, lambda: iter(chunks), read_magnetic=read_magnetic)

    @classmethod
    def from_magnetic(cls, name: str, magnetic: MagneticTrack, *, serial: str = "") -> Recording:
        """Wraps readings of a magnetometer alone: a recording without triads, and without chunks.

        A log that holds a magnetometer only is read as such by `open_recording(..., need_imu=False)`;
        `metadata.triads` is empty there. Procedures for an IMU open with `need_imu=True`, the default, which
        refuses such a log in one line.
        """
        metadata = Metadata.of_arrays(name, serial=serial, triads=())
        return cls(metadata, lambda: iter(()), read_magnetic=lambda: magnetic)

    def to_pandas(self) -> DataFrame:
        """Returns all samples as a data frame, which a procedure reads as it does a recording.

        Its index is time, s; `attrs["units"]` has the unit of each column. Raises `TumbleError` where pandas
        is not installed.
        """
        pandas = frames.library("pandas", "to_pandas() needs pandas", "take chunks()")
        samples = self._samples()
        columns: dict[str, FloatArray] = {
            channel: getattr(samples, triad)[:, axis]
            for triad in self.metadata.triads
            for axis, channel in enumerate(channels_of(triad))
        }
        units: dict[str, str] = {"time": "s"} | {
            channel: UNITS[triad] for triad in self.metadata.triads for channel in channels_of(triad)
        }
        if samples.temperature is not None:
            columns["temperature"], units["temperature"] = samples.temperature, "degC"
        frame: DataFrame = pandas.DataFrame(columns, index=pandas.Index(samples.time, name="time"))
        frame.attrs["units"] = units
        return frame

    def to_xarray(self) -> Dataset:
        """Returns all samples as a data set: `accelerometer` and `gyroscope` over `time`, s, and `axis`.

        Each variable states its unit. Raises `TumbleError` where xarray is not installed.
        """
        xarray = frames.library("xarray", "to_xarray() needs xarray", "take chunks()")
        samples = self._samples()
        variables: dict[str, Any] = {
            triad: (("time", "axis"), getattr(samples, triad), {"units": UNITS[triad]})
            for triad in self.metadata.triads
        }
        if samples.temperature is not None:
            variables["temperature"] = ("time", samples.temperature, {"units": "degC"})
        place = {"time": ("time", samples.time, {"units": "s"}), "axis": list("xyz")}
        dataset: Dataset = xarray.Dataset(variables, coords=place, attrs={"name": self.name})
        return dataset

    def _samples(self) -> Chunk:
        """Returns all samples in one piece."""
        chunks = list(self.chunks())
        if not chunks:
            return Chunk(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
        with_temperature = all(chunk.temperature is not None for chunk in chunks)
        return Chunk(
            np.concatenate([chunk.time for chunk in chunks]),
            np.concatenate([chunk.accelerometer for chunk in chunks]),
            np.concatenate([chunk.gyroscope for chunk in chunks]),
            np.concatenate([chunk.temperature for chunk in chunks]) if with_temperature else None,
        )

    def _repr_html_(self) -> str:
        from html import escape  # which no command needs

        about = self.metadata
        units = {"accelerometer": about.accelerometer_unit, "gyroscope": about.gyroscope_unit}
        facts = {"source": about.source, "format": about.format, "serial": about.serial or "not stated"}
        facts |= {
            triad: f"{unit.name} ({unit.reason})" for triad, unit in units.items() if triad in about.triads
        }
        rows = "".join(
            f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in facts.items()
        )
        return printable(f"<table><caption><b>{escape(self.name)}</b></caption>{rows}</table>")


def _refuse_useless_times(time: FloatArray) -> None:
    if infinite := int(np.isinf(time).sum()):
        raise ArrayError(f"time: is infinite in {infinite} of {len(time)} samples; leave them out")


class Table(Protocol):
    """Named columns in memory: of pandas, polars, xarray or pyarrow, or a mapping of arrays."""

    def __getitem__(self, name: Any, /) -> Any:  # noqa: ANN401 - such libraries type it in ways of their own
        """Returns the column of that name."""


RecordingSource: TypeAlias = Recording | str | Path | Table
"""A recording, or what names one, LOG or LOG:NAME for one IMU of several, or a table in memory."""


def named_columns(source: object) -> dict[Any, str] | None:
    """Returns the names of a table's columns, as text, by what picks each; None for what is no table."""
    if isinstance(source, str | Path | Recording):
        return None
    if isinstance(source, Mapping):
        found = list(source)
    else:
        # pyarrow names columns in one attribute and holds them in the other.
        names = getattr(source, "column_names", None)
        names = getattr(source, "columns", None) if names is None else names
        names = getattr(getattr(source, "dtype", None), "names", None) if names is None else names
        if names is None:
            return None
        found = list(names)
    return {
        name: "_".join(filter(None, map(str, name))) if isinstance(name, tuple) else str(name)
        for name in found
    }


def is_table(source: object) -> bool:
    """Returns whether a source has named columns."""
    return named_columns(source) is not None


def sources_of(given: RecordingSource | Sequence[RecordingSource]) -> list[RecordingSource]:
    """Lists what may be one source or several."""
    one = isinstance(given, str | Path | Recording) or not isinstance(given, Iterable) or is_table(given)
    return [cast("RecordingSource", given)] if one else list(cast("Sequence[RecordingSource]", given))
