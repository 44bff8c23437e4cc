"""Where samples go while they come: standard output, UDP, MAVLink, ROS 2 or a file, as typed after `--to`."""

from __future__ import annotations

import json
import math
import socket
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from tumble.foundation.errors import LogError, OutputError
from tumble.foundation.files import check_output
from tumble.foundation.recording import Chunk
from tumble.foundation.words import LIVE_OUTPUTS
from tumble.live.address import Address, host_and_port, parse_address
from tumble.logs.mavlink_messages import DIALECT, HIGHRES_TEMPERATURE
from tumble.logs.optional import imported
from tumble.logs.writer import Facts, Writer
from tumble.logs.writers import FORMATS, format_for, open_writer

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Place: TypeAlias = Any
"""Address of a socket: host and port, and more where they are those of version 6."""

STDOUT = "stdout"
NAMES = ("time", "ax", "ay", "az", "gx", "gy", "gz", "temperature")
"""Names of the values that are sent, in s, m/s^2, rad/s and degC."""
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

    def open(self, facts: Facts) -> AbstractContextManager[Writer]:
        """See `Output`."""
        return open_writer(self.path, facts=facts)


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
        except BrokenPipeError as error:
            raise OutputError("standard output: its reader has ended; start both programs again") from error

    def close(self) -> None: ...

    def _rows(self, chunk: Chunk) -> list[str]:
        head = []
        if not self._names:
            self._names = NAMES if chunk.temperature is not None else NAMES[:-1]
            of_a_set = OF_A_SET if isinstance(chunk, SetChunk) else ()
            head = [",".join((*self._names, *of_a_set))]
        rows = [",".join(map(repr, row[: len(self._names)])) for row in rows_of(chunk)]
        if isinstance(chunk, SetChunk):
            rows = [f"{row},{chunk.source},{flags}" for row, flags in zip(rows, chunk.flag_list, strict=True)]
        return head + rows


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
        if (now := time.monotonic()) >= self._heartbeat_at:
            self._heartbeat_at = now + BETWEEN_HEARTBEATS
            self._line.send(self._heartbeat())
        unit = chunk.unit if isinstance(chunk, SetChunk) else 0
        for row in rows_of(chunk):
            self._line.send(self._message(row, unit))

    def close(self) -> None: ...

    def _message(self, row: Sequence[float], unit: int) -> bytes:
        temperature = row[-1] if len(row) == len(NAMES) and math.isfinite(row[-1]) else None
        # The lowest six bits are those of the axes.
        updated = sum(1 << bit for bit, value in enumerate(row[1:7]) if math.isfinite(value))
        updated |= 0 if temperature is None else HIGHRES_TEMPERATURE
        others = (0.0,) * 3 + (0.0, 0.0, 0.0, temperature or 0.0)
        message = self._dialect.MAVLink_highres_imu_message(
            max(0, round(1e6 * row[0])), *row[1:7], *others, updated, unit
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


def rows_of(chunk: Chunk) -> list[list[float]]:
    """Returns a row a sample, in the order of `NAMES`."""
    times, triads = chunk.time.tolist(), (chunk.accelerometer.tolist(), chunk.gyroscope.tolist())
    rows = [[time, *force, *rate] for time, force, rate in zip(times, *triads, strict=True)]
    if chunk.temperature is not None:
        for row, degrees in zip(rows, chunk.temperature.tolist(), strict=True):
            row.append(degrees)
    return rows


def json_lines(chunk: Chunk) -> list[str]:
    """Returns a JSON object a sample; what is no number is null."""
    # Written by hand: a library takes ten times as long, which counts at 8000 samples a second.
    plain = _JSON_ROW if chunk.temperature is not None else _JSON_ROW_WITHOUT_TEMPERATURE
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


def _json_row(names: Sequence[str]) -> str:
    return "{" + ", ".join(f'"{name}": %s' for name in names) + "}"


_JSON_ROW, _JSON_ROW_WITHOUT_TEMPERATURE = _json_row(NAMES), _json_row(NAMES[:-1])


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
    address.refuse_other_settings("domain")
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
