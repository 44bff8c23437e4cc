"""Where samples go while they come: standard output, UDP, MAVLink, ROS 2 or a file, as typed after `--to`."""

from __future__ import annotations

import json
import math
import socket
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np

from tumble.foundation import clock
from tumble.foundation.errors import LogError, OutputError, ReaderGoneError
from tumble.foundation.files import check_output
from tumble.foundation.magnetic import MAGNETIC_CHANNELS
from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.units import FIELD_UNITS
from tumble.foundation.words import LIVE_OUTPUTS
from tumble.live.address import Address, host_and_port, parse_address
from tumble.logs.magnetic_rows import ChunkWithField
from tumble.logs.mavlink_messages import DIALECT, HIGHRES_TEMPERATURE
from tumble.logs.optional import imported
from tumble.logs.writer import Facts, Writer
from tumble.logs.writers import FORMATS, format_for, open_mcap_writer, open_writer

if TYPE_CHECKING:
    from numpy.typing import NDArray

Place: TypeAlias = Any
"""Address of a socket: host and port, and more where they are those of version 6."""

STDOUT = "stdout"
NAMES = ("time", "ax", "ay", "az", "gx", "gy", "gz", "temperature")
"""Names of the values that are sent, in s, m/s^2, rad/s and degC, before those of a magnetometer in uT."""
OF_A_SET = ("source", "flags")
"""Additional values that are sent of a `SetChunk`."""
LARGEST_PAYLOAD = 1400
"""Bytes of a datagram that goes through most networks in one piece."""
SYSTEM, PERIPHERAL = 1, 158
"""MAVLink identifiers of Tumble: a peripheral of the vehicle."""
BETWEEN_HEARTBEATS = 1.0
"""s, on MAVLink: a system without one for long is taken to be gone."""


@dataclass(frozen=True, slots=True)
class SetChunk(Chunk):
    """Samples that one of several units gave for all of them."""

    unit: int = 0
    """Its number, 0 the primary."""
    source: str = ""
    """Its name."""
    flags: NDArray[np.int64] | None = None
    """(n,) what is to be known of each sample, as in `procedures.redundancy.result.FLAGS`; None: nothing."""

    @property
    def flag_list(self) -> list[int]:
        """Flags of each sample."""
        return [0] * len(self) if self.flags is None else self.flags.tolist()


class Output(Protocol):
    """Where samples are to go; made of what was typed before there are any."""

    @property
    def name(self) -> str:
        """Address as typed by the user."""

    def open(self, facts: Facts) -> AbstractContextManager[Writer]:
        """Opens it; what it takes is there, or on its way, when `write` returns.

        Raises `OutputError`, in one line, as `write` does, where it takes no more.
        """


def parse_output(text: str, *, as_json: bool = False) -> Output:
    """Finds the output that was typed: `stdout`, `udp:`, `mavlink:` or `ros2:`, or FILE.

    With `as_json` standard output is given a JSON object a sample, else rows under names of columns.

    Raises `OutputError` where it is none of these, the host is not known, or the file cannot be written.
    """
    if text == STDOUT:
        return StandardOutput(as_json)
    scheme = text.partition(":")[0].lower()
    if scheme in _SENDERS:
        try:
            return _SENDERS[scheme](parse_address(text))
        except LogError as error:
            raise OutputError(str(error)) from error
    path = Path(text)
    if path.suffix.removeprefix(".").lower() not in FORMATS:
        raise OutputError(
            f"--to {text}: give {LIVE_OUTPUTS}, or a file that ends in "
            f"{', '.join('.' + name for name in FORMATS)}"
        )
    check_output(path, FORMATS[format_for(path)])
    return FileOutput(path)


@dataclass(frozen=True, slots=True)
class FileOutput:
    """A log, which takes its place under its name once the stream has ended."""

    path: Path

    @property
    def name(self) -> str:
        """See `Output`."""
        return str(self.path)

    @contextmanager
    def open(self, facts: Facts) -> Iterator[Writer]:
        """See `Output`."""
        with ExitStack() as opened:
            writer = _LogFile(self.path, facts, opened)
            yield writer
            writer.close()


class _LogFile:
    """Opens a log with the columns that the first samples have."""

    def __init__(self, path: Path, facts: Facts, opened: ExitStack) -> None:
        self._path = path
        self._facts = facts
        self._opened = opened
        self._write: Callable[[Chunk], None] | None = None

    def write(self, chunk: Chunk) -> None:
        if self._write is None:
            self._write = self._writing(has_field=field_of(chunk) is not None)
        self._write(chunk)

    def close(self) -> None:
        if self._write is None:
            self._writing(has_field=False)

    def _writing(self, *, has_field: bool) -> Callable[[Chunk], None]:
        if not has_field:
            return self._opened.enter_context(open_writer(self._path, facts=self._facts)).write
        if format_for(self._path) == "mcap":
            topics = self._opened.enter_context(open_mcap_writer(self._path, self._facts))

            def write(chunk: Chunk) -> None:
                topics.write(chunk)
                if (track := getattr(chunk, "magnetic", None)) is not None:
                    topics.write_magnetic(track)

            return write
        facts = replace(self._facts, further=MAGNETIC_CHANNELS)
        writer = self._opened.enter_context(open_writer(self._path, facts=facts))
        return lambda chunk: writer.write(_with_columns(chunk))


def field_of(chunk: Chunk) -> FloatArray | None:
    """Returns readings of a magnetometer, (n, 3) uT, NaN in rows without one; None where there are none."""
    field: FloatArray | None = getattr(chunk, "field", None)
    return field


def _with_columns(chunk: Chunk) -> ChunkWithField:
    """Returns samples with the axes of their magnetometer as columns."""
    field = field_of(chunk)
    x, y, z = np.full((3, len(chunk)), np.nan) if field is None else field.T
    return ChunkWithField(
        chunk.time, chunk.accelerometer, chunk.gyroscope, chunk.temperature, mx=x, my=y, mz=z
    )


@dataclass(frozen=True, slots=True)
class StandardOutput:
    """Rows under names of columns, or JSON, a line a sample, each on its way at once."""

    as_json: bool
    name: str = STDOUT

    @contextmanager
    def open(self, facts: Facts) -> Iterator[Writer]:
        """See `Output`."""
        yield _Lines(self.as_json)


class _Lines:
    def __init__(self, as_json: bool) -> None:
        self._as_json = as_json
        self._names: Sequence[str] = ()

    def write(self, chunk: Chunk) -> None:
        lines = json_lines(chunk) if self._as_json else self._rows(chunk)
        try:
            sys.stdout.write("".join(f"{line}\n" for line in lines))
            sys.stdout.flush()
        except (BrokenPipeError, ReaderGoneError) as error:
            raise OutputError("standard output: its reader has ended; start both programs again") from error

    def close(self) -> None: ...

    def _rows(self, chunk: Chunk) -> list[str]:
        head = []
        if not self._names:
            self._names = names_of(chunk)
            of_a_set = OF_A_SET if isinstance(chunk, SetChunk) else ()
            head = [",".join((*self._names, *of_a_set))]
        rows = [",".join(map(repr, row)) for row in self._values(chunk)]
        if isinstance(chunk, SetChunk):
            rows = [f"{row},{chunk.source},{flags}" for row, flags in zip(rows, chunk.flag_list, strict=True)]
        return head + rows

    def _values(self, chunk: Chunk) -> list[list[float]]:
        """Returns a row a sample under the names of the first, NaN for what this chunk lacks."""
        names, rows = names_of(chunk), rows_of(chunk)
        if names == self._names:
            return rows
        places = [names.index(name) if name in names else None for name in self._names]
        return [[math.nan if place is None else row[place] for place in places] for row in rows]


@dataclass(frozen=True, slots=True)
class DatagramOutput:
    """JSON over UDP: an object a sample, samples that came together in one datagram."""

    name: str
    place: tuple[socket.AddressFamily, Place]

    @contextmanager
    def open(self, facts: Facts) -> Iterator[Writer]:
        """See `Output`."""
        with _datagrams(self.name, self.place) as line:
            yield _JsonDatagrams(line)


@dataclass(frozen=True, slots=True)
class MavlinkOutput:
    """`HIGHRES_IMU`, a message a sample, with a heartbeat every second."""

    address: Address
    place: tuple[socket.AddressFamily, Place]

    @property
    def name(self) -> str:
        """See `Output`."""
        return self.address.text

    @contextmanager
    def open(self, facts: Facts) -> Iterator[Writer]:
        """See `Output`."""
        dialect = imported(DIALECT, self.address.text, "live")
        with _datagrams(self.name, self.place) as line:
            yield _MavlinkMessages(dialect, line)


class _Datagrams:
    """Sends datagrams to one place; whether anybody listens there nobody knows."""

    def __init__(self, name: str, line: socket.socket, place: Place) -> None:
        self._name = name
        self._line = line
        self._place = place

    def send(self, payload: bytes) -> None:
        try:
            self._line.sendto(payload, self._place)
        except OSError as error:
            raise OutputError(
                f"{self._name}: cannot send: {error.strerror or error}; check address and network"
            ) from error


class _JsonDatagrams:
    def __init__(self, line: _Datagrams) -> None:
        self._line = line

    def write(self, chunk: Chunk) -> None:
        payload = b""
        for text in json_lines(chunk):
            piece = text.encode() + b"\n"
            if payload and len(payload) + len(piece) > LARGEST_PAYLOAD:
                self._line.send(payload)
                payload = b""
            payload += piece
        if payload:
            self._line.send(payload)

    def close(self) -> None: ...


class _MavlinkMessages:
    def __init__(self, dialect: Any, line: _Datagrams) -> None:  # noqa: ANN401 - pymavlink has no types
        self._dialect = dialect
        self._line = line
        self._sender = dialect.MAVLink(None, srcSystem=SYSTEM, srcComponent=PERIPHERAL)
        self._heartbeat_at = -math.inf

    def write(self, chunk: Chunk) -> None:
        if (now := clock.now()) >= self._heartbeat_at:
            self._heartbeat_at = now + BETWEEN_HEARTBEATS
            self._line.send(self._heartbeat())
        unit = chunk.unit if isinstance(chunk, SetChunk) else 0
        names = names_of(chunk)
        for row in rows_of(chunk):
            self._line.send(self._message(dict(zip(names, row, strict=True)), unit))

    def close(self) -> None: ...

    def _message(self, values: Mapping[str, float], unit: int) -> bytes:
        measured = [values.get(name, math.nan) for name in (*NAMES[1:7], *MAGNETIC_CHANNELS)]
        # The lowest nine bits are those of the axes.
        updated = sum(1 << bit for bit, value in enumerate(measured) if math.isfinite(value))
        temperature = values.get("temperature", math.nan)
        updated |= HIGHRES_TEMPERATURE if math.isfinite(temperature) else 0
        gauss = [value / FIELD_UNITS["G"] if math.isfinite(value) else 0.0 for value in measured[6:]]
        pressures = (0.0, 0.0, 0.0)
        message = self._dialect.MAVLink_highres_imu_message(
            max(0, round(1e6 * values["time"])),
            *measured[:6],
            *gauss,
            *pressures,
            temperature if math.isfinite(temperature) else 0.0,
            updated,
            unit,
        )
        packed: bytes = message.pack(self._sender)
        return packed

    def _heartbeat(self) -> bytes:
        dialect = self._dialect
        message = dialect.MAVLink_heartbeat_message(
            dialect.MAV_TYPE_GENERIC,
            dialect.MAV_AUTOPILOT_INVALID,
            0,
            0,
            dialect.MAV_STATE_ACTIVE,
            3,
        )
        packed: bytes = message.pack(self._sender)
        return packed


def names_of(chunk: Chunk) -> tuple[str, ...]:
    """Returns the names of the values that samples have, those of `NAMES` first."""
    plain = NAMES[:-1] if chunk.temperature is None else NAMES
    return plain if field_of(chunk) is None else (*plain, *MAGNETIC_CHANNELS)


def rows_of(chunk: Chunk) -> list[list[float]]:
    """Returns a row a sample, in the order of `names_of`."""
    times, triads = chunk.time.tolist(), (chunk.accelerometer.tolist(), chunk.gyroscope.tolist())
    rows = [[time, *force, *rate] for time, force, rate in zip(times, *triads, strict=True)]
    if chunk.temperature is not None:
        for row, degrees in zip(rows, chunk.temperature.tolist(), strict=True):
            row.append(degrees)
    if (field := field_of(chunk)) is not None:
        for row, reading in zip(rows, field.tolist(), strict=True):
            row += reading
    return rows


def json_lines(chunk: Chunk) -> list[str]:
    """Returns a JSON object a sample; what is no number is null."""
    # Written by hand: a library takes ten times as long, which counts at 8000 samples a second.
    plain = _json_row(names_of(chunk))
    lines = [
        plain % tuple(row if math.isfinite(sum(row)) else [_json_number(value) for value in row])
        for row in rows_of(chunk)
    ]
    if isinstance(chunk, SetChunk):
        source = json.dumps(chunk.source)
        lines = [
            f'{line[:-1]}, "source": {source}, "flags": {flags}}}'
            for line, flags in zip(lines, chunk.flag_list, strict=True)
        ]
    return lines


@cache
def _json_row(names: tuple[str, ...]) -> str:
    return "{" + ", ".join(f'"{name}": %s' for name in names) + "}"


def _json_number(value: float) -> str:
    return repr(value) if math.isfinite(value) else "null"


def _udp(address: Address) -> Output:
    address.refuse_other_settings()
    host, port = host_and_port(address, address.place)
    return DatagramOutput(address.text, _place(address, host, port))


def _mavlink(address: Address) -> Output:
    address.refuse_other_settings()
    link, _, place = address.place.partition(":")
    if link != "udpout":
        raise OutputError(f"{address.text}: expected mavlink:udpout:HOST:PORT")
    host, port = host_and_port(address, place)
    return MavlinkOutput(address, _place(address, host, port))


def _ros2(address: Address) -> Output:
    address.refuse_other_settings("domain", "magnetometer")
    output: Output = imported("tumble.live.ros2_output", address.text, "ros2").Ros2Output(address)
    return output


_SENDERS: Mapping[str, Callable[[Address], Output]] = {"udp": _udp, "mavlink": _mavlink, "ros2": _ros2}
"""Outputs that send, by scheme."""


def _place(address: Address, host: str, port: int) -> tuple[socket.AddressFamily, Place]:
    try:
        family, _, _, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    except (OSError, UnicodeError) as error:
        raise OutputError(f"{address.text}: no host {host!r} to send to; check its name") from error
    return family, place


@contextmanager
def _datagrams(name: str, place: tuple[socket.AddressFamily, Place]) -> Iterator[_Datagrams]:
    family, where = place
    with socket.socket(family, socket.SOCK_DGRAM) as line:
        yield _Datagrams(name, line, where)
