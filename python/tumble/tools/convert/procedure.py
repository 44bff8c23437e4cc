"""Write a log in another format: time of the sensor before that of arrival, SI units, plain names."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from tumble.foundation.arrival import ArrivalWatch
from tumble.foundation.errors import LogError, OutputError
from tumble.foundation.file_names import file_stem
from tumble.foundation.file_status import path_of
from tumble.foundation.log_reading import CORRECTION
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Chunk, Recording, SampleProgress
from tumble.foundation.timing import TimeWatch
from tumble.foundation.units import TRIADS
from tumble.foundation.words import count_of, join, plain
from tumble.logs import ChunkStream, Facts, ReadOptions, open_mcap_writer, open_recording, open_writer
from tumble.logs.formats import FOLDER, find_format
from tumble.logs.magnetic_rows import MagneticRows
from tumble.logs.reading import list_imus
from tumble.logs.spec import files_of, parse_spec
from tumble.tools.convert.result import Converted, ConvertedImu

if TYPE_CHECKING:
    from tumble.logs.writer import Writer
    from tumble.logs.writer_mcap import McapWriter

EUROC = "euroc"
TARGETS = ("csv", "parquet", "mcap", EUROC)
"""Formats that can be written."""
_BEFORE = "before it was converted"
"""Source of the correction of a log where it is unknown."""
_LACKS = {
    "csv": ("frame",),
    "parquet": ("frame",),
    "mcap": (),
    EUROC: ("magnetometer", "temperature", "serial number", "frame", "time of recording", "correction"),
}
"""Quantities that a target cannot hold."""


@dataclass(frozen=True, slots=True)
class _Place:
    """Where one IMU is written."""

    path: Path
    write: Callable[[Chunk], None]
    name: str = ""
    """Name after `LOG:` in the new file; empty where it needs no name."""
    lacks: tuple[str, ...] = ()
    """Quantities that it cannot hold, besides those that no file of the target can."""
    magnetic: MagneticRows | None = None
    """Rows that the readings of a magnetometer are put in."""


OpenPlace: TypeAlias = Callable[[str, Chunk], _Place]
"""Opens the place of an IMU, by its name in the log and its first samples."""


@dataclass(slots=True)
class _Imu:
    """One IMU on its way."""

    name: str
    recording: Recording
    place: _Place
    stream: Iterator[Chunk]
    chunk: Chunk | None
    """Chunk to be written next."""
    time: TimeWatch
    arrival: ArrivalWatch
    lost: tuple[str, ...]
    """Quantities in the log that the target cannot hold."""

    def advance(self) -> None:
        """Writes what is next, and reads on."""
        chunk = self.chunk
        assert chunk is not None
        self.place.write(chunk)
        self.time.push(chunk.time)
        if chunk.received is not None:
            self.arrival.push(chunk.time, chunk.received)
        self.chunk = next(self.stream, None)


def convert(
    log: str | Path,
    output: str | Path,
    *,
    to: str | None = None,
    imus: Sequence[str] = (),
    read: ReadOptions | None = None,
    progress: SampleProgress | None = None,
) -> Converted:
    """Writes a log, all its IMUs or those named, as `to`; memory does not grow with its length.

    `to` is `csv`, `parquet`, `mcap` or `euroc`, else the extension of `output` decides. Several IMUs are
    topics of one MCAP file, or folders of one EuRoC folder; of tables each is a file, `OUT-NAME.csv`.
    Written are s, m/s^2, rad/s and degC; the time is that of the sensor where the log has it, that of
    recording is kept beside it but in EuRoC.

    Raises `LogError` where the log cannot be read to its end or holds no such IMU, `OutputError` where
    `output` cannot be written; what was there before is then untouched.
    """
    output, log = path_of(output, "the file to write"), str(path_of(log, "a log"))
    target = _target(output, to)
    names = _names(log, imus, read)
    recordings = {name: _open(log, name, read) for name in names}
    for recording in recordings.values():
        if target in ("mcap", EUROC):
            recording.need_both_triads(f"{target}, whose messages and rows hold both,")
    with ExitStack() as stack:
        found = list(_opened(stack, recordings, output, target))
        _write(found, progress)
    converted = tuple(_concluded(each, target) for each in found)
    if target == EUROC:
        _write_sensors(found, converted)
    return Converted(str(log), target, converted)


def _target(output: Path, to: str | None) -> str:
    wanted = (to or output.suffix.removeprefix(".")).lower()
    if wanted not in TARGETS:
        raise OutputError(
            f"{output}: cannot write {wanted if wanted.isalnum() else 'a name without an extension'}; "
            f"give --format with one of {', '.join(TARGETS)}"
        )
    return wanted


def _names(log: str | Path, imus: Sequence[str], read: ReadOptions | None) -> tuple[str, ...]:
    """Lists the IMUs to write: those named, the one behind the colon, or all."""
    spec = parse_spec(log)
    topic = None if read is None else read.topic
    named = tuple(dict.fromkeys(filter(None, (spec.imu, topic, *imus))))
    if spec.imu and len(named) > 1:
        raise LogError(f"{log}: {join(named)} name IMUs twice over; give them with --imu alone")
    if named:
        return named
    return ("",) if find_format(spec.path) == FOLDER else list_imus(spec.path, read)


def _open(log: str | Path, name: str, read: ReadOptions | None) -> Recording:
    spec = parse_spec(log)
    already = read is not None and read.topic == name
    return open_recording(f"{spec.path}:{name}" if name and not already else spec.path, read)


def _opened(stack: ExitStack, recordings: dict[str, Recording], output: Path, target: str) -> Iterator[_Imu]:
    """Opens what each IMU is written to; the files take their places when `stack` ends without an error."""
    open_place = _PLACES.get(target, _tables)(stack, recordings, output, target)
    for name, recording in recordings.items():
        stream = recording.chunks()
        first = next(stream, None)
        if first is None:
            raise LogError(f"{recording.metadata.source}: holds no samples")
        place = open_place(name, first)
        held = _held(recording, first)
        lost = tuple(what for what in (*_LACKS[target], *place.lacks) if what in held)
        yield _Imu(name, recording, place, stream, first, TimeWatch(), ArrivalWatch(), lost)


def _folders(stack: ExitStack, recordings: dict[str, Recording], output: Path, _target: str) -> OpenPlace:
    """Returns each IMU a folder of one EuRoC folder."""
    from tumble.logs.writer_euroc import open_euroc_writer

    folders = {name: output / "mav0" / f"imu{number}" for number, name in enumerate(recordings)}
    inputs = _inputs(recordings)

    def open_place(name: str, _first: Chunk) -> _Place:
        writer = stack.enter_context(open_euroc_writer(folders[name], inputs))
        return _Place(folders[name], writer.write)

    return open_place


def _topics(stack: ExitStack, recordings: dict[str, Recording], output: Path, _target: str) -> OpenPlace:
    """Returns each of several IMUs a topic of one MCAP file, which states the facts common to all of them."""
    inputs = _inputs(recordings)

    def opened(facts: Facts) -> McapWriter:
        return stack.enter_context(open_mcap_writer(output, facts, inputs=inputs))

    def place_in(writer: McapWriter, imu: str, topic: str, lacks: tuple[str, ...] = ()) -> _Place:
        frame = recordings[imu].metadata.frame
        magnetic = _MagneticTopic(writer, recordings[imu].magnetic, topic, frame)
        stack.callback(magnetic.finish)

        def write(chunk: Chunk) -> None:
            writer.write(chunk, topic, chunk.received, frame)
            magnetic.follow(chunk)

        return _Place(output, write, topic, lacks)

    if len(recordings) == 1:
        return lambda name, first: place_in(opened(_facts(recordings[name], first)), name, "")
    common = _common_facts(recordings)
    together, lacks = opened(common), tuple(_untold(common))
    return lambda name, _first: place_in(together, name, name.strip("/"), lacks)


def _in_rows(writer: Writer, magnetic: MagneticRows | None) -> Callable[[Chunk], None]:
    """Returns the function that writes samples, with the readings of the magnetometer in their rows."""
    return writer.write if magnetic is None else lambda chunk: writer.write(magnetic.beside(chunk))


class _MagneticTopic:
    """Writes the readings of a magnetometer just after the samples in whose time they came."""

    def __init__(self, writer: McapWriter, track: MagneticTrack | None, topic: str, frame: str) -> None:
        self._writer, self._track, self._topic, self._frame = writer, track, topic, frame
        self._given = 0

    def follow(self, chunk: Chunk) -> None:
        """Writes the readings until the last of these samples."""
        if self._track is None:
            return
        end = int(np.searchsorted(self._track.time, chunk.time[-1], side="right"))
        self._write(max(end, self._given))

    def finish(self) -> None:
        """Writes the readings after the last sample."""
        if self._track is not None:
            self._write(len(self._track))

    def _write(self, end: int) -> None:
        assert self._track is not None
        self._writer.write_magnetic(self._track.chosen(slice(self._given, end)), self._topic, self._frame)
        self._given = end


def _tables(stack: ExitStack, recordings: dict[str, Recording], output: Path, target: str) -> OpenPlace:
    """Returns each IMU a table, a file of its own."""
    inputs = _inputs(recordings)

    def open_place(name: str, first: Chunk) -> _Place:
        path = _one_of_several(output, name) if len(recordings) > 1 else output
        track = recordings[name].magnetic
        magnetic = None if track is None else MagneticRows(track)
        facts = _facts(recordings[name], first, further=True)
        if magnetic is not None:
            facts = replace(facts, further=(*magnetic.columns, *facts.further))
        writer = stack.enter_context(open_writer(path, target, facts, inputs=inputs))
        return _Place(path, _in_rows(writer, magnetic), magnetic=magnetic)

    return open_place


_PLACES = {EUROC: _folders, "mcap": _topics}
"""Functions that open the places of a target; a target that is not listed is a table."""


def _inputs(recordings: dict[str, Recording]) -> tuple[Path, ...]:
    return tuple(path for each in recordings.values() for path in files_of(each))


def _one_of_several(output: Path, name: str) -> Path:
    return output.with_name(f"{output.stem}-{file_stem(name.strip('/').replace('/', '_'))}{output.suffix}")


def _facts(recording: Recording, first: Chunk, *, further: bool = False) -> Facts:
    metadata = recording.metadata
    return Facts(
        metadata.frame,
        metadata.serial,
        metadata.reading.get(CORRECTION, _BEFORE) if metadata.already_corrected else "",
        metadata.triads,
        ("received",) if further and first.received is not None else (),
    )


def _common_facts(recordings: dict[str, Recording]) -> Facts:
    """Returns the facts that one MCAP file states of all its IMUs."""
    serials = {each.metadata.serial for each in recordings.values()}
    corrected = all(each.metadata.already_corrected for each in recordings.values())
    serial = serials.pop() if len(serials) == 1 else ""
    return Facts("case", serial, _BEFORE if corrected else "", TRIADS)


def _untold(common: Facts) -> Iterator[str]:
    """Describes differences between IMUs that one file cannot hold."""
    if not common.serial:
        yield "serial number"
    if not common.corrected:
        yield "correction"


def _held(recording: Recording, first: Chunk) -> set[str]:
    metadata = recording.metadata
    holds = {
        "temperature": first.temperature is not None,
        "serial number": bool(metadata.serial),
        "frame": metadata.frame != "case",
        "time of recording": first.received is not None,
        "correction": bool(metadata.already_corrected),
        "magnetometer": recording.has_magnetometer,
    }
    return {what for what, held in holds.items() if held}


def _write(imus: Sequence[_Imu], progress: SampleProgress | None) -> None:
    """Writes all side by side, what is earliest first."""
    lengths = [each.stream.expected for each in imus if isinstance(each.stream, ChunkStream)]
    expected = None if None in lengths or len(lengths) < len(imus) else sum(filter(None, lengths))
    done = 0
    while waiting := [each for each in imus if each.chunk is not None]:
        earliest = min(waiting, key=_begin)
        assert earliest.chunk is not None
        done += len(earliest.chunk)
        earliest.advance()
        if progress is not None:
            progress(done, expected)


def _begin(imu: _Imu) -> float:
    assert imu.chunk is not None
    return float(imu.chunk.time[0])


def _concluded(imu: _Imu, target: str) -> ConvertedImu:
    interval = imu.time.interval
    return ConvertedImu(
        imu.name,
        imu.place.path,
        imu.place.name,
        imu.time.samples,
        1.0 / interval if interval > 0.0 else float("nan"),
        imu.time.jitter,
        imu.arrival.conclude(),
        tuple(_remarks(imu, target)),
        imu.recording.metadata.axes,
    )


def _remarks(imu: _Imu, target: str) -> Iterator[str]:
    metadata = imu.recording.metadata
    yield from metadata.remarks
    if isinstance(imu.stream, ChunkStream):
        yield from imu.stream.counts.notices()
    yield from metadata.assumptions
    if imu.lost:
        yield f"{target} has no place for its {join(imu.lost)}: kept in the log alone"
    if imu.place.magnetic is not None and (left := imu.place.magnetic.left):
        yield (
            f"{count_of('reading', left)} of the magnetometer found no row: they came after the last sample, "
            "or faster than samples"
        )
    if target in ("mcap", EUROC):
        yield "stamps are whole nanoseconds"


def _write_sensors(imus: Sequence[_Imu], converted: Sequence[ConvertedImu]) -> None:
    from tumble.logs.writer_euroc import write_sensor

    for imu, done in zip(imus, converted, strict=True):
        write_sensor(imu.place.path, f"converted from {plain(imu.recording.metadata.source)}", done.rate)
