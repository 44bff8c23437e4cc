"""A device of Linux IIO in sysfs: its channels, how they are scaled, and its buffer."""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tumble.foundation.errors import LogError
from tumble.foundation.file_reading import read_text_whole
from tumble.foundation.file_status import exists
from tumble.foundation.files import set_attribute
from tumble.foundation.numbers import number_of
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CalibratedTriad
from tumble.live.address import Address
from tumble.live.iio_scan import Element, Scan, parse_element

CHANNELS: Mapping[CalibratedTriad, str] = {
    "accelerometer": "in_accel",
    "gyroscope": "in_anglvel",
    "magnetometer": "in_magn",
}
"""Names of the triads in IIO; after offset and scale they are in m/s^2, rad/s and gauss."""
DEVICES = "sys/bus/iio/devices"
TIMESTAMP, TEMPERATURE = "in_timestamp", "in_temp"
BUFFER_SCANS = 1024
"""Scans that the kernel keeps for us; by itself it keeps two."""
CLOCK = "monotonic"
"""The clock to stamp by: that of `clock.now()`, which nobody sets."""
PIECE_SCANS = 256
_LONGEST_ATTRIBUTE = 1 << 16
"""Bytes of what sysfs shows as a file."""
GET_PERMISSION = "run this as root, or give your group the right by a rule of udev"


def device_folders(root: Path) -> list[Path]:
    """Lists the folders in which sysfs, below `root`, shows devices: `iio:device0`."""
    return sorted((root / DEVICES).glob("iio:device*"))


def find_devices(address: Address, root: Path) -> list[IioDevice]:
    """Finds `device0`, `lsm6dsm` or `accel_3d+gyro_3d`; raises `LogError` where there is no such device."""
    known = {path.name.removeprefix("iio:"): path for path in device_folders(root)}
    if not known:
        raise LogError(f"{address.text}: no IIO device in {root / DEVICES}; is the sensor's driver loaded?")
    names = {place: _text(path / "name") or place for place, path in known.items()}
    return [
        IioDevice(address, root, known[_place(address, wanted.removeprefix("iio:"), names)])
        for wanted in address.place.split("+")
    ]


def _place(address: Address, wanted: str, names: Mapping[str, str]) -> str:
    places = [place for place, name in names.items() if wanted in (place, name)]
    if len(places) > 1:
        raise LogError(f"{address.text}: {', '.join(places)} are all named {wanted!r}; give one of these")
    if not places:
        found = ", ".join(f"{place} ({name})" for place, name in names.items())
        raise LogError(f"{address.text}: no IIO device {wanted!r}; found: {found}")
    return places[0]


@dataclass(slots=True, eq=False)
class IioDevice:
    """Captures into its buffer while it is open; what was changed for that is put back afterwards."""

    address: Address
    root: Path
    folder: Path
    """Folder of the device in sysfs."""
    scan: Scan = field(default_factory=lambda: Scan([]))
    """Channels that are captured, once it is open."""
    left_out: tuple[CalibratedTriad, ...] = ()
    """Triads that are not captured although it has them."""
    _scaling: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Offset and scale of each channel that is captured."""
    _mounting: dict[CalibratedTriad, FloatArray | None] = field(default_factory=dict)
    _changed: list[tuple[Path, str]] = field(default_factory=list)
    _file: int | None = None
    _rest: bytes = b""

    @property
    def name(self) -> str:
        """Name that the driver gives: `lsm6dsm`."""
        return _text(self.folder / "name") or self.folder.name.removeprefix("iio:")

    @property
    def triads(self) -> list[CalibratedTriad]:
        """Those of which all three axes can be captured."""
        elements = self._all_elements()
        return [
            triad
            for triad, channel in CHANNELS.items()
            if triad not in self.left_out and all(f"{channel}_{axis}" in elements for axis in "xyz")
        ]

    def open(self, rate: float | None, trigger: str | None) -> None:
        """Starts capturing its triads and the time; raises `LogError` where it cannot."""
        try:
            self._set_up(rate, trigger)
        except BaseException:
            self.close()
            raise

    def _set_up(self, rate: float | None, trigger: str | None) -> None:
        buffer = self._buffer
        if _text(buffer / "enable") == "1":
            raise self._error("another program captures from it; close that first")
        self._choose_channels()
        self._scaling = {
            channel: (self._factor(channel, "offset", 0.0), self._factor(channel, "scale", 1.0))
            for channel in self.scan.elements
        }
        self._mounting = {triad: self._read_mount_matrix(triad) for triad in self.triads}
        if exists(clock := self.folder / "current_timestamp_clock"):
            self._write(clock, CLOCK)
        self._choose_trigger(trigger)
        # A magnetometer of its own is slower than any rate that an IMU is set to.
        if rate is not None and self.triads != ["magnetometer"]:
            self._set_rate(rate)
        self._write(buffer / "length", str(BUFFER_SCANS))
        node = self.root / "dev" / self.folder.name
        try:
            self._file = os.open(node, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise self._error(_why(node, error)) from error
        self._write(buffer / "enable", "1")

    def close(self) -> None:
        """Stops capturing, and puts back what was changed, the last first."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
        failed: list[str] = []
        while self._changed:
            path, before = self._changed.pop()
            try:
                set_attribute(path, before or "\n")
            except OSError as error:
                # A device that was unplugged has nothing to put back.
                if error.errno not in (errno.ENODEV, errno.ENOENT):
                    failed.append(_why(path, error))
        if failed:
            raise self._error(f"what was changed cannot be put back: {failed[0]}")

    def fileno(self) -> int:
        """Returns the descriptor of the buffer."""
        assert self._file is not None, "a buffer is waited for while it is open"
        return self._file

    def receive(self) -> dict[str, FloatArray]:
        """Scans that have come, each channel (n,), unscaled; raises `LogError` where it is gone."""
        assert self._file is not None, "a buffer is read while it is open"
        try:
            data = self._rest + os.read(self._file, PIECE_SCANS * self.scan.bytes)
        except BlockingIOError:
            data = self._rest
        except OSError as error:
            raise self._error(f"the device is gone: {error.strerror}; plug it in and start again") from error
        whole = len(data) // self.scan.bytes * self.scan.bytes
        self._rest = data[whole:]
        return self.scan.numbers(data[:whole])

    def triad(self, triad: CalibratedTriad, numbers: Mapping[str, FloatArray]) -> FloatArray:
        """Returns (n, 3) readings, m/s^2, rad/s or gauss, in the axes of what it is mounted in."""
        channel = CHANNELS[triad]
        axes = [self.scaled(f"{channel}_{axis}", numbers) for axis in "xyz"]
        matrix = self._mounting[triad]
        readings: FloatArray = np.column_stack(axes)
        return readings if matrix is None else readings @ matrix.T

    def scaled(self, channel: str, numbers: Mapping[str, FloatArray]) -> FloatArray:
        """Returns a channel in the unit that IIO has for it: (reading + offset) times scale."""
        offset, scale = self._scaling[channel]
        scaled: FloatArray = (numbers[channel] + offset) * scale
        return scaled

    def mount_matrix(self, triad: CalibratedTriad) -> FloatArray | None:
        """(3, 3) matrix to the axes of what it is mounted in; None where it is one, or unknown."""
        return self._mounting.get(triad)

    def _read_mount_matrix(self, triad: CalibratedTriad) -> FloatArray | None:
        for name in (f"{CHANNELS[triad]}_mount_matrix", "in_mount_matrix", "mount_matrix"):
            text = _text(self.folder / name)
            if text:
                return self._matrix(name, text)
        return None

    def _matrix(self, name: str, text: str) -> FloatArray | None:
        entries = [number_of(entry.strip()) for row in text.split(";") for entry in row.split(",")]
        if len(entries) != 9 or None in entries:
            raise self._error(f"{name} holds {text!r}, no 3 by 3 matrix; correct the device tree")
        matrix = np.array(entries, dtype=np.float64).reshape(3, 3)
        return None if np.array_equal(matrix, np.eye(3)) else matrix

    def _factor(self, channel: str, what: str, default: float) -> float:
        for name in (f"{channel}_{what}", f"{channel.rpartition('_')[0]}_{what}"):
            text = _text(self.folder / name)
            if text:
                value = number_of(text)
                if value is None:
                    raise self._error(f"{name} holds {text!r}, no number; check the driver")
                return value
        return default

    @property
    def _buffer(self) -> Path:
        for name in ("buffer0", "buffer"):
            if exists(self.folder / name / "enable"):
                return self.folder / name
        raise self._error(
            "its driver has no buffer, so samples cannot be captured; use a driver that has one, or a kernel "
            "with CONFIG_IIO_BUFFER"
        )

    @property
    def _elements(self) -> Path:
        merged = self._buffer
        return merged if any(merged.glob("in_*_en")) else self.folder / "scan_elements"

    def _all_elements(self) -> dict[str, Element]:
        folder, found = self._elements, {}
        for switch in sorted(folder.glob("in_*_en")):
            name = switch.name.removesuffix("_en")
            kind = _text(folder / f"{name}_type")
            element = parse_element(name, _text(folder / f"{name}_index"), kind)
            if element is None:
                raise self._error(f"{name} is stored as {kind!r}, which is not known here")
            found[name] = element
        return found

    def _choose_channels(self) -> None:
        wanted = {f"{CHANNELS[triad]}_{axis}" for triad in self.triads for axis in "xyz"}
        wanted |= {TIMESTAMP, TEMPERATURE}
        elements, folder = self._all_elements(), self._elements
        for name in elements:
            self._write(folder / f"{name}_en", "1" if name in wanted else "0")
        # Some devices capture more than they are asked for.
        self.scan = Scan([each for name, each in elements.items() if _text(folder / f"{name}_en") == "1"])
        if missing := sorted(wanted & set(elements) - set(self.scan.elements) - {TEMPERATURE}):
            raise self._error(f"its driver does not capture {', '.join(missing)} together with the others")

    def _choose_trigger(self, wanted: str | None) -> None:
        """Selects a trigger that samples when new data are ready, where the device needs one."""
        current = self.folder / "trigger/current_trigger"
        if not exists(current) or (wanted is None and _text(current)):
            return
        triggers = sorted(filter(None, (_text(path) for path in self.folder.parent.glob("trigger*/name"))))
        own = [trigger for trigger in triggers if trigger.startswith(self.name)]
        if wanted is None and not own:
            listed = ", ".join(triggers) or "none; create one under /sys/kernel/config/iio/triggers"
            raise self._error(
                f"no trigger says when to take samples; give one, as ?trigger=NAME (found: {listed})"
            )
        if wanted is not None and wanted not in triggers:
            raise self._error(f"no trigger {wanted!r}; found: {', '.join(triggers) or 'none'}")
        self._write(current, wanted or own[0])

    def _set_rate(self, rate: float) -> None:
        trigger = _text(self.folder / "trigger/current_trigger")
        beside = [path.parent for path in self.folder.parent.glob("trigger*/name") if _text(path) == trigger]
        names = [f"{CHANNELS[triad]}_sampling_frequency" for triad in self.triads if triad != "magnetometer"]
        places = [self.folder / name for name in (*names, "sampling_frequency")]
        places += [folder / "sampling_frequency" for folder in beside]
        found = [path for path in places if exists(path)]
        if not found:
            raise self._error("its rate cannot be set; leave out ?rate=")
        for path in found:
            self._write(path, f"{rate:g}")

    def _write(self, path: Path, value: str) -> None:
        """Changes an attribute, and keeps in mind what it was."""
        before = _text(path)
        if before == value:
            return
        try:
            set_attribute(path, value)
        except OSError as error:
            raise self._error(_why(path, error, value)) from error
        self._changed.append((path, before))

    def _error(self, why: str) -> LogError:
        return LogError(f"{self.address.text}: {self.name}: {why}")


def _text(path: Path) -> str:
    """Reads an attribute; empty where there is none."""
    return read_text_whole(path, _LONGEST_ATTRIBUTE, "attribute").strip() if exists(path) else ""


def _why(path: Path, error: OSError, value: str = "") -> str:
    if error.errno in (errno.EACCES, errno.EPERM):
        return f"no permission to use {path}; {GET_PERMISSION}"
    if error.errno == errno.EBUSY:
        return f"{path} is in use; close the program that captures from it"
    if error.errno == errno.EINVAL and value:
        return f"{path} does not take {value}; see what it offers in {path}_available"
    return f"{path} cannot be used: {error.strerror}"
