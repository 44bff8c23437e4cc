"""Logs in: any file that holds IMU samples becomes a `Recording`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tumble.foundation.body_axes import in_words, turned
from tumble.foundation.debugging import debug
from tumble.foundation.errors import LogError
from tumble.foundation.file_status import is_file, is_folder
from tumble.foundation.log_formats import AXES_OF, BODY_OF, stem_of
from tumble.foundation.log_reading import CORRECTION, EARLIER
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import FloatArray, Metadata, Recording, RecordingSource, ResolvedUnit
from tumble.logs import formats, table
from tumble.logs.checks import ChunkStream
from tumble.logs.columns import recognise
from tumble.logs.conversion import (
    Conversion,
    case_from_log,
    check_counts,
    conversion_for,
    is_mirrored,
    notices_on_axes,
    without_time,
)
from tumble.logs.folder import log_files, open_folder
from tumble.logs.magnetometer import magnetic_track, without_imu
from tumble.logs.options import ReadOptions
from tumble.logs.silent_triads import without_silent_triads
from tumble.logs.spec import parse_spec
from tumble.logs.text import AFTER_LAST
from tumble.logs.track import LoggedImu, RawSamples, one_name
from tumble.logs.units import counts_from_1970, length_of_gravity, odd_step, usual_step
from tumble.logs.unread_columns import listed


def list_imus(path: str | Path, options: ReadOptions | None = None) -> tuple[str, ...]:
    """Returns the names that may follow `LOG:`; an IMU that needs no name has an empty one.

    Raises `LogError` where there is no such file, or no IMU in it.
    """
    path = parse_spec(path).path
    if is_folder(path) and formats.find_format(path) == formats.FOLDER:
        path = log_files(path)[0]
    return formats.list_imus(path, options or ReadOptions())


def open_recording(
    source: RecordingSource,
    options: ReadOptions | None = None,
    *,
    name: str = table.NAME,
    keep_faults: bool = False,
    need_imu: bool = True,
) -> Recording:
    """Opens a log: a file, a bag folder, or a folder with one log a pose; `LOG:NAME` picks one of its IMUs.

    A table in memory, such as a data frame, is read by the names of its columns as a file is, and is called
    `name`; a recording is given back as it is.

    The head of the log is read to decide its units; samples are read when `Recording.chunks` is called.
    With `keep_faults`, readings that are no numbers and time that runs backwards are passed on to whoever
    judges them; where a table holds several IMUs, a row without any number of this one is no sample of it.
    `Recording.magnetic` has the magnetometer beside the IMU. With `need_imu=False`, a log of a magnetometer
    alone is read too: its metadata has no triads, it has no chunks, and `Recording.magnetic` is all it has.

    Raises `LogError`, in one line: what is wrong, where, and what to do.
    """
    options = options or ReadOptions()
    if not need_imu:
        options = replace(options, need_imu=False)
    if isinstance(source, Recording):
        return source
    if not isinstance(source, str | Path):
        return _recording(table.open_logged_imu(source, name, options), options, keep_faults)
    spec = parse_spec(source)
    imu = one_name(spec.path, spec.imu, options.topic)
    if is_folder(spec.path) and formats.find_format(spec.path) == formats.FOLDER:
        return _open_folder(spec.path, imu, options)
    return _open_file(spec.path, imu, options, keep_faults)


def _open_folder(folder: Path, imu: str | None, options: ReadOptions) -> Recording:
    """Opens a folder of poses; what one pose shows of the gyroscope's unit holds for all."""
    recording = open_folder(folder, lambda path: _open_file(path, imu, options, alone=False))
    if options.accelerometer_scale is not None and "accelerometer" in recording.metadata.triads:
        check_counts(str(folder), _gravity_of(recording.files))
    units = {part.metadata.gyroscope_unit.name for part in recording.files}
    if len(units) > 1:
        stated = replace(options, gyroscope_unit="deg/s")
        recording = open_folder(folder, lambda path: _open_file(path, imu, stated, alone=False))
    return recording


def _gravity_of(poses: Sequence[Recording]) -> float:
    """Returns the length of gravity that poses show together, m/s^2."""
    return length_of_gravity(np.array([next(pose.chunks()).accelerometer.mean(axis=0) for pose in poses]))


def _open_file(
    path: Path, imu: str | None, options: ReadOptions, keep_faults: bool = False, *, alone: bool = True
) -> Recording:
    return _recording(formats.open_logged_imu(path, imu, options), options, keep_faults, alone=alone)


def _recording(track: LoggedImu, options: ReadOptions, keep_faults: bool, *, alone: bool = True) -> Recording:
    if options.undo_correction and not track.undone and track.already_corrected is not False:
        raise LogError(
            f"{track.source}: --undo-correction: it does not state how it was corrected; logs of PX4 and "
            "ArduPilot do"
        )
    if not track.triads:
        track = without_imu(track)
    head = track.head()
    track = without_silent_triads(track, head)
    if options.rate is not None:
        if not 0.0 < options.rate < math.inf:
            raise LogError(f"--rate {options.rate:g}: needs to be a number above zero")
        head = without_time(head)
    rate = options.rate if options.rate is not None else track.rate
    if head.time is None and rate is None and track.triads:
        raise LogError(_no_time(track))
    conversion = conversion_for(track, options, head, track.triads, track.expected, alone=alone)
    dated = head.time is not None and counts_from_1970(head.time * conversion.time_scale)
    odd = () if head.time is None else _odd_step(head.time, conversion.time_unit)
    _say_how_it_is_read(track, conversion, rate)
    return Recording(
        _metadata(track, conversion, options, rate, odd),
        lambda: _stream(track, conversion, options, rate, keep_faults, dated) if track.triads else iter(()),
        read_magnetic=_reader_of_magnetometer(track, options, rate, conversion.time_scale),
    )


def _reader_of_magnetometer(
    track: LoggedImu, options: ReadOptions, rate: float | None, time_scale: float
) -> Callable[[], MagneticTrack] | None:
    magnetometer = track.magnetometer
    if magnetometer is None:
        return None
    return lambda: magnetic_track(track.source, magnetometer, options, rate, time_scale)


def _say_how_it_is_read(track: LoggedImu, conversion: Conversion, rate: float | None) -> None:
    units = (conversion.accelerometer_unit, conversion.gyroscope_unit, conversion.time_unit)
    read = ", ".join(f"{unit.name} ({unit.reason})" for unit in units)
    debug(__name__, "%s: %s, %s in %s", track.source, track.format, " and ".join(track.triads), read)
    if rate is not None:
        debug(__name__, "%s: states %g Hz", track.source, rate)


def _stream(
    track: LoggedImu,
    conversion: Conversion,
    options: ReadOptions,
    rate: float | None,
    keep_faults: bool,
    dated: bool,
) -> ChunkStream:
    def transform(samples: RawSamples) -> RawSamples:
        return conversion(samples if options.rate is None else without_time(samples))

    guessed = conversion.gyroscope_unit.is_guessed_radians
    pieces = track.read(transform)
    return ChunkStream(track, pieces, rate, guessed, keep_faults, options.skip_bad_lines, dated)


def _no_time(track: LoggedImu) -> str:
    if not track.columns:
        return f"{track.path}: holds no time; give the sample rate with --rate, in Hz"
    return (
        f"{track.path}: no column is known to be time; columns found: {listed(track.columns)}; name it with "
        "--columns time=NAME, or give the sample rate with --rate, in Hz"
    )


def _odd_step(time: FloatArray, unit: ResolvedUnit) -> tuple[str, ...]:
    """Reports a distance of samples that no IMU has."""
    odd = odd_step(usual_step(time) * unit.scale)
    if not odd:
        return ()
    return (
        f"{odd}: time was read in {unit.name} ({unit.reason}); give its unit with --time-unit, or its column "
        "with --columns time=NAME",
    )


def _unread(track: LoggedImu, options: ReadOptions) -> tuple[str, ...]:
    """Returns the columns of a table that neither their names nor the user explain."""
    stated = set(options.columns.values())
    places = enumerate(track.columns, start=1)
    return tuple(
        name
        for number, name in places
        if name and recognise(name) is None and not stated & {name, str(number)} and name != AFTER_LAST
    )


def _on_temperature(conversion: Conversion) -> Iterator[str]:
    yield from filter(None, (conversion.temperature_fault, conversion.temperature_remark))


def _metadata(
    track: LoggedImu, conversion: Conversion, options: ReadOptions, rate: float | None, odd: tuple[str, ...]
) -> Metadata:
    as_logged = not notices_on_axes(replace(options, accelerometer_sign=1))
    corrected = {CORRECTION: track.correction or EARLIER} if track.already_corrected else {}
    counted = {"accelerometer": conversion.accelerometer_unit, "gyroscope": conversion.gyroscope_unit}
    # A scale may be of a unit that the log states.
    units = {f"{triad}_unit": unit.per for triad, unit in counted.items() if unit.per}
    body = _body(BODY_OF.get(track.format, ""), options.axes)
    return Metadata(
        name=_name(track),
        source=track.source,
        format=track.format,
        accelerometer_unit=conversion.accelerometer_unit,
        gyroscope_unit=conversion.gyroscope_unit,
        time_unit=conversion.time_unit,
        frame=track.frame,
        axes=AXES_OF.get(track.format, "") if as_logged else in_words(body) if body else "",
        body=body,
        clock=track.clock if options.rate is None else "",
        rate=rate,
        already_corrected=track.already_corrected,
        reading=options.reading | units | corrected,
        serial=options.serial or track.serial,
        triads=track.triads,
        temperature_fault=conversion.temperature_fault,
        unread=_unread(track, options),
        alone=track.alone,
        pace_sigma=track.pace_sigma if options.rate is None else 0.0,
        remarks=(*track.notices, *notices_on_axes(options), *_on_temperature(conversion), *odd),
    )


def _body(logged: str, axes: str) -> str:
    """Returns the directions of the case axes; unknown where those of the log are, or were left-handed."""
    return turned(logged, case_from_log(axes)) if logged and not is_mirrored(axes) else ""


def _name(track: LoggedImu) -> str:
    """Short name: the file's, and the IMU's where the file needs one."""
    if track.name:
        return track.name
    stem = stem_of(track.path) if is_file(track.path) else track.path.name
    imu = "" if track.alone else track.imu.strip("/").replace("/", "_")
    return f"{stem}-{imu}" if imu else stem
