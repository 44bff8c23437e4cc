"""Text of Xsens: exports of MT Manager (MTi, MTw) and of Xsens DOT.

Time is made of the counters, which wrap. Source: MT Manager User Manual, MT Low Level Communication Protocol
(PacketCounter of 16 bits, SampleTimeFine of 32 bits at 10 kHz), Xsens DOT User Manual (SampleTimeFine in us).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.numbers import number_of
from tumble.foundation.recording import FloatArray
from tumble.logs.columns import ImuColumns, find_imus
from tumble.logs.csv import imu_of_table
from tumble.logs.options import ReadOptions
from tumble.logs.text import TextLayout, find_layout
from tumble.logs.track import (
    DOCUMENTED,
    LoggedImu,
    LoggedMagnetometer,
    RawMagnetic,
    RawSamples,
    StatedUnit,
    Transform,
    choose,
)
from tumble.logs.units import usual_step

_COUNTER, _FINE, _OLD_COUNTER = "PacketCounter", "SampleTimeFine", "Counter"
_BITS = {_COUNTER: 16, _FINE: 32, _OLD_COUNTER: 16}
_MTI_TICKS, _DOT_TICKS = 1e4, 1e6
"""Ticks of SampleTimeFine in a second."""
_SLOWEST_MTI = 2000.0
"""Ticks between samples: more are of a DOT, as no MTi gives less than five samples a second."""
_RATES = ("update rate", "sample rate", "outputrate", "output rate")


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the one IMU of an export, which needs no name."""
    return ("",)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Reads an export; its time is that of SampleTimeFine, else of PacketCounter and the rate in its head."""
    choose(path, ("",), imu, "IMU")
    layout = find_layout(path, options)
    columns = _columns(path, layout, options)
    rate = _rate(layout)
    clock = None if "time" in options.columns else _clock_of(path, layout, columns, rate, options)
    if clock is not None:
        columns = replace(columns, time=clock.column)
    found = imu_of_table(path, replace(layout, notices=()), columns, options)
    dot = clock is not None and clock.ticks == _DOT_TICKS
    found = replace(
        found,
        format="xsens",
        rate=rate,
        serial=layout.preamble.get("deviceid", ""),
        accelerometer_unit=StatedUnit("m/s^2", DOCUMENTED),
        gyroscope_unit=StatedUnit("deg/s" if dot else "rad/s", DOCUMENTED),
        notices=(f"time from {clock.column}",) if clock else ("no counter: time from the update rate",),
    )
    return found if clock is None else _unwrapped(found, clock)


def _columns(path: Path, layout: TextLayout, options: ReadOptions) -> ImuColumns:
    """Finds Acc and Gyr; raises `LogError` where acceleration was exported without gravity only."""
    if not options.columns and "Acc_X" not in layout.names and "FreeAcc_X" in layout.names:
        raise LogError(
            f"{path}: holds FreeAcc, from which gravity was removed, but not Acc; export it again with "
            "acceleration"
        )
    imus = find_imus(layout.names, path, options)
    columns = imus.get("") or next(iter(imus.values()))
    return columns if "time" in options.columns else replace(columns, time=None, time_unit=None)


def _rate(layout: TextLayout) -> float | None:
    for key in _RATES:
        rate = number_of(layout.preamble.get(key, "").lower().removesuffix("hz").strip())
        if rate is not None and 0.0 < rate < math.inf:
            return rate
    return None


@dataclass(frozen=True, slots=True)
class _Clock:
    """A counter, and how often it ticks in a second."""

    column: str
    ticks: float


def _clock_of(
    path: Path, layout: TextLayout, columns: ImuColumns, rate: float | None, options: ReadOptions
) -> _Clock | None:
    """Chooses the finest counter that counts; None where there is none of time."""
    for column in (_FINE, _COUNTER, _OLD_COUNTER):
        if column not in layout.names:
            continue
        head = imu_of_table(path, layout, replace(columns, time=column), options).head().time
        assert head is not None
        step = usual_step(head)
        if math.isnan(step):
            continue
        if column == _FINE:
            return _Clock(column, _DOT_TICKS if step > _SLOWEST_MTI else _MTI_TICKS)
        if rate is not None:
            return _Clock(column, rate)
    return None


def _unwrapped(found: LoggedImu, clock: _Clock) -> LoggedImu:
    """Counts on where the counter begins anew; blocks are converted in turn, as each needs the last."""

    def read(transform: Transform) -> Iterator[RawSamples]:
        counter = _Counter(clock)
        for samples in found.read(lambda samples: samples):
            yield transform(counter.timed(samples))

    return replace(
        found,
        read=read,
        head=lambda: _Counter(clock).timed(found.head()),
        magnetometer=_timed(found.magnetometer, clock),
        time_unit=StatedUnit("s", f"{clock.column} at {clock.ticks:g} a second"),
    )


def _timed(magnetometer: LoggedMagnetometer | None, clock: _Clock) -> LoggedMagnetometer | None:
    """Returns the magnetometer with time in place of the counter."""
    if magnetometer is None:
        return None

    def read() -> RawMagnetic:
        raw = magnetometer.read()
        time = _Counter(clock).timed(RawSamples(raw.time, raw.field, raw.field)).time
        return replace(raw, time=time)

    return replace(
        magnetometer,
        read=read,
        notices=("Xsens states the magnetic field in units of that at the place of its calibration",),
    )


class _Counter:
    """A counter that wraps, as time."""

    def __init__(self, clock: _Clock) -> None:
        self._clock = clock
        self._last: float | None = None
        self._total = 0.0

    def timed(self, samples: RawSamples) -> RawSamples:
        """Converts the counter of successive samples to seconds; more than half its range is a step back."""
        assert samples.time is not None
        counted = np.isfinite(samples.time)
        raw: FloatArray = samples.time[counted]
        if len(raw):
            if self._last is None:
                self._last = self._total = float(raw[0])
            half = 2.0 ** (_BITS[self._clock.column] - 1)
            steps = (np.diff(raw, prepend=self._last) + half) % (2.0 * half) - half
            raw = self._total + np.cumsum(steps)
            self._last, self._total = float(samples.time[counted][-1]), float(raw[-1])
        time = np.full(len(samples), np.nan)
        time[counted] = raw / self._clock.ticks
        return replace(samples, time=time)
