"""Statements of the user about a log that the log itself does not make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from tumble.foundation.errors import LogError
from tumble.foundation.log_reading import SCALING
from tumble.foundation.names import normal_name
from tumble.foundation.units import Channel

if TYPE_CHECKING:
    from tumble.foundation.recording import RecordingSource

_ZEROS = ("accelerometer_zero", "gyroscope_zero")
_UNITS = ("accelerometer_unit", "gyroscope_unit", "magnetometer_unit")
COUNTS = 32768.0
"""Counts of a sensor of 16 bits, to the end of its range."""

AxisValues: TypeAlias = float | Sequence[float]
"""One number for all three axes, or one for each."""


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """Options for reading a log. Every field may keep its default where the log states it.

    Options take precedence over column names, and those over guesses from values.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    """Column for each of `time ax ay az gx gy gz mx my mz temperature current throttle`: its name, or its
    position from 1."""
    accelerometer_unit: str | None = None
    """Unit of the accelerometer: `m/s^2`, `g`, `mg`, `cm/s^2`."""
    gyroscope_unit: str | None = None
    """Unit of the gyroscope: `rad/s`, `deg/s`, `mrad/s`, `mdeg/s`, `rpm`."""
    time_unit: str | None = None
    """Unit of time: `s`, `ms`, `us`, `ns`."""
    temperature_unit: str | None = None
    """Unit of temperature: `degC`, `K`, `degF`."""
    magnetometer_unit: str | None = None
    """Unit of the magnetometer: `uT`, `nT`, `T`, `G`, `mG`."""
    accelerometer_scale: AxisValues | None = None
    """Counts per unit of the accelerometer: 16384 with `g`; m/s^2 where no unit is stated."""
    accelerometer_zero: AxisValues = 0.0
    """Reading of the accelerometer at zero, in the counts or unit of the log."""
    counts: tuple[float, float] | None = None
    """Ranges, in g and deg/s, of a sensor that logs counts of 16 bits: unit and scale of both triads."""
    gyroscope_scale: AxisValues | None = None
    """Counts per unit of the gyroscope: 131 with `deg/s`; rad/s where no unit is stated."""
    magnetometer_scale: AxisValues | None = None
    """Counts per unit of the magnetometer: 1090 with `G`; uT where no unit is stated."""
    gyroscope_zero: AxisValues = 0.0
    """Reading of the gyroscope at zero, in the counts or unit of the log."""
    as_numbers: bool = False
    """Take readings as they stand: counts of a scale that nobody knows."""
    accelerometer_sign: int = 1
    """-1 for a sensor that reads -g where it should read +g."""
    axes: str = "x,y,z"
    """Case axes in terms of the log's: `y,-x,z` puts y on x, -x on y; `x,y,-z` mends a left-handed log."""
    rate: float | None = None
    """Samples per second, Hz: for a log without time, or to be used in place of its time."""
    topic: str | None = None
    """Which IMU of the file: a topic of a bag, a column prefix of a table. The same as `LOG:NAME`."""
    magnetometer_name: str | None = None
    """Which magnetometer of the file, where it holds several: a topic, a column prefix, a message."""
    skip_lines: int = 0
    """Lines to skip before the column names, or before the numbers where there are no names."""
    skip_bad_lines: bool = False
    """Leave out lines of a text log that cannot be read, up to 1 % of them."""
    channel: Channel | None = None
    """The only channel to read, as of a single-axis sensor: its column stands for its whole triad."""
    interpolate: bool = False
    """Bring an accelerometer with times of its own, in a file of its own, to those of the gyroscope."""
    serial: str = ""
    """Serial number of the unit."""
    undo_correction: bool = False
    """Undo what the firmware of an autopilot did to the samples, by the parameters in its log."""
    need_imu: bool = True
    """False for who reads a magnetometer alone: then a log without any triad of an IMU is read as well."""
    live_times: bool = False
    """Times of a recorded session as given live, when the clock of each sensor was still being found."""

    def __post_init__(self) -> None:
        """Fills in the options of `counts`; those stated by themselves go before them.

        Raises `LogError` where the serial number is longer than any.
        """
        try:
            object.__setattr__(self, "serial", normal_name(self.serial))
        except ValueError as error:
            raise LogError(f"--serial: {error}; give a shorter one") from error
        if self.counts is None:
            return
        units = {"accelerometer": "g", "gyroscope": "deg/s"}
        for (triad, unit), span in zip(units.items(), self.counts, strict=True):
            if getattr(self, f"{triad}_scale") is None:
                object.__setattr__(self, f"{triad}_scale", COUNTS / span)
                object.__setattr__(self, f"{triad}_unit", getattr(self, f"{triad}_unit") or unit)

    @property
    def reading(self) -> dict[str, object]:
        """Options that change readings, as calibration files state them; axes are always among them."""
        axes = self.axes.replace(" ", "").replace("+", "").lower()
        found: dict[str, object] = {"axes": axes}
        if self.accelerometer_sign != 1:
            found["accelerometer_sign"] = self.accelerometer_sign
        for name in (*_ZEROS, *SCALING):
            value = getattr(self, name)
            numbers = [float(each) for each in value] if isinstance(value, Sequence) else [value] * 3
            if any(numbers):
                found[name] = numbers
        return found | {name: unit for name in _UNITS if (unit := getattr(self, name)) is not None}


def options_for(
    source: RecordingSource, read: ReadOptions | Mapping[str, ReadOptions] | None
) -> ReadOptions | None:
    """Returns what holds for one source: the same for all, or by what was typed to name it."""
    if not isinstance(read, Mapping):
        return read
    return read.get(str(source)) if isinstance(source, str | Path) else None
