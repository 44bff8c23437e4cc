"""Common parts of logs of PX4 and ArduPilot: an IMU in several forms, and a correction to undo."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.firmware.correction import Corrections
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS, Triad
from tumble.logs.options import ReadOptions
from tumble.logs.pairing import USABLE_RATE
from tumble.logs.track import (
    DEFINED,
    LoggedImu,
    LoggedMagnetometer,
    RawMagnetic,
    RawSamples,
    StatedUnit,
    none_such,
    several,
)


@dataclass(slots=True)
class Times:
    """When the samples of one source were taken, as one pass over a log shows it."""

    count: int = 0
    first: float = math.nan
    last: float = math.nan
    """s."""

    @property
    def rate(self) -> float:
        """Hz; zero where samples do not follow one another."""
        return (self.count - 1) / (self.last - self.first) if self.last > self.first else 0.0

    def note(self, first: float, last: float, count: int) -> None:
        """Counts samples that follow those before, between two times, s."""
        if math.isnan(self.first):
            self.first = first
        self.last = last
        self.count += count


@dataclass(frozen=True, slots=True)
class FlightImu:
    """One form in which a log holds an IMU; all in SI."""

    name: str
    """Name of the IMU, as after `LOG:`."""
    form: str
    """Form, in which other IMUs of the log may come too; of the forms listed the first is the best."""
    rate: float
    """Hz."""
    count: int
    """Samples, about."""
    read: Callable[[], Iterator[RawSamples]]
    already_corrected: bool
    serial: str = ""
    triads: tuple[Triad, ...] = TRIADS
    corrections: Callable[[], Mapping[Triad, Corrections]] | None = None
    """Corrections by the firmware; raises `LogError` where they are unknown."""
    has_temperature: bool = False
    notices: tuple[str, ...] = field(default=())


@dataclass(frozen=True, slots=True)
class FlightMagnetometer:
    """One magnetometer of a log, or a form in which a log holds it; the first of those listed is the best."""

    name: str
    """Name, as of the option `--magnetometer-name`."""
    unit: str
    read: Callable[[], RawMagnetic]
    """Reads it, times in s."""
    already_corrected: bool
    notices: tuple[str, ...] = ()
    row_wise: bool = False
    """Indicates whether it stands in the samples of an IMU, and may repeat itself there."""


def list_of(path: Path, imus: Sequence[FlightImu], sought: str) -> tuple[str, ...]:
    """Returns their names; raises `LogError` where there are none."""
    if not imus:
        raise LogError(f"{path}: holds no samples of an IMU; it needs {sought}")
    return tuple(each.name for each in imus)


def open_flight_imu(
    path: Path,
    imus: Sequence[FlightImu],
    wanted: str | None,
    options: ReadOptions,
    format_: str,
    clock: str,
    magnetometers: Sequence[FlightMagnetometer] = (),
) -> LoggedImu:
    """Creates the track of the wanted IMU, or of that which was logged best where none is named.

    The best magnetometer, or the one that an option names, stands beside it.

    Raises `LogError` where there is no such one, or several that are as good.
    """
    magnetometer = _magnetometer(path, magnetometers, options)
    if not imus and magnetometer is not None and not options.need_imu:
        return _without_imu(path, format_, clock, magnetometer)
    found = _named(path, imus, wanted) if wanted else _best(path, imus)
    beside = [each.name for each in imus if each is not found]
    notices = list(found.notices)
    if beside and wanted is None:
        notices.insert(0, f"reads {found.name}; the log also holds {', '.join(beside)}")
    undo = options.undo_correction and found.already_corrected
    read = found.read
    if undo:
        read = _undoing(path, found)
        notices.append("what the firmware did to the samples was undone by the parameters in the log")
    elif options.undo_correction:
        notices.append("these samples were not corrected by the firmware: nothing was undone")

    def pieces() -> Iterator[RawSamples]:
        for samples in read():
            if len(samples):
                yield samples

    def head() -> RawSamples:
        first = next(pieces(), None)
        if first is None:
            raise LogError(f"{path}:{found.name}: holds no samples")
        return first

    return LoggedImu(
        path=path,
        imu=found.name,
        format=format_,
        read=lambda transform: map(transform, pieces()),
        head=head,
        locate=lambda sample: f"sample {sample + 1} of {found.name}",
        accelerometer_unit=StatedUnit("m/s^2", DEFINED),
        gyroscope_unit=StatedUnit("rad/s", DEFINED),
        time_unit=StatedUnit("s", DEFINED),
        temperature_unit=StatedUnit("degC", DEFINED),
        clock=clock,
        serial=found.serial,
        already_corrected=found.already_corrected and not undo,
        undone=undo,
        notices=tuple(notices),
        triads=found.triads,
        magnetometer=magnetometer,
        alone=not beside,
        expected=found.count,
    )


def _magnetometer(
    path: Path, found: Sequence[FlightMagnetometer], options: ReadOptions
) -> LoggedMagnetometer | None:
    names = [each.name for each in found]
    wanted = options.magnetometer_name
    if wanted is not None and wanted not in names:
        raise none_such(path, "magnetometer", wanted, names)
    if not found:
        return None
    chosen = found[names.index(wanted)] if wanted is not None else found[0]
    others = [name for name in names if name != chosen.name]
    beside = (
        (f"reads the magnetometer {chosen.name}; --magnetometer-name names another of {', '.join(others)}",)
        if others and wanted is None
        else ()
    )
    return LoggedMagnetometer(
        chosen.read,
        StatedUnit(chosen.unit, DEFINED),
        StatedUnit("s", DEFINED),
        chosen.name,
        row_wise=chosen.row_wise,
        already_corrected=chosen.already_corrected,
        notices=(*beside, *chosen.notices),
    )


def _without_imu(path: Path, format_: str, clock: str, magnetometer: LoggedMagnetometer) -> LoggedImu:
    """Returns a log that holds a magnetometer alone."""
    return LoggedImu(
        path=path,
        imu="",
        format=format_,
        read=lambda transform: iter(()),
        head=lambda: RawSamples(None, np.empty((0, 3)), np.empty((0, 3))),
        locate=lambda sample: f"reading {sample + 1} of {magnetometer.name}",
        time_unit=StatedUnit("s", DEFINED),
        clock=clock,
        triads=(),
        magnetometer=magnetometer,
    )


def at_times(time: FloatArray, known: FloatArray, values: FloatArray) -> FloatArray | None:
    """Returns (m,) values between those that are known; NaN outside, None where none is known."""
    if not len(known):
        return None
    return np.interp(time, known, values, left=np.nan, right=np.nan)


def _named(path: Path, imus: Sequence[FlightImu], wanted: str) -> FlightImu:
    for each in imus:
        if each.name.casefold() == wanted.casefold():
            return each
    raise none_such(path, "IMU", wanted, [each.name for each in imus])


def _best(path: Path, imus: Sequence[FlightImu]) -> FlightImu:
    """Chooses the first form that was logged often enough, else what was logged most often."""
    usable = [each for each in imus if each.rate >= USABLE_RATE and each.triads == TRIADS]
    form = (usable or [max(imus, key=lambda each: (each.triads == TRIADS, each.rate))])[0].form
    of_form = [each for each in imus if each.form == form]
    if len(of_form) > 1:
        raise several(path, path.name, [each.name for each in of_form])
    return of_form[0]


def _undoing(path: Path, imu: FlightImu) -> Callable[[], Iterator[RawSamples]]:
    if imu.corrections is None:
        raise LogError(f"{path}:{imu.name}: --undo-correction: how it was corrected is not in the log")
    corrections = imu.corrections()
    if any(each.needs_temperature for each in corrections.values()) and not imu.has_temperature:
        raise LogError(
            f"{path}:{imu.name}: --undo-correction: the firmware followed temperature, which the log does "
            "not hold; log it, or log the readings as the sensor gives them"
        )

    def read() -> Iterator[RawSamples]:
        degrees = np.nan
        for samples in imu.read():
            assert samples.time is not None
            held, degrees = _held(samples.temperature, degrees)
            for triad, correction in corrections.items():
                readings = correction.undo(samples.time, getattr(samples, triad), held)
                setattr(samples, triad, readings)
            yield samples

    return read


def _held(temperature: FloatArray | None, before: float) -> tuple[FloatArray | None, float]:
    """Returns temperature at every sample, the last known where one has none."""
    if temperature is None or not len(temperature):
        return temperature, before
    values = np.concatenate([[before], temperature])
    latest = np.maximum.accumulate(np.where(np.isnan(values), 0, np.arange(len(values))))
    held = values[latest][1:]
    return held, float(held[-1])
