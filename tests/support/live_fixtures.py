"""Devices to read live: a serial line made of a pseudo-terminal, and bytes that were written down."""

from __future__ import annotations

import os
import pty
import selectors
import sys
import threading
import tty
from contextlib import contextmanager, suppress
from dataclasses import replace

import numpy as np

from tumble.foundation import clock
from tumble.live.address import parse_address
from tumble.live.text import TextLine
from tumble.logs import ReadOptions

READY, _end = os.pipe()
"""A descriptor that can always be read."""
os.close(_end)
HEADER = "time,ax,ay,az,gx,gy,gz"


class ScriptIsOverError(Exception):
    """All bytes of a script were read."""


class Scripted:
    """A transport that carries these pieces, each at its time of arrival, then nothing more."""

    notices = ()
    reorder_window = 0.0
    unread = 0
    sender = None

    def __init__(self, pieces, whole=False, arrivals=()):
        self._arrivals, self._began = iter(arrivals), clock.now()
        self.whole = whole
        self.joined_midway = not whole
        self.sent = []
        self._pieces = list(pieces)
        self._pause = False

    def fileno(self):
        return READY

    def receive(self):
        # One piece comes, then nothing for a while.
        self._pause = not self._pause and self.whole
        if not self._pause and self.whole:
            return b""
        if not self._pieces:
            raise ScriptIsOverError
        if (arrival := next(self._arrivals, None)) is not None:
            clock.sleep(max(0.0, self._began + arrival - clock.now()))
        return self._pieces.pop(0)

    def send(self, data):
        self.sent.append(data)

    def __enter__(self):
        return self

    def __exit__(self, *error): ...


def scripted(pieces, whole=False, arrivals=(), **options):
    """A text source that reads these pieces."""
    return scripted_units(pieces, [None], whole, arrivals, **options)[0]


def scripted_units(pieces, units, whole=False, arrivals=(), **options):
    """A text source for each of these units, which read these pieces together."""
    text, read = "udp://test:1" if whole else "serial:/dev/test", ReadOptions(**options)
    line = TextLine(parse_address(text), read, Scripted(pieces, whole, arrivals), "test")
    return [line.unit(replace(parse_address(text), unit=unit), read) for unit in units]


def chunks_of(source):
    """All chunks with samples that a source gives before its script is over."""
    found = []
    with source, suppress(ScriptIsOverError):
        found.extend(chunk for chunk in source if len(chunk))
    return found


def samples_of(source):
    """(n, 7) time, specific force, angular rate of all samples that a source gives."""
    chunks = chunks_of(source)
    rows = [np.column_stack([each.time, each.accelerometer, each.gyroscope]) for each in chunks]
    return np.concatenate(rows) if rows else np.empty((0, 7))


def first_samples(source, count, silence=50):
    """(count, 7) of the first samples of a source; fewer if nothing comes for so many heartbeats."""
    rows, silent = np.empty((0, 7)), 0
    for chunk in source:
        rows = np.concatenate([rows, np.column_stack([chunk.time, chunk.accelerometer, chunk.gyroscope])])
        silent = 0 if len(chunk) else silent + 1
        if len(rows) >= count or silent >= silence:
            break
    return rows[:count]


def resting(count, rate=100.0, seed=0):
    """(count, 7) samples of an IMU that lies on a table."""
    generator = np.random.default_rng(seed)
    table = np.column_stack([np.arange(count) / rate, np.zeros((count, 6))])
    table[:, 3] = 9.80665
    table[:, 1:] += 0.01 * generator.standard_normal((count, 6))
    return table


def text_lines(table, header=HEADER, separator=","):
    """Bytes of a header and a line a sample; every number as exact as Python prints it."""
    rows = [separator.join(map(repr, row)) for row in np.asarray(table).tolist()]
    return "".join(f"{line}\r\n" for line in ([header] if header else []) + rows).encode()


def pieces_of(data, size):
    """The bytes in pieces of that size."""
    return [data[first : first + size] for first in range(0, len(data), size)]


class SerialDevice:
    """A device on a serial line. Bytes sent before the line is opened are lost, as on any serial line."""

    def __init__(self):
        self._device, self._line = pty.openpty()
        tty.setraw(self._line)
        self.path = os.ttyname(self._line)
        self._unplugged = threading.Event()
        self._writers = []

    def write(self, data):
        """Sends in the background, as fast as it is read."""
        writer = clock.thread(self._send, data)
        self._writers.append(writer)
        writer.start()

    def written(self):
        """Waits until everything was read, or at least lies ready to be."""
        for writer in self._writers:
            clock.wait(writer)

    def unplug(self):
        """Disconnects the device."""
        if not self._unplugged.is_set():
            self._unplugged.set()
            self.written()
            os.close(self._line)
            os.close(self._device)

    def _send(self, data):
        with selectors.DefaultSelector() as line:
            line.register(self._device, selectors.EVENT_WRITE)
            while data and not self._unplugged.is_set():
                if clock.select(line, 0.05):
                    data = data[os.write(self._device, data[:512]) :]


@contextmanager
def serial_device():
    """A device that is unplugged at the end at the latest."""
    device = SerialDevice()
    try:
        yield device
    finally:
        device.unplug()


@contextmanager
def piped(monkeypatch, data):
    """Standard input that holds these bytes."""
    read, write = os.pipe()
    with os.fdopen(read) as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        os.write(write, data)
        os.close(write)
        yield
