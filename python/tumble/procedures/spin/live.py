"""The spin procedure on a live stream: the device's own state machine, fed as samples come."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, cast

import numpy as np

from tumble import _core
from tumble.acquisition.acquire import refuse_if_misread, rests_of, trace_of
from tumble.acquisition.repetitions import frozen_stretches
from tumble.calibration.document import Calibration
from tumble.calibration.start import calibration_of
from tumble.foundation import clock
from tumble.foundation.errors import LogError, ProcedureError
from tumble.foundation.log_reading import LogReading
from tumble.foundation.log_time import UNKNOWN_TIME, LogTime
from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.results import Precision, Rest
from tumble.foundation.words import LISTENING, Listening
from tumble.live import FIRST_SAMPLE_WITHIN, LiveChunk, Source, nothing_came
from tumble.procedures.spin.combination import combine
from tumble.procedures.spin.failure import SpinFailure, SpinFailureKind
from tumble.procedures.spin.machine import LiveSpinOptions as LiveSpinOptions  # where users look for it
from tumble.procedures.spin.machine import SpinMachine
from tumble.procedures.spin.messages import explain
from tumble.procedures.spin.procedure import scale_warning
from tumble.procedures.spin.result import SpinResult
from tumble.procedures.spin.segments import alike_rests

LiveStepKind: TypeAlias = Literal[
    Listening, "turning first", "still began", "still broken", "still done", "spin began", "progress", "done"
]
Pace = Literal["none", "too slow", "good", "too fast"]

PATIENCE = 2.0
"""s without a sample after which a stream is taken to have stopped; radio links stall for less."""
TOO_SLOW, TOO_FAST = 0.5, 1.5
"""Limits of the rate over the requested one, beyond which the user is warned."""
BETWEEN_PROGRESS = 0.1
"""s of the stream between two reports of progress."""
TURNED_FIRST = math.tau
"""rad that a robot turns before it has stood still, after which a message reports it."""
SLOWEST_TURN = 0.3
"""rad/s: no usable gyroscope reads more at rest."""
MISREAD_RATE = 10.0
"""Times the rate asked for beyond which an assumed unit is wrong: deg/s for rad/s are 57 times as fast."""


@dataclass(frozen=True, slots=True)
class SpinStep:
    """Latest event, and the progress of the procedure."""

    kind: LiveStepKind
    time: float | None
    """s of the stream's clock; None while no sample has come."""
    state: str
    """`still` while the robot is to stand, `spin` while it is to turn, then `done` or `failed`."""
    progress: _core.SpinProgress
    pace: Pace
    """Pace of the turn against the requested rate; `none` while the robot stands or is to stand."""


@dataclass(slots=True)
class _Silence:
    """Duration without samples, by the clock on the wall."""

    since: float = field(default_factory=clock.now)

    def end(self) -> None:
        self.since = clock.now()

    @property
    def length(self) -> float:
        return clock.now() - self.since


class LiveSpin:
    """One run of the procedure: exhaust `steps`, then ask for the `result`.

    A workstation has f64 and so uses it: nothing is lost by it, and what is found differs from the f32 of a
    device by far less than its sigma. `precision` shows what the device would find. `typed` is what the user
    called the source, `serial` the serial number of the unit; a `calibration` is applied first. `reading`
    are the options by which samples are read.
    """

    def __init__(
        self,
        source: Source,
        options: LiveSpinOptions | None = None,
        *,
        typed: str = "",
        serial: str = "",
        calibration: Calibration | None = None,
        reading: LogReading | None = None,
        precision: Precision = "f64",
    ) -> None:
        self._source = source
        self._typed = typed or source.name
        self._serial = serial
        self._reading = reading or {}
        applied = calibration_of(calibration, serial, self._reading, about=source.name)
        self._machine = SpinMachine(options, calibration=applied, precision=precision)
        self._options = self._machine.options
        self._segmenter = _core.Segmenter()
        self._acquired: _core.Acquired | None = None
        self._kept: list[Chunk] = []
        self._time: float | None = None
        self._started = UNKNOWN_TIME
        self._reported = -math.inf
        self._turned_first = 0.0
        """rad, before the robot stood still."""

    def steps(self) -> Iterator[SpinStep]:
        """Reads the source until the procedure is done; returns what happens as it happens.

        Raises `LogError` where the stream is lost or cannot be understood, `ProcedureError` where the robot
        did not do what was asked.
        """
        self._segmenter.begin_part("")
        silence = _Silence()
        yield self._step(LISTENING)
        for chunk in self._source:
            if len(chunk):
                silence.end()
                yield from self._push(chunk)
            else:
                self._note(silence.length)
            if self._machine.is_over:
                break
        else:
            self._end_of_stream()
        self._acquired = self._segmenter.finish()
        if len(self._acquired.rest_times):
            refuse_if_misread(self._source.name, self._acquired, self._machine.gravity)
        if self._machine.failure is not None:
            raise ProcedureError(f"{self._source.name}: {self._why(self._machine.failure)}")
        self._refuse_frozen(_within(self._kept, self._machine.span))
        yield self._step("done")

    def result(self) -> SpinResult:
        """Returns what the procedure found, once `steps` has come to its end."""
        assert self._acquired is not None, "a result is asked for when the procedure is done"
        rests = self._rests(self._acquired)
        samples = _within(self._kept, self._machine.span)
        if self._machine.calibration is None or self._machine.calibration.bias_instability is None:
            self._machine.read_bias_instability(samples)
        spin = self._machine.result(rests, self._blocks(samples, rests))
        combined = combine([spin]).with_gravity(spin.up, self._machine.bias_sigma)
        return SpinResult(
            name=self._source.name,
            source=self._typed,
            serial=self._serial,
            reading=self._reading,
            spins=(spin,),
            accelerometer_bias=combined.accelerometer_bias,
            gyroscope_bias=combined.gyroscope_bias,
            covariance=combined.covariance,
            agreement=combined.agreement,
            refused=(),
            trace=trace_of(self._acquired),
            gravity=self._machine.gravity,
            gravity_source=self._machine.gravity_source,
            gravity_sigma=self._machine.gravity_sigma,
            temperature=self._acquired.temperature,
            calibration_hash=self._machine.calibration.hash() if self._machine.calibration else "",
            applied=self._machine.calibration.content() if self._machine.calibration else {},
            options={
                "live": True,
                "still": self._options.still,
                **self._options.preset.options,
                "level-floor": self._options.level_floor,
                "precision": self._machine.precision,
            },
            warnings=(
                *self._source.remarks,
                *self._machine.temperatures.notices(),
                *combined.warnings,
                *scale_warning(combined, [spin], self._machine.calibration, self._machine.gravity),
            ),
            time=self._started,
            software=f"tumble {_core.__version__}",
        )

    def _rests(self, unit: _core.Acquired) -> tuple[Rest, ...]:
        """Rests of the spin, from the one it began with on; a robot that turns on evenly has come to none."""
        return alike_rests([rest for rest in rests_of(unit) if rest.end > self._machine.span[0]])

    def _blocks(self, samples: Chunk, rests: tuple[Rest, ...]) -> _core.SpinBlockFigures | None:
        """Fits the samples once more, for the pictures: the machine keeps sums only."""
        times = np.array([(rest.start, rest.end) for rest in rests]).reshape(-1, 2)
        try:
            _, blocks = _core.fit_spin(
                samples.time, samples.accelerometer, samples.gyroscope, times, self._machine.settings
            )
        except _core.CoreError:
            # Rests found afterwards may differ from those of the machine, whose result stands by itself.
            return None
        return blocks

    def _step(self, kind: LiveStepKind) -> SpinStep:
        progress = self._machine.progress
        return SpinStep(kind, self._time, self._machine.state, progress, self._pace(progress))

    def _pace(self, progress: _core.SpinProgress) -> Pace:
        if self._machine.state != "spin" or progress["at_rest"]:
            return "none"
        ratio = abs(progress["rate"]) / self._options.rate
        return "too slow" if ratio < TOO_SLOW else "too fast" if ratio > TOO_FAST else "good"

    def _push(self, chunk: LiveChunk) -> Iterator[SpinStep]:
        """Feeds the machine; yields its events, and its progress now and then."""
        measured = self._machine.corrected(chunk)
        if not self._kept:
            self._started = LogTime(float(chunk.time[0]))
        self._kept.append(measured)
        self._segmenter.push(chunk.time, measured.accelerometer, measured.gyroscope, chunk.temperature)
        for event in self._machine.push_corrected(measured, chunk.moving):
            self._time = event.time
            if event.kind not in ("done", "failed"):
                yield self._step(cast("LiveStepKind", event.kind))
        yield from self._watch_first_turn(measured)
        self._time = float(chunk.time[-1])
        self._refuse_misread_rate(measured.gyroscope)
        if self._time - self._reported >= BETWEEN_PROGRESS:
            self._reported = self._time
            yield self._step("progress")

    def _watch_first_turn(self, measured: Chunk) -> Iterator[SpinStep]:
        """Reports once that the robot turns without an earlier rest."""
        if self._machine.state != "still":
            return
        rate = np.linalg.norm(measured.gyroscope, axis=1)
        lasted = measured.time[-1] - (measured.time[0] if self._time is None else self._time)
        before = self._turned_first
        self._turned_first += float(rate.mean() * lasted) if rate.mean() > SLOWEST_TURN else 0.0
        if before < TURNED_FIRST <= self._turned_first:
            yield self._step("turning first")

    def _note(self, silence: float) -> None:
        """Reports a silence to the machine that is longer than a stall."""
        if self._time is None:
            if silence > FIRST_SAMPLE_WITHIN:
                raise nothing_came(self._source.name)
        elif silence > PATIENCE:
            self._machine.tick(self._time + silence)

    def _end_of_stream(self) -> None:
        """Treats a stream that ends before the procedure does as one that stopped."""
        if self._time is None:
            raise LogError(f"{self._source.name}: holds no samples")
        self._machine.tick(self._time + PATIENCE)

    def _why(self, failure: SpinFailure) -> str:
        """Describes the failure; noise of a gyroscope in deg/s, read as rad/s, looks like motion."""
        doubtful = failure.kind is SpinFailureKind.NEVER_STILL and self._source.gyroscope_unit_is_assumed
        hint = "; if the gyroscope is in deg/s, no unit being stated, give --gyroscope-unit deg/s"
        early = failure.kind is SpinFailureKind.NEVER_STILL and self._turned_first >= TURNED_FIRST
        first = (
            f"it turned before it stood still ({self._turned_first / math.tau:.1f} turns): " if early else ""
        )
        return first + explain(failure.from_start(self._started)) + (hint if doubtful else "")

    def _refuse_frozen(self, samples: Chunk) -> None:
        """Refuses readings that stood still for a while, of a sensor whose readings else never do."""
        for first, last in frozen_stretches(samples):
            start, length = self._started.at(samples.time[first], 2), samples.time[last] - samples.time[first]
            raise ProcedureError(
                f"{self._source.name}: all readings stood still from {start} on for {length:.2f} s, as "
                "those of no sensor with noise do: it, or what sends, was frozen; do it again"
            )

    def _refuse_misread_rate(self, gyroscope: FloatArray) -> None:
        seen = float(np.linalg.norm(gyroscope.mean(axis=0)))
        if self._source.gyroscope_unit_is_assumed and seen > MISREAD_RATE * self._options.rate:
            raise ProcedureError(
                f"{self._source.name}: gyroscope was assumed to be in rad/s, as no unit is stated, but reads "
                f"{seen:.3g} where {self._options.rate:.3g} were asked for; give --gyroscope-unit (deg/s?)"
            )


def _within(chunks: Sequence[Chunk], span: tuple[float, float]) -> Chunk:
    """Puts the samples between two times in one piece."""
    time = np.concatenate([chunk.time for chunk in chunks])
    inside = (time >= span[0]) & (time <= span[1])
    accelerometer = np.concatenate([chunk.accelerometer for chunk in chunks])
    gyroscope = np.concatenate([chunk.gyroscope for chunk in chunks])
    return Chunk(time[inside], accelerometer[inside], gyroscope[inside])
