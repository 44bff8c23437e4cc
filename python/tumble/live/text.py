"""Text over whatever carries it: a sample a line, as numbers under column names or as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path, PurePath
from typing import cast

from tumble.foundation.errors import LogError
from tumble.foundation.words import join
from tumble.live.address import STANDARD_INPUT, Address, host_and_port
from tumble.live.labels import FOR_ALL, UNLABELLED, LabelChoice, LabelledRow, LabelReader
from tumble.live.lines import LONGEST_LINE, LineSplitter
from tumble.live.readings import Readings, StreamFacts
from tumble.live.ros_echo import EchoedMessages
from tumble.live.rows import RowReader
from tumble.live.shared_line import LineUnit, SharedLine
from tumble.live.source import Source
from tumble.live.streams import GrowingFile, StandardInput, TcpConnection
from tumble.live.transport import DEFAULT_BAUD, DatagramSocket, SerialLine, Transport
from tumble.logs.columns import ImuColumns
from tumble.logs.options import ReadOptions
from tumble.logs.read_as import ReadAs


def serial_line(address: Address, options: ReadOptions) -> TextLine:
    """Creates the line of `serial:DEVICE?baud=115200`."""
    address.refuse_other_settings("baud")
    line = SerialLine(address, address.place, int(address.number("baud", DEFAULT_BAUD)))
    return TextLine(address, options, line, PurePath(address.place).name)


def udp_line(address: Address, options: ReadOptions) -> TextLine:
    """Creates the line of `udp://HOST:PORT?from=ADDRESS&reorder=0.05`, to which devices send."""
    address.refuse_other_settings("from", "reorder")
    host, port = host_and_port(address, address.place)
    return TextLine(address, options, DatagramSocket(address, host, port), f"udp-{port}")


def tcp_line(address: Address, options: ReadOptions) -> TextLine:
    """Creates the line of `tcp://HOST:PORT`, to which it connects."""
    address.refuse_other_settings()
    host, port = host_and_port(address, address.place)
    return TextLine(address, options, TcpConnection(address, host, port), f"tcp-{port}")


def piped_line(address: Address, options: ReadOptions) -> TextLine:
    """Creates the line of `stdin:`."""
    address.refuse_other_settings()
    return TextLine(address, options, StandardInput(address), STANDARD_INPUT)


def file_line(address: Address, options: ReadOptions) -> TextLine:
    """Creates the line of `file:PATH?from=end`, a file that grows."""
    address.refuse_other_settings("from")
    begin = address.settings.get("from", "end")
    if begin not in ("start", "end"):
        raise LogError(f"{address.text}: from={begin}: give start or end")
    path = Path(address.place)
    file = GrowingFile(address, path, options, from_start=begin == "start")
    return TextLine(address, options, file, path.stem)


class TextLine(SharedLine[LabelledRow]):
    """A line that carries text, of one unit or several."""

    def __init__(self, address: Address, options: ReadOptions, transport: Transport, name: str) -> None:
        super().__init__(address, transport, name)
        self._splitter = LineSplitter()
        self._echoed = EchoedMessages()
        self._labels = LabelReader(options)
        self._follows = False
        self.heard = self._labels.heard
        """Rows of each unit so far, where rows are labelled."""

    def follow(self, previous: TextLine) -> None:
        """Reads labels on as on the line that this one is the return of, until it names columns itself."""
        if previous is not self and not self._follows:
            self._follows = True
            self._labels.follow(previous._labels)

    def unit(self, address: Address, options: ReadOptions) -> TextUnit:
        """See `SharedLine`."""
        unit = TextUnit(self, address, options)
        if unit.wanted is not None:
            self._labels.expect(unit.wanted)
        return unit

    def _open(self) -> None:
        # The next bytes come behind a gap, except in a pipe, which waits.
        if not isinstance(self.transport, StandardInput):
            self._splitter = LineSplitter()
        super()._open()

    def _parts(self, piece: bytes) -> list[LabelledRow]:
        return self._labels.read(self._lines(piece))

    def _lines(self, piece: bytes) -> list[bytes]:
        if not self.transport.whole:
            lines = self._splitter.split(piece)
            if self._splitter.torn > 1:
                raise LogError(
                    f"{self.address.text}: {LONGEST_LINE} bytes came without a line end: this is no text, or "
                    "the baud rate is wrong; check ?baud= and what the device sends"
                )
            return list(self._echoed.gather(lines))
        if piece.lstrip().startswith(b"["):
            return [piece.replace(b"\n", b" ")]
        return [line for line in piece.splitlines() if line.strip()]


class TextUnit(LineUnit[LabelledRow]):
    """One unit of those that send text over a line."""

    def __init__(self, line: TextLine, address: Address, options: ReadOptions) -> None:
        super().__init__(line, address, options)
        joined_midway = line.transport.joined_midway
        self._source = address.text
        self._heard = line.heard
        self._choice = LabelChoice(address, self.wanted, joined_midway=joined_midway)
        self._rows = RowReader(address, options, joined_midway=joined_midway, whole=line.transport.whole)
        self._stated: tuple[ImuColumns, StreamFacts] | None = None

    @property
    def read_as(self) -> ReadAs | None:
        """See `Source`."""
        if not self._conditioner.is_decided:
            return None
        return self._rows.read_as(self._conditioner.lasting_units)

    def go_on_as(self, before: ReadAs) -> None:
        """See `Source`."""
        super().go_on_as(before)
        self._rows.go_on_as(before)

    def follow(self, previous: Source) -> None:
        """See `ConditionedSource`."""
        super().follow(previous)
        if isinstance(previous, TextUnit):
            cast("TextLine", self.line).follow(cast("TextLine", previous.line))
            self._choice.follow(previous._choice)
            self._rows.follow(previous._rows)

    @property
    def refusal(self) -> LogError | None:
        """See `LineUnit`."""
        return super().refusal or self._rows.refusal

    @property
    def remarks(self) -> tuple[str, ...]:
        """See `Source`."""
        others = sorted(
            label for label, count in self._heard.items() if count > 1 and label != self._choice.label
        )
        beside = (
            (f"the line also carries {join(others)}",) if others and self._choice.label is not None else ()
        )
        return (*beside, *self._rows.notices, *super().remarks)

    def _readings(self, parts: Sequence[LabelledRow]) -> tuple[Readings, StreamFacts] | None:
        rows = self._choice.mine(parts)
        self._rows.prefix = self._choice.prefix
        readings = self._rows.read(rows)
        return None if readings is None else (readings, self._facts())

    @property
    def _keeps(self) -> bool:
        """See `LineUnit`."""
        return self._rows.keeps or self._choice.keeps

    def _concerns(self, part: LabelledRow) -> bool:
        """See `LineUnit`."""
        return self.wanted is None or part.label in (UNLABELLED, FOR_ALL, self.wanted)

    def _facts(self) -> StreamFacts:
        columns = self._rows.columns
        if self._stated is None or self._stated[0] is not columns:
            facts = StreamFacts(
                self._source,
                columns.time is not None,
                columns.accelerometer_unit,
                columns.gyroscope_unit,
                columns.time_unit,
                columns.temperature_unit,
                columns.magnetometer.unit if columns.magnetometer else None,
            )
            self._stated = columns, facts
        return self._stated[1]
