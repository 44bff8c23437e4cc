"""Correct a recording with a calibration, chunk by chunk."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tumble.calibration.document import Calibration
from tumble.calibration.doubts import doubts
from tumble.calibration.temperature_counts import TemperatureCounts
from tumble.calibration.turned_axes import in_axes, on_axes
from tumble.foundation.errors import ProcedureError
from tumble.foundation.file_status import path_of
from tumble.foundation.log_reading import (
    CORRECTION,
    EARLIER,
    LogReading,
    corrected_alike,
    read_otherwise,
)
from tumble.foundation.recording import Recording, RecordingSource, SampleProgress
from tumble.foundation.serials import are_of_two
from tumble.foundation.units import TRIADS, Triad
from tumble.foundation.words import count_of
from tumble.logs import ChunkStream, Facts, ReadOptions, open_recording
from tumble.logs.spec import files_of
from tumble.logs.writer_with_field import open_writer_with_field
from tumble.tools.apply.magnetic import corrected_magnetometer, warnings_on_magnetometer


@dataclass(frozen=True, slots=True)
class Applied:
    """A corrected log."""

    path: Path
    samples: int
    """Samples written."""
    warnings: tuple[str, ...]
    """Warnings for the user of the corrected recording."""

    def __repr__(self) -> str:
        head = f"Applied({count_of('sample', self.samples)} to {self.path})"
        return "\n".join([head, *map("  {}".format, self.warnings)])


def apply(
    calibration: Calibration | str | Path,
    recording: RecordingSource,
    output: Path | str,
    *,
    format_name: str | None = None,
    read: ReadOptions | None = None,
    force: bool = False,
    progress: SampleProgress | None = None,
) -> Applied:
    """Writes a recording, corrected, to `output`, in SI units; memory does not grow with its length.

    `read` holds the options of reading a log. `format_name` is `csv`, `parquet` or `mcap`, else the extension
    of `output` decides. `progress` receives the samples done, and those expected where they are known.
    `force` turns it into a warning that the calibration is of another unit, or that the log was corrected
    before.

    Raises `ProcedureError` for either of these, `LogError` where the recording cannot be read to its end,
    `OutputError` where `output` cannot be written; what was there before is then untouched.
    """
    output = path_of(output, "the log to write")
    given = calibration if isinstance(calibration, Calibration) else Calibration.load(calibration)
    recording = open_recording(recording, read)
    metadata = recording.metadata
    calibration = in_axes(given, metadata.body)
    track = corrected_magnetometer(calibration, recording)
    of_magnetometer = calibration.magnetometer is not None and track is not None and track.already_corrected
    corrected = {CORRECTION: EARLIER} if of_magnetometer else {}
    misuses = tuple(misuses_of(calibration, serial=metadata.serial, reading=corrected | {**metadata.reading}))
    if misuses and not force:
        raise ProcedureError(
            f"{misuses[0]}; give the log as recorded and read as that of the calibration of its unit, or "
            "--force",
            about=metadata.source,
        )
    _refuse_without_force(calibration, recording)
    serial = metadata.serial or calibration.serial
    facts = Facts(
        metadata.frame,
        serial,
        f"sha256:{given.hash()}",
        metadata.triads,
        doubts=tuple(doubts(calibration)),
    )
    samples = 0
    temperatures = TemperatureCounts(calibration, metadata.triads)
    stream = recording.chunks()
    expected = stream.expected if isinstance(stream, ChunkStream) else None
    with open_writer_with_field(output, format_name, facts, track, inputs=files_of(recording)) as write:
        for chunk in stream:
            temperatures.add(len(chunk), chunk.temperature)
            accelerometer, gyroscope = calibration.correct(
                chunk.accelerometer, chunk.gyroscope, chunk.temperature
            )
            write(replace(chunk, accelerometer=accelerometer, gyroscope=gyroscope))
            samples += len(chunk)
            if progress is not None:
                progress(samples, expected)
    left_out = stream.counts.notices() if isinstance(stream, ChunkStream) else ()
    warnings = warnings_on(
        calibration, what="log", name=metadata.name, serial=metadata.serial, triads=metadata.triads
    )
    of_log = map("the log {}".format, misuses)
    of_thermometer = filter(None, (metadata.temperature_fault,))
    magnetic_warnings = warnings_on_magnetometer(calibration, track)
    return Applied(
        output,
        samples,
        (
            *of_log,
            *on_axes(given, metadata.body),
            *metadata.assumptions,
            *of_thermometer,
            *warnings,
            *magnetic_warnings,
            *temperatures.notices(),
            *left_out,
        ),
    )


def _refuse_without_force(calibration: Calibration, recording: Recording) -> None:
    """Raises `ProcedureError` where the gyroscope is corrected by specific force that was not recorded."""
    gyroscope = calibration.gyroscope
    if gyroscope and gyroscope.g_sensitivity is not None and "accelerometer" not in recording.metadata.triads:
        raise ProcedureError(
            "holds no accelerometer readings, which this calibration of the gyroscope needs for its "
            "g-sensitivity; give a log with both, or a calibration without",
            about=recording.metadata.source,
        )


def misuses_of(calibration: Calibration, *, serial: str, reading: LogReading) -> Iterator[str]:
    """Describes misuses that make corrected samples worse than raw ones of the unit of that serial number.

    `reading` is how its samples were read.
    """
    known = calibration.log_reading
    if not corrected_alike(reading, known):
        yield (
            "was corrected already"
            if reading.get(CORRECTION)
            else "was not corrected before, as that of the calibration was"
        )
    yield from read_otherwise(reading, known, "that of the calibration")
    if are_of_two(calibration.serial, serial):
        yield f"is of unit {serial}, the calibration of unit {calibration.serial}"


def _is_spin(calibration: Calibration) -> bool:
    """Returns whether the procedure estimates nothing but bias, so that no more is expected of it."""
    return calibration.method is not None and calibration.method.procedure == "spin"


def warnings_on(
    calibration: Calibration, *, what: str, name: str, serial: str, triads: Sequence[Triad] = TRIADS
) -> tuple[str, ...]:
    """Describes parts of `what`, a log or a source, that the calibration does not correct."""
    warnings = [f"{doubt}; what is corrected with it is no better" for doubt in doubts(calibration)]
    if calibration.name != name and not (calibration.serial and serial):
        silent = what if calibration.serial else "calibration"
        warnings.append(
            f"whether the {what} {name} is of the unit of the calibration, {calibration.name}, is not "
            f"known: the {silent} has no serial number"
        )
    for name, triad in (("accelerometer", calibration.accelerometer), ("gyroscope", calibration.gyroscope)):
        if name not in triads:
            continue
        if triad is None:
            warnings.append(f"the calibration has no {name} section; the {name} is left as measured")
        elif "matrix" not in triad.estimated and triad.estimated and not _is_spin(calibration):
            warnings.append(f"the calibration of the {name} has only its bias")
    return tuple(warnings)
