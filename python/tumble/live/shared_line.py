"""One line that is opened once, and the units that are received on it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import suppress
from threading import Lock
from types import TracebackType
from typing import Any, Generic, TypeVar

from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.foundation.words import count_of
from tumble.live.address import Address
from tumble.live.conditioning import ConditionedSource
from tumble.live.one_sender import OneSender, Piece
from tumble.live.readings import Readings, StreamFacts
from tumble.live.source import LiveChunk
from tumble.live.transport import Transport
from tumble.logs.options import ReadOptions
from tumble.logs.track import one_name

Part = TypeVar("Part")
"""Part into which a line is split: a row, a message."""


MOST_AT_ONCE = 64
"""Messages that are taken in before others have their turn."""
MOST_SHED = 4096
"""Messages of other senders that are left unread meanwhile, where more come than can be read."""
PROVEN_FOR = 2.0
"""s without a sample after which another sender may be the device, begun anew at another port."""


class LineUnit(ConditionedSource, Generic[Part]):
    """One of the units on a line; a `Source`.

    Where several are read, what one has the line receive is kept for the others. So whoever reads them reads
    each of them in turn.
    """

    def __init__(self, line: SharedLine[Part], address: Address, options: ReadOptions) -> None:
        super().__init__(options, line.transport.reorder_window)
        self.line = line
        """Transport that the units share."""
        named = (address.unit or "").strip("/").replace("/", "_")
        self.name = f"{line.name}-{named}" if named else line.name
        self.wanted = one_name(address.text, address.unit, options.topic)
        """Name of the unit, where one was given."""
        self._refusal: LogError | None = None
        self._waiting: list[Piece[Part]] = []
        self._one = OneSender[Part](self._concerns)
        self._arrival = 0.0

    @property
    def refusal(self) -> LogError | None:
        """Error with which the next call of `read` ends: samples came before it."""
        return self._refusal or self._conditioner.refusal

    @property
    def unread(self) -> int:
        """Messages of the line that the system dropped because nobody read them in time."""
        return self.line.transport.unread

    @property
    def remarks(self) -> tuple[str, ...]:
        """See `Source`."""
        return (*self._conditioner.notices, *self._one.notices, *self.line.notices)

    def __enter__(self) -> LineUnit[Part]:
        self._refusal = None
        self.line.enter(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.line.leave(self)

    def fileno(self) -> int | None:
        """See `Source`; the same for all units of a line."""
        return self.line.fileno()

    def read(self) -> LiveChunk:
        """See `Source`; samples that came before an error are given before it is raised."""
        if self.refusal is None:
            try:
                return self._taken()
            except LogError as error:
                self._refusal = error
        if len(held := self._conditioner.held()):
            return held
        self._count_cut_off()
        assert self.refusal is not None, "there is an error to be raised"
        raise self.refusal

    def _count_cut_off(self) -> None:
        """Counts samples of after a restart that were received for another unit of the line."""
        pieces, self._waiting = self._waiting, []
        parts = self._one.own(pieces)
        with suppress(LogError):
            if self._conditioner.refusal is not None and parts and (found := self._readings(parts)):
                self._conditioner.cut_off += len(found[0])

    def _taken(self) -> LiveChunk:
        if not self._waiting:
            self.line.receive()
        pieces, self._waiting = self._waiting, []
        for sender, parts in self._one.candidates(pieces, self._arrival, PROVEN_FOR):
            found = self._readings(parts)
            if found is None and not self._keeps:
                continue
            self._one.take(sender, pieces, self._arrival)
            if found is None:
                break
            self.line.prove(self._arrival)
            return self._conditioner.take(*found, self._arrival)
        return self._conditioner.due()

    def hand_over(self, pieces: Sequence[Piece[Part]], arrival: float) -> None:
        """Adds messages for all its units that came over the line at `arrival`, s of `clock.now()`."""
        self._waiting += pieces
        self._arrival = arrival

    @property
    def _keeps(self) -> bool:
        """Indicates whether parts are kept back that are to be samples of this unit."""
        return False

    def _concerns(self, part: Part) -> bool:
        """Returns whether a part may be a sample of this unit, and of no other one."""
        return True

    @abstractmethod
    def _readings(self, parts: Sequence[Part]) -> tuple[Readings, StreamFacts] | None:
        """Finds the samples of this unit, and what is known of them; None where there are none."""


class SharedLine(ABC, Generic[Part]):
    """Opens a line while any of its units is entered, and hands them what comes."""

    def __init__(self, address: Address, transport: Transport, name: str) -> None:
        self.name = name
        """Short name: `udp-9000`."""
        self.address = address
        self.transport = transport
        self.lost = False
        """Indicates whether it ended or was unplugged, and must not be opened again."""
        self._entering = Lock()
        self.units: list[LineUnit[Part]] = []
        """Those that are read at present."""
        self._senders: set[object] = set()
        """Senders of the messages taken in last."""
        self._proven: dict[object, float] = {}
        """s of `clock.now()` at which samples last came, by sender."""
        self._has_piled_up = False
        """Indicates whether more came than was taken in at once."""
        self._shed = 0

    @property
    def notices(self) -> tuple[str, ...]:
        """Notices for the user on what came over the line."""
        others = f"left {count_of('message', self._shed)} unread that others sent faster than can be read"
        return (*self.transport.notices, *((others,) if self._shed else ()))

    def prove(self, arrival: float) -> None:
        """Keeps in mind who sent the samples that came at `arrival`, where that is certain."""
        certain = self._senders if len(self._senders) == 1 else self._senders & self._proven.keys()
        self._proven |= dict.fromkeys(certain, arrival)

    def enter(self, unit: LineUnit[Part]) -> None:
        """Opens the line, where it is not, for one more unit; raises `LogError` where it cannot be opened."""
        with self._entering:
            if not self.units:
                self._open()
            self.units.append(unit)

    def leave(self, unit: LineUnit[Part]) -> None:
        """Closes the line where this was the last of its units."""
        self.units.remove(unit)
        if not self.units:
            self._close()

    def fileno(self) -> int | None:
        """Returns a descriptor that is readable once something has come; None if there is none."""
        return self.transport.fileno()

    def receive(self) -> None:
        """Reads waiting bytes, without waiting for more, for all units.

        Raises `LogError` where the line is lost, `EOFError` where it is at its end.
        """
        try:
            if pieces := self._come():
                arrival = clock.now()
                for unit in self.units:
                    unit.hand_over(pieces, arrival)
        except (LogError, EOFError):
            self.lost = True
            raise

    def _come(self) -> list[Piece[Part]]:
        """Reads all waiting bytes: of messages that come one by one, all that have piled up.

        Where more piles up than that, messages of senders that never sent a sample stay unread.
        """
        pieces: list[Piece[Part]] = []
        self._senders, shed = set(), 0
        proven = self._proven_of_late() if self._has_piled_up else set()
        taken, most = 0, MOST_AT_ONCE if self.transport.whole else 1
        while taken < most and shed < MOST_SHED and (piece := self.transport.receive()):
            sender = self.transport.sender
            if proven and sender not in proven:
                shed += 1
                continue
            taken += 1
            self._senders.add(sender)
            if parts := self._parts(piece):
                pieces.append(Piece(sender, parts))
        self._has_piled_up = taken == most or shed == MOST_SHED
        self._shed += shed
        return pieces

    def _proven_of_late(self) -> set[object]:
        now = clock.now()
        return {sender for sender, at in self._proven.items() if now - at < PROVEN_FOR}

    def _open(self) -> None:
        self.transport.__enter__()

    def _close(self) -> None:
        self.transport.__exit__(None, None, None)

    @abstractmethod
    def _parts(self, piece: bytes) -> Sequence[Part]:
        """Splits the received bytes."""

    @abstractmethod
    def unit(self, address: Address, options: ReadOptions) -> LineUnit[Part]:
        """Creates the source of one unit; `address` differs from the line's in its unit only."""


class SharedLines:
    """The lines of a program: each is opened once, for all units that are received on it."""

    def __init__(self) -> None:
        self._lines: dict[str, SharedLine[Any]] = {}
        self._making = Lock()

    def line(self, address: Address, make: Callable[[], SharedLine[Any]]) -> SharedLine[Any]:
        """Returns the line of an address, one that is `make`d where there is none, or where it was lost."""
        with self._making:
            line = self._lines.get(address.line)
            if line is None or line.lost:
                line = self._lines[address.line] = make()
            return line
