"""IMUs in messages: how the samples of one are decoded, and which fields of a message are one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS
from tumble.logs.columns import ImuColumns, MagneticColumns, find_imus
from tumble.logs.message_form import MessageForm, stamps_of, with_stamps
from tumble.logs.rosmsg import Encoding, decode, frame_of, frames_of, seconds
from tumble.logs.row_labels import labels_for
from tumble.logs.track import DATE_AND_TIME, DEFINED, RawMagnetic, RawSamples, StatedUnit, stack

_HEADER, _STAMP = "header", "stamp"
_FRAME_EVERY = 53
"""Messages from one whose frame is read to the next, where that takes as long as all else: a prime, lest
drivers that take turns have it fall on one of them."""
_MAGNETIC_FIELD = "magnetic_field"
"""Vector of a sensor_msgs/MagneticField."""
_COVARIANCES = {
    "accelerometer": "linear_acceleration_covariance.0",
    "gyroscope": "angular_velocity_covariance.0",
}


@dataclass(frozen=True, slots=True)
class MessageUnits:
    """Units that the messages of an IMU state."""

    accelerometer: StatedUnit | None
    gyroscope: StatedUnit | None
    time: StatedUnit | None
    temperature: StatedUnit | None


ROS_UNITS = MessageUnits(
    StatedUnit("m/s^2", DEFINED),
    StatedUnit("rad/s", DEFINED),
    StatedUnit("s", DEFINED),
    StatedUnit("degC", DEFINED),
)
"""Those of sensor_msgs."""


class ImuDecoder(Protocol):
    """Makes samples of messages."""

    @property
    def units(self) -> MessageUnits:
        """Returns what is stated of units."""

    @property
    def what(self) -> str:
        """Describes its messages, for errors."""

    def decode(self, messages: Sequence[bytes]) -> RawSamples:
        """Decodes some; raises `MalformedMessageError` for the first that is no such message."""
        ...

    def frame(self, message: bytes) -> str:
        """Returns the name of the frame; empty where a message states none."""
        ...

    def frames(self, messages: Sequence[bytes]) -> set[str]:
        """Returns the names of the frames of decoded messages, where each means an IMU of its own."""
        ...


@dataclass(frozen=True, slots=True)
class PlainImu:
    """Messages that are sensor_msgs/Imu."""

    encoding: Encoding
    units: MessageUnits = ROS_UNITS
    what: str = "sensor_msgs/Imu"

    def decode(self, messages: Sequence[bytes]) -> RawSamples:
        """Decodes header and numbers of many at once."""
        found = decode(messages, "imu", self.encoding)
        return RawSamples(seconds(found.stamp), found.specific_force, found.angular_rate)

    def frame(self, message: bytes) -> str:
        """Reads the name in the header."""
        return frame_of(message, self.encoding)

    def frames(self, messages: Sequence[bytes]) -> set[str]:
        """Reads the name in each header."""
        return frames_of(messages, self.encoding)


@dataclass(frozen=True, slots=True)
class FieldImu:
    """Fields of a message that together are one sample."""

    form: MessageForm
    columns: ImuColumns
    stamps: Mapping[str, tuple[str, str]]
    """Names of seconds and nanoseconds of stamps that consist of both."""
    units: MessageUnits
    what: str
    embedded: str = ""
    """Name of the field that is a sensor_msgs/Imu; empty where it is known by the names of its fields."""
    outer_time: str | None = None
    """Stamp of the message that an embedded one stands in; some drivers set that alone."""

    labels: tuple[str, ...] = ()
    """Fields that may name the IMU of a message, the surest first."""

    def by_outer_time(self) -> FieldImu:
        """Returns the same with the stamp of the message around it."""
        return replace(self, columns=replace(self.columns, time=self.outer_time))

    def decode(self, messages: Sequence[bytes]) -> RawSamples:
        """Reads the fields."""
        names = [part for name in self.columns.names for part in self.stamps.get(name, (name,))]
        if self.embedded:
            names += [f"{self.embedded}.{each}" for each in _COVARIANCES.values()]
        read = dict(self.form.read(messages, names))
        for name, (whole, rest) in self.stamps.items():
            if name in self.columns.names:
                read[name] = stamps_of(read[whole], read[rest])
        time, temperature = self.columns.time, self.columns.temperature
        return RawSamples(
            None if time is None else read[time],
            self._triad("accelerometer", read, self.columns.accelerometer),
            self._triad("gyroscope", read, self.columns.gyroscope),
            None if temperature is None else read[temperature],
        )

    def magnetic(self, messages: Sequence[bytes]) -> RawMagnetic:
        """Reads the fields of the magnetometer; raises `MalformedMessageError` as `decode` does."""
        columns, time = self.columns.magnetometer, self.columns.time
        assert columns is not None
        stamp = () if time is None else self.stamps.get(time, (time,))
        read = dict(self.form.read(messages, [*stamp, *columns.axes]))
        if time is not None and time in self.stamps:
            whole, rest = self.stamps[time]
            read[time] = stamps_of(read[whole], read[rest])
        return RawMagnetic(None if time is None else read[time], stack(read, columns.axes))

    def _triad(
        self, triad: str, read: Mapping[str, FloatArray], names: tuple[str, str, str] | None
    ) -> FloatArray:
        values = stack(read, names)
        if self.embedded:
            # Imu.msg: -1 where the publisher does not measure the quantity.
            values[read[f"{self.embedded}.{_COVARIANCES[triad]}"] == -1.0] = np.nan
        return values

    def frame(self, message: bytes) -> str:
        """Reads the name in the message itself."""
        return self.form.frame(message)

    def frames(self, messages: Sequence[bytes]) -> set[str]:
        """Reads the name in some of the messages; frames of fields known by their names mean nothing."""
        return set(map(self.frame, messages[::_FRAME_EVERY])) if self.embedded else set()


def embedded_imus(form: MessageForm, fields: Sequence[str], what: str) -> dict[str, ImuDecoder]:
    """Returns the IMUs of those fields that are a sensor_msgs/Imu, by the names of the fields."""
    found: dict[str, ImuDecoder] = {}
    around = _field_imus(form, form.names, what)
    stamps = with_stamps(form.names)
    outer_time = next((name for name in stamps.names if _without_header(name) == _STAMP), None)
    for field in fields:
        inside = [name for name in form.names if name.startswith(f"{field}.")]
        for prefix, imu in _field_imus(form, inside, what).items():
            if prefix == field:
                beside = _in_tesla(around[field].columns.magnetometer if field in around else None)
                found[field] = replace(
                    imu,
                    columns=replace(imu.columns, magnetometer=imu.columns.magnetometer or beside),
                    stamps=stamps.parts,
                    units=ROS_UNITS,
                    embedded=field,
                    outer_time=outer_time,
                )
    return found


def _in_tesla(columns: MagneticColumns | None) -> MagneticColumns | None:
    """Returns a magnetometer with the unit of sensor_msgs/MagneticField, where its fields are of one."""
    if columns is None or not all(name.rpartition(".")[0].endswith(_MAGNETIC_FIELD) for name in columns.axes):
        return columns
    return replace(columns, unit=StatedUnit("T", DEFINED))


def imus_by_names(form: MessageForm, what: str) -> Mapping[str, ImuDecoder]:
    """Returns the IMUs whose triads are known by the names of their fields, by the field that they are in."""
    return _field_imus(form, form.names, what)


def _field_imus(form: MessageForm, names: Sequence[str], what: str) -> dict[str, FieldImu]:
    stamps = with_stamps(names)
    # A header belongs to what it stands beside.
    plain = {_without_header(name): name for name in stamps.names}
    try:
        imus = find_imus(list(plain), Path(what))
    except LogError:
        return {}
    words = {_without_header(name): name for name in form.words}
    return {
        prefix: _field_imus_units(
            FieldImu(
                form,
                _renamed(imu, plain),
                stamps.parts,
                ROS_UNITS,
                what,
                labels=tuple(words[name] for name in labels_for(imu, words)),
            ),
            imu,
        )
        for prefix, imu in imus.items()
        if imu.triads == TRIADS
    }


def _field_imus_units(found: FieldImu, imu: ImuColumns) -> FieldImu:
    time = imu.time_unit
    if found.columns.time in found.stamps:
        time = ROS_UNITS.time
    elif found.columns.time in found.form.dates:
        time = StatedUnit("ns", DATE_AND_TIME)
    units = MessageUnits(imu.accelerometer_unit, imu.gyroscope_unit, time, imu.temperature_unit)
    return replace(found, units=units)


def _without_header(name: str) -> str:
    return ".".join(part for part in name.split(".") if part != _HEADER)


def _renamed(imu: ImuColumns, names: Mapping[str, str]) -> ImuColumns:
    """Returns the columns by the names in the message."""

    def triad(found: tuple[str, str, str] | None) -> tuple[str, str, str] | None:
        return None if found is None else (names[found[0]], names[found[1]], names[found[2]])

    axes = triad(imu.magnetometer.axes if imu.magnetometer else None)
    return replace(
        imu,
        accelerometer=triad(imu.accelerometer),
        gyroscope=triad(imu.gyroscope),
        time=None if imu.time is None else names[imu.time],
        temperature=None if imu.temperature is None else names[imu.temperature],
        gyroscope_time=None if imu.gyroscope_time is None else names[imu.gyroscope_time],
        magnetometer=_magnetometer_of(imu, axes),
    )


def _magnetometer_of(imu: ImuColumns, axes: tuple[str, str, str] | None) -> MagneticColumns | None:
    if imu.magnetometer is None or axes is None:
        return None
    return MagneticColumns(axes, imu.magnetometer.unit)


def may_hold_imu(text: bytes) -> bool:
    """Returns whether a definition has words of both triads, so that it is worth a closer look."""
    lower = text.lower()
    return any(word in lower for word in (b"acc", b"specific_force")) and any(
        word in lower for word in (b"gyr", b"angular", b"omega", b"rotation")
    )
