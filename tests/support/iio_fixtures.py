"""A folder that imitates what Linux shows of its sensors: `sys/bus/iio/devices` and `dev`."""

from __future__ import annotations

import os

import numpy as np

DEVICES = "sys/bus/iio/devices"


class ImitatedDevice:
    """A device with these channels, each `name: (type, index)`; its buffer is a pipe."""

    def __init__(self, root, number, name, channels, attributes=(), merged=False):
        self.folder = root / DEVICES / f"iio:device{number}"
        elements = self.folder / ("buffer0" if merged else "scan_elements")
        buffer = self.folder / ("buffer0" if merged else "buffer")
        for folder in (elements, buffer, root / "dev"):
            folder.mkdir(parents=True, exist_ok=True)
        self.write("name", name)
        self.write("current_timestamp_clock", "realtime")
        for channel, (kind, index) in channels.items():
            for what, value in (("en", "0"), ("type", kind), ("index", str(index))):
                (elements / f"{channel}_{what}").write_text(f"{value}\n")
        (buffer / "enable").write_text("0\n")
        (buffer / "length").write_text("2\n")
        for attribute, value in dict(attributes).items():
            self.write(attribute, value)
        self.node = root / "dev" / f"iio:device{number}"
        os.mkfifo(self.node)
        self._keep_open = os.open(self.node, os.O_RDWR | os.O_NONBLOCK)

    def write(self, attribute, value):
        path = self.folder / attribute
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{value}\n")

    def send(self, data):
        """Puts scans into the buffer."""
        os.write(self._keep_open, data)

    def close(self):
        os.close(self._keep_open)

    def state(self):
        """Everything that sysfs shows."""
        return {
            str(path.relative_to(self.folder)): path.read_text().strip()
            for path in sorted(self.folder.rglob("*"))
            if path.is_file()
        }


def axes(channel, kind, first):
    """Three channels of a triad."""
    return {f"{channel}_{axis}": (kind, first + place) for place, axis in enumerate("xyz")}


def stored(values, kind):
    """Bytes of each whole number as a channel of that type stores it, (n, size)."""
    order, rest = kind.split(":")
    bits, storage = rest.lstrip("su").partition(">>")[0].split("/")
    shift = int(rest.partition(">>")[2] or 0)
    mask = (1 << int(bits)) - 1
    # Bits that are no part of the number hold anything.
    rubbish = (1 << shift) - 1
    size = int(storage) // 8
    return np.array(
        [
            list(
                (((int(value) & mask) << shift) | rubbish).to_bytes(
                    size, "big" if order == "be" else "little"
                )
            )
            for value in values
        ],
        dtype=np.uint8,
    )


def scans(columns, size):
    """Bytes of scans, each `size` long; `columns` are (values, type, offset)."""
    table = np.full((len(columns[0][0]), size), 0xA5, dtype=np.uint8)
    for values, kind, offset in columns:
        part = stored(values, kind)
        table[:, offset : offset + part.shape[1]] = part
    return table.tobytes()
