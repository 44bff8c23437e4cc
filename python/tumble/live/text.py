"""Text over a serial line or UDP: a sample a line, as numbers under column names or as JSON."""

from __future__ import annotations

import time
from pathlib import PurePath
from types import TracebackType

from tumble.errors import LogError
from tumble.live.address import Address, host_and_port
from tumble.live.conditioning import EMPTY, Conditioner
from tumble.live.lines import LONGEST_LINE, LineSplitter
from tumble.live.readings import StreamFacts
from tumble.live.rows import RowReader
from tumble.live.source import LiveChunk, PolledSource
from tumble.live.transport import DEFAULT_BAUD, DatagramSocket, SerialLine, Transport
from tumble.logs.options import ReadOptions


def open_serial(address: Address, options: ReadOptions) -> TextSource:
    """Make a source of `serial:DEVICE?baud=115200`."""
    address.refuse_other_settings("baud")
    line = SerialLine(address, address.place, int(address.number("baud", DEFAULT_BAUD)))
    return TextSource(address, options, line, PurePath(address.place).name)


def open_udp(address: Address, options: ReadOptions) -> TextSource:
    """Make a source of `udp://HOST:PORT?from=ADDRESS`, to which devices send."""
    address.refuse_other_settings("from")
    host, port = host_and_port(address, address.place)
    return TextSource(address, options, DatagramSocket(address, host, port), f"udp-{port}")


class TextSource(PolledSource):
    """Reads text from whatever carries it; a `Source`."""

    def __init__(self, address: Address, options: ReadOptions, transport: Transport, name: str) -> None:
        self.name = name
        self._source = address.text
        self._transport = transport
        self._splitter = LineSplitter()
        self._rows = RowReader(address.text, options, joined_midway=not transport.whole)
        self._conditioner = Conditioner(options)

    @property
    def remarks(self) -> tuple[str, ...]:
        """See `Source`."""
        return (*self._rows.notices, *self._conditioner.notices, *self._transport.notices)

    @property
    def gyroscope_unit_is_assumed(self) -> bool:
        """See `Source`."""
        return self._conditioner.gyroscope_unit_is_assumed

    @property
    def stamped(self) -> bool:
        """See `Source`."""
        return self._conditioner.stamped

    def __enter__(self) -> TextSource:
        self._transport.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._transport.__exit__(kind, error, trace)

    def fileno(self) -> int | None:
        """See `Source`."""
        return self._transport.fileno()

    def read(self) -> LiveChunk:
        """See `Source`."""
        piece, arrival = self._transport.receive(), time.monotonic()
        readings = self._rows.read(self._lines(piece)) if piece else None
        return EMPTY if readings is None else self._conditioner.take(readings, self._facts(), arrival)

    def _lines(self, piece: bytes) -> list[bytes]:
        if not self._transport.whole:
            lines = self._splitter.split(piece)
            if self._splitter.torn > 1:
                raise LogError(
                    f"{self._source}: {LONGEST_LINE} bytes came without a line end: this is no text, or the "
                    "baud rate is wrong; check ?baud= and what the device sends"
                )
            return lines
        if piece.lstrip().startswith(b"["):
            return [piece.replace(b"\n", b" ")]
        return [line for line in piece.splitlines() if line.strip()]

    def _facts(self) -> StreamFacts:
        columns = self._rows.columns
        return StreamFacts(
            self._source,
            columns.time is not None,
            columns.accelerometer_unit,
            columns.gyroscope_unit,
            columns.time_unit,
            columns.temperature_unit,
        )
