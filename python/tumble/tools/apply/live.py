"""Correct samples while they come."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from tumble.calibration.document import Calibration
from tumble.calibration.doubts import doubts
from tumble.calibration.temperature_counts import TemperatureCounts
from tumble.foundation import clock
from tumble.foundation.errors import LogError, ProcedureError
from tumble.foundation.log_reading import CORRECTION, EARLIER, LogReading
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of
from tumble.live import FIRST_SAMPLE_WITHIN, LiveChunk, Source, nothing_came
from tumble.live.host_clock import DelayCounts
from tumble.live.outputs import Output
from tumble.logs import Facts
from tumble.logs.writer import Writer
from tumble.tools.apply.magnetic import warnings_on_magnetometer
from tumble.tools.apply.procedure import misuses_of, warnings_on


@dataclass(frozen=True, slots=True)
class LiveApplied:
    """Summary of the corrected samples at the end of the stream."""

    samples: int
    delays: DelayCounts
    """s from the arrival of samples to when they were on their way, corrected."""
    warnings: tuple[str, ...]
    """Warnings for the user of the samples."""


class LiveApply:
    """Corrects what a source gives, and hands it to an output: `run`, within the source.

    `serial` is that of the unit, where the source does not state it, `reading` how its samples are read.
    `force` is as for `apply`.

    Raises `ProcedureError` where the calibration is of another unit, or the samples are corrected already.
    """

    def __init__(
        self,
        calibration: Calibration,
        source: Source,
        output: Output,
        *,
        serial: str = "",
        reading: LogReading | None = None,
        force: bool = False,
    ) -> None:
        self._calibration = calibration
        self._source = source
        self._output = output
        self._serial = serial or getattr(source, "serial", "")
        corrected = getattr(source, "already_corrected", None)
        self._temperatures = TemperatureCounts(calibration)
        self._samples, self._delays = 0, DelayCounts()
        self._track: MagneticTrack | None = None
        """Latest readings of the magnetometer; None before the first."""
        read = {**(reading or {}), **({CORRECTION: EARLIER} if corrected else {})}
        self._misuses = tuple(misuses_of(calibration, serial=self._serial, reading=read))
        if self._misuses and not force:
            raise ProcedureError(
                f"{self._misuses[0]}; give what was measured and the calibration of its unit, or --force",
                about=source.name,
            )

    def run(self, is_over: Callable[[], bool] = lambda: False) -> LiveApplied:
        """Continues until the source ends or `is_over` returns true; it is asked every `HEARTBEAT` at least.

        Raises `LogError` where nothing comes or the source is lost, what came before being kept, and
        `OutputError` where the output takes no more.
        """
        facts = Facts(
            serial=self._serial or self._calibration.serial,
            corrected=f"sha256:{self._calibration.hash()}",
            doubts=tuple(doubts(self._calibration)),
        )
        lost: LogError | None = None
        with self._output.open(facts) as writer:
            try:
                self._correct(writer, is_over)
            except LogError as error:
                if self._samples == 0:
                    raise
                # The output ends as it would have without, so that a file holds what came before.
                lost = error
        if lost is not None:
            kept = f"{count_of('sample', self._samples)} before that corrected: {self._output.name}"
            raise LogError(f"{lost}; {kept}") from lost
        return LiveApplied(self._samples, self._delays, self._warnings())

    def _correct(self, writer: Writer, is_over: Callable[[], bool]) -> None:
        began = clock.now()
        for chunk in self._source:
            if is_over():
                return
            if len(chunk):
                self._temperatures.add(len(chunk), chunk.temperature)
                accelerometer, gyroscope = self._calibration.correct(
                    chunk.accelerometer, chunk.gyroscope, chunk.temperature
                )
                field = self._corrected_field(chunk)
                writer.write(replace(chunk, accelerometer=accelerometer, gyroscope=gyroscope, field=field))
                self._samples += len(chunk)
                if chunk.arrival is not None:
                    self._delays.add([clock.now() - chunk.arrival])
            elif not self._samples and clock.now() - began > FIRST_SAMPLE_WITHIN:
                raise nothing_came(self._source.name)

    def _corrected_field(self, chunk: LiveChunk) -> FloatArray | None:
        """Returns the field without the calibrated errors; None where the source has no magnetometer."""
        if chunk.field is None:
            return None
        self._track = chunk.magnetic or self._track
        return self._calibration.correct_magnetic(chunk.field, temperature=chunk.temperature)

    def _warnings(self) -> tuple[str, ...]:
        known = warnings_on(self._calibration, what="source", name=self._source.name, serial=self._serial)
        of_source = map("the source {}".format, self._misuses)
        magnetic = warnings_on_magnetometer(self._calibration, self._track, what="source")
        return (*of_source, *known, *magnetic, *self._temperatures.notices(), *self._source.remarks)
