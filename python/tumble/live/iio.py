"""Sensors that Linux itself drives (IIO): an IMU, or triads that are devices of their own."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import TypeAlias

import numpy as np

from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS, CalibratedTriad, Triad
from tumble.live.address import Address
from tumble.live.conditioning import EMPTY, ConditionedSource
from tumble.live.field_pairing import NO_MAGNETOMETER, FieldPairing
from tumble.live.iio_device import CHANNELS, TEMPERATURE, TIMESTAMP, IioDevice, find_devices
from tumble.live.readings import Readings, StreamFacts
from tumble.live.source import LiveChunk
from tumble.logs.options import ReadOptions
from tumble.logs.track import RawSamples, StatedUnit

MOST_WAITING = 10_000
"""Samples of one of two devices that may wait for the other."""
_STATED = "IIO"
_NANOSECOND = 1e-9

Received: TypeAlias = Mapping[IioDevice, Mapping[str, FloatArray]]
"""Scans of each device that came since the last look."""


def open_iio(address: Address, options: ReadOptions) -> IioSource:
    """Opens `iio:device0`, or by names, `iio:lsm6dsm`, `iio:accel_3d+gyro_3d+magn_3d`.

    `rate=` sets the sampling frequency, Hz, `trigger=` names what has samples taken, `root=` is the folder
    that holds `sys` and `dev`. With `magnetometer=none` that of a device is not captured.
    """
    address.refuse_other_settings("rate", "trigger", "root", "magnetometer")
    if (magnetometer := address.settings.get("magnetometer", NO_MAGNETOMETER)) != NO_MAGNETOMETER:
        raise LogError(
            f"{address.text}: magnetometer={magnetometer}: give none, or name its device, +magn_3d"
        )
    rate = address.number("rate", 0.0) if "rate" in address.settings else None
    devices = find_devices(address, Path(address.settings.get("root", "/")))
    return IioSource(address, options, devices, rate)


class IioSource(ConditionedSource):
    """Reads the buffers of one device, or of one for each triad; a `Source`."""

    def __init__(
        self, address: Address, options: ReadOptions, devices: list[IioDevice], rate: float | None
    ) -> None:
        super().__init__(options)
        self.name = "+".join(device.name for device in devices)
        self._address = address
        if "magnetometer" in address.settings:
            for each in devices:
                each.left_out = ("magnetometer",)
        self._devices = {triad: _with(triad, devices, address) for triad in TRIADS}
        self._magnetometer = next((each for each in devices if "magnetometer" in each.triads), None)
        self._pairing = FieldPairing()
        self._rate = rate
        self._open = ExitStack()
        self._matched = _Matched()

    @property
    def _are_two(self) -> bool:
        return self._devices["accelerometer"] is not self._devices["gyroscope"]

    @property
    def _opened(self) -> list[IioDevice]:
        """Lists each device once."""
        of_magnetometer = [] if self._magnetometer is None else [self._magnetometer]
        return list(dict.fromkeys([*self._devices.values(), *of_magnetometer]))

    @property
    def remarks(self) -> tuple[str, ...]:
        """See `Source`."""
        return self._conditioner.notices

    def __enter__(self) -> IioSource:
        trigger = self._address.settings.get("trigger")
        with ExitStack() as opened:
            devices = self._opened
            for each in devices:
                each.open(self._rate, trigger)
                opened.callback(each.close)
                if len(devices) > 1 and TIMESTAMP not in each.scan.elements:
                    raise LogError(
                        f"{self._address.text}: {each.name} stamps no samples, so that those of several "
                        "devices cannot be put together"
                    )
            self._open = opened.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.close()

    def fileno(self) -> int:
        """See `Source`."""
        return self._devices["gyroscope"].fileno()

    def read(self) -> LiveChunk:
        """See `Source`."""
        numbers = {device: device.receive() for device in self._opened}
        samples, arrival = self._two(numbers) if self._are_two else self._one(numbers), clock.now()
        magnetic = self._field(numbers, samples)
        if not len(samples):
            return EMPTY
        return self._conditioner.take(Readings(samples, magnetic=magnetic), self._facts(), arrival)

    def _one(self, received: Received) -> RawSamples:
        device = self._devices["gyroscope"]
        numbers = received[device]
        return RawSamples(
            numbers.get(TIMESTAMP),
            device.triad("accelerometer", numbers),
            device.triad("gyroscope", numbers),
            _temperature(device, numbers),
        )

    def _two(self, received: Received) -> RawSamples:
        """Returns the gyroscope's samples, with the accelerometer's readings at their times."""
        for triad, device in self._devices.items():
            self._matched.add(triad, received[device][TIMESTAMP], device.triad(triad, received[device]))
        if self._matched.waiting > MOST_WAITING:
            raise LogError(
                f"{self._address.text}: of accelerometer and gyroscope only one sends; check the other "
                "one and its trigger"
            )
        return self._matched.samples()

    def _field(self, received: Received, samples: RawSamples) -> FloatArray | None:
        """Returns the magnetometer's readings beside samples, gauss; None where there is none."""
        device = self._magnetometer
        if device is None:
            return None
        field = device.triad("magnetometer", received[device])
        if len(self._opened) == 1:
            return field
        assert samples.time is not None, "samples of several devices are stamped"
        self._pairing.add(_NANOSECOND * received[device][TIMESTAMP], field)
        return self._pairing.beside(_NANOSECOND * samples.time)

    def _facts(self) -> StreamFacts:
        notices = []
        if self._are_two:
            notices.append(
                "accelerometer and gyroscope are two devices; readings of the accelerometer are interpolated "
                "to the times of the gyroscope"
            )
        if self._magnetometer is not None and len(self._opened) > 1:
            notices.append("readings of the magnetometer are put beside the sample that came next")
        of_triads: dict[CalibratedTriad, IioDevice] = dict(self._devices.items())
        if self._magnetometer is not None:
            of_triads["magnetometer"] = self._magnetometer
        turned = [triad for triad, device in of_triads.items() if device.mount_matrix(triad) is not None]
        if turned:
            notices.append(f"axes of the {' and '.join(turned)} are turned by the mount matrix of the device")
        return StreamFacts(
            self._address.text,
            all(TIMESTAMP in device.scan.elements for device in self._opened),
            StatedUnit("m/s^2", _STATED),
            StatedUnit("rad/s", _STATED),
            StatedUnit("ns", _STATED),
            StatedUnit("degC", _STATED),
            StatedUnit("G", _STATED),
            notices=tuple(notices),
        )


class _Matched:
    """Samples of two devices, until both have gone past their time."""

    def __init__(self) -> None:
        self._time = {triad: np.empty(0) for triad in TRIADS}
        self._readings = {triad: np.empty((0, 3)) for triad in TRIADS}

    @property
    def waiting(self) -> int:
        """Samples of the device that is ahead."""
        return max(map(len, self._time.values()))

    def add(self, triad: Triad, time: FloatArray, readings: FloatArray) -> None:
        self._time[triad] = np.concatenate([self._time[triad], time])
        self._readings[triad] = np.concatenate([self._readings[triad], readings])

    def samples(self) -> RawSamples:
        """Returns the gyroscope's samples that lie between two of the accelerometer's."""
        at, known = self._time["gyroscope"], self._time["accelerometer"]
        if not len(known):
            return RawSamples(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
        first, last = np.searchsorted(at, [known[0], known[-1]], side="left")
        last += int(last < len(at) and at[last] == known[-1])
        times, gyroscope = at[first:last], self._readings["gyroscope"][first:last]
        readings = self._readings["accelerometer"]
        accelerometer = np.column_stack([np.interp(times, known, readings[:, axis]) for axis in range(3)])
        if len(at):
            # The last one before is needed to interpolate from.
            before = int(np.searchsorted(known, at[-1], side="right")) - 1
            self._drop("accelerometer", max(0, min(before, len(known) - 1)))
        self._drop("gyroscope", int(last))
        return RawSamples(times, accelerometer, gyroscope)

    def _drop(self, triad: Triad, count: int) -> None:
        self._time[triad], self._readings[triad] = self._time[triad][count:], self._readings[triad][count:]


def _temperature(device: IioDevice, numbers: Mapping[str, FloatArray]) -> FloatArray | None:
    """degC, where IIO has thousandths of it."""
    return None if TEMPERATURE not in numbers else 1e-3 * device.scaled(TEMPERATURE, numbers)


def _with(triad: Triad, devices: list[IioDevice], address: Address) -> IioDevice:
    """Returns the device that has the triad; raises `LogError` where none has."""
    for device in devices:
        if triad in device.triads:
            return device
    named = ", ".join(device.name for device in devices)
    raise LogError(
        f"{address.text}: {named} has no {triad} ({CHANNELS[triad]}_x, _y, _z); name two devices, as "
        "iio:accel_3d+gyro_3d"
    )
