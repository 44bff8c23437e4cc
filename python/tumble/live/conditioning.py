"""From what a device sends to what estimators may take: SI units, time that runs forwards, numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tumble.errors import LogError
from tumble.live.clock import ArrivalClock, CountingClock, DeviceClock
from tumble.live.readings import Readings, StreamFacts
from tumble.live.source import LiveChunk
from tumble.logs.conversion import Conversion, conversion_for, notices_on_axes
from tumble.logs.options import ReadOptions
from tumble.logs.track import RawSamples, StatedUnit
from tumble.logs.units import IMPOSSIBLE_RAD_PER_S
from tumble.recording import FloatArray

HEAD_SAMPLES = 20
"""Samples, best taken at rest, from which units are decided that nobody stated."""
MOST_WITHOUT_NUMBER = 50
"""Successive samples without a number beyond which the sensor, or how it is read, is at fault."""
RESTARTED = 1.0
"""Time that runs back by more than this, s, is that of a device that started anew, not of a late sample."""

_ARRIVAL = "arrival"

EMPTY = LiveChunk(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))


class Conditioner:
    """Turns readings into chunks that are fit to use."""

    def __init__(self, options: ReadOptions) -> None:
        self.without_number = 0
        """Samples left out because the time or a channel is no finite number."""
        self.late = 0
        """Samples left out because they are no newer than the one before."""
        self._options = options
        self._device_clock = DeviceClock()
        self._arrival_clock = ArrivalClock()
        self._counting_clock = CountingClock(options.rate) if options.rate is not None else None
        self._head: list[Readings] = []
        self._facts: StreamFacts | None = None
        self._conversion: Conversion | None = None
        self._last_time = -np.inf
        self._without_number_in_succession = 0

    @property
    def gyroscope_unit_is_assumed(self) -> bool:
        """Whether rad/s were taken for granted."""
        return self._conversion is not None and self._conversion.gyroscope_unit.reason == "assumed"

    @property
    def notices(self) -> tuple[str, ...]:
        """Say what was taken for granted and what was left out."""
        if self._conversion is None or self._facts is None:
            return ()
        notices = [*self._facts.notices, *notices_on_axes(self._options)]
        if self.gyroscope_unit_is_assumed:
            notices.append("gyroscope is assumed to be in rad/s; no unit is stated")
        if self._conversion.time_unit.reason == _ARRIVAL:
            notices.append(
                "samples carry no time, so that of their arrival is used: delays on the way count as motion"
            )
        if self.without_number:
            notices.append(f"left out {self.without_number} samples without a number")
        if self.late:
            notices.append(f"left out {self.late} samples that came twice or out of order")
        return tuple(notices)

    def take(self, readings: Readings, facts: StreamFacts, arrival: float) -> LiveChunk:
        """Give what can be used by now: nothing until there are samples enough to decide units from.

        `arrival` is when the readings came, s of any clock that runs forwards.

        Raises `LogError` where no unit fits or a stated one contradicts the values, where sample after sample
        is no number, and where the device started anew.
        """
        stamped = replace(readings, samples=self._stamped(readings.samples, arrival))
        if self._conversion is not None:
            return self._checked(stamped, self._conversion)
        self._head.append(stamped)
        if sum(map(len, self._head)) < HEAD_SAMPLES:
            return EMPTY
        head, self._head = _joined(self._head), []
        self._facts = facts
        self._conversion = self._decide(head.samples, facts)
        return self._checked(head, self._conversion)

    def _stamped(self, samples: RawSamples, arrival: float) -> RawSamples:
        if self._counting_clock is not None:
            time = self._counting_clock.stamp(len(samples))
        elif samples.time is None:
            time = self._arrival_clock.stamp(len(samples), arrival)
        else:
            time = self._device_clock.stamp(samples.time)
        return replace(samples, time=time)

    def _decide(self, head: RawSamples, facts: StreamFacts) -> Conversion:
        if facts.has_time or self._counting_clock is not None:
            return conversion_for(facts, self._options, head)
        arrived = replace(facts, time_unit=StatedUnit("s", _ARRIVAL))
        return conversion_for(arrived, replace(self._options, time_unit=None), head)

    def _checked(self, readings: Readings, conversion: Conversion) -> LiveChunk:
        samples = conversion(readings.samples)
        assert samples.time is not None, "every sample was stamped"
        numbers = np.column_stack([samples.time, samples.accelerometer, samples.gyroscope])
        finite: NDArray[np.bool_] = np.logical_and.reduce(np.isfinite(numbers), axis=1)
        self._count_without_number(finite)
        # NaN would hide every later time from a running maximum.
        time = np.where(finite, samples.time, -np.inf)
        newest_before = np.maximum.accumulate(np.concatenate([[self._last_time], time]))[:-1]
        late = finite & (time <= newest_before)
        self._refuse_restart(time[late] - newest_before[late])
        self.late += int(late.sum())
        kept = finite & ~late
        if not kept.any():
            return EMPTY
        chunk = LiveChunk(
            samples.time[kept],
            samples.accelerometer[kept],
            samples.gyroscope[kept],
            None if samples.temperature is None else samples.temperature[kept],
            None if readings.moving is None else readings.moving[kept],
        )
        self._last_time = float(chunk.time[-1])
        self._refuse_impossible_rate(chunk)
        return chunk

    def _count_without_number(self, finite: NDArray[np.bool_]) -> None:
        self.without_number += int((~finite).sum())
        for good in finite:
            self._without_number_in_succession = 0 if good else self._without_number_in_succession + 1
            if self._without_number_in_succession >= MOST_WITHOUT_NUMBER:
                raise LogError(
                    f"{self._name}: {MOST_WITHOUT_NUMBER} samples in a row are not numbers; check the "
                    "sensor, and what the device sends against --columns"
                )

    def _refuse_restart(self, steps: FloatArray) -> None:
        if len(steps) and float(steps.min()) < -RESTARTED:
            raise LogError(
                f"{self._name}: time ran back by {-float(steps.min()):.6g} s to an earlier time: the device "
                "restarted, or two devices send at once; correct that and start again"
            )

    def _refuse_impossible_rate(self, chunk: LiveChunk) -> None:
        fastest = float(np.abs(chunk.gyroscope).max())
        if self.gyroscope_unit_is_assumed and fastest > IMPOSSIBLE_RAD_PER_S:
            raise LogError(
                f"{self._name}: gyroscope was assumed to be in rad/s, as no unit is stated, but reads "
                f"{fastest:.4g}; give --gyroscope-unit (deg/s?)"
            )

    @property
    def _name(self) -> str:
        return "" if self._facts is None else self._facts.source


def _joined(pieces: list[Readings]) -> Readings:
    """Put readings that came one after another together."""
    samples = [piece.samples for piece in pieces]

    def joined(parts: list[FloatArray | None]) -> FloatArray | None:
        present = [part for part in parts if part is not None]
        return np.concatenate(present) if len(present) == len(parts) else None

    return Readings(
        RawSamples(
            joined([each.time for each in samples]),
            np.concatenate([each.accelerometer for each in samples]),
            np.concatenate([each.gyroscope for each in samples]),
            joined([each.temperature for each in samples]),
        ),
        joined([piece.moving for piece in pieces]),
    )
