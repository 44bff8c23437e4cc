"""One sender of several that send to one port: alternating samples of two devices are those of neither.

A sender is an address with its port. One device keeps its port, or takes another one when it begins anew, or
takes a new one for each message, as shells do. Two devices return to their ports in turn.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from tumble.foundation.words import count_of

Part = TypeVar("Part")

DISTINCT = 8
"""Senders of successive messages, mostly one each, from which on one device takes a new port for each.

Half of it would take four devices of one host for one; twice of it delays such a device by twice the time.
"""
RETURNS, OF_LATEST = 4, 16
"""A sender of so many of the latest messages keeps its port: one in 10^10 by chance among 28,000 ports."""


@dataclass(frozen=True, slots=True)
class Piece(Generic[Part]):
    """Parts of one message."""

    sender: object
    """Sender of the message; None where a line has one only."""
    parts: Sequence[Part]


class OneSender(Generic[Part]):
    """Keeps to the sender whose samples came first, until it sends none for a while.

    `concerns` is true of parts that may be samples of the unit that is read.
    """

    def __init__(self, concerns: Callable[[Part], bool]) -> None:
        self._concerns = concerns
        self._sender: object = None
        self._sampled_at = 0.0
        """s of `clock.now()` at which its samples last came."""
        self._wanders = False
        """Indicates whether each message comes from a port of its own."""
        self._kept: list[Piece[Part]] = []
        """Messages of others since the last of the sender: those of the same device, or of another one."""
        self._latest: deque[object] = deque(maxlen=OF_LATEST)
        self._left_out: Counter[object] = Counter()

    @property
    def notices(self) -> tuple[str, ...]:
        """Reports the messages of other senders, with the remedy."""
        if not self._left_out:
            return ()
        other, _ = self._left_out.most_common(1)[0]
        return (
            f"left out {count_of('message', self._left_out.total())} of another sender than "
            f"{_shown(self._sender)}, such as {_shown(other)}; let each device send to a port of its own",
        )

    def candidates(
        self, pieces: Sequence[Piece[Part]], arrival: float, silence: float
    ) -> list[tuple[object, list[Part]]]:
        """Return what senders sent that may be the device, in the order in which it is to be tried.

        `silence` is the time, s, without samples after which another one may be the device, begun anew.
        """
        if not pieces or (self._wanders and self._still_wanders(pieces)):
            return [(None, _parts(pieces))] if pieces else []
        if self._sender is None or arrival - self._sampled_at >= silence:
            self._leave_out()
            by_concern = sorted(pieces, key=lambda piece: not self._is_concerned(piece))
            return [
                (sender, _parts(piece for piece in pieces if piece.sender == sender))
                for sender in dict.fromkeys(piece.sender for piece in by_concern)
            ]
        self._keep(pieces)
        if own := self.own(pieces):
            self._leave_out()
            return [(self._sender, own)]
        return self._begun_to_wander()

    def take(self, sender: object, pieces: Sequence[Piece[Part]], arrival: float) -> None:
        """Keep to a sender, of whose `pieces`, among those of others, samples came at `arrival`."""
        if sender is None:
            return
        self._sampled_at = arrival
        if sender != self._sender:
            self._sender = sender
            self._keep(pieces)

    def own(self, pieces: Iterable[Piece[Part]]) -> list[Part]:
        """Return the parts of the sender that is read."""
        return _parts(piece for piece in pieces if self._wanders or piece.sender == self._sender)

    def _keep(self, pieces: Sequence[Piece[Part]]) -> None:
        others = (piece for piece in pieces if piece.sender != self._sender)
        self._kept += filter(self._is_concerned, others)

    def _is_concerned(self, piece: Piece[Part]) -> bool:
        return any(map(self._concerns, piece.parts))

    def _begun_to_wander(self) -> list[tuple[object, list[Part]]]:
        """Return what was kept where it is of a device that takes a new port for each message."""
        distinct = len({piece.sender for piece in self._kept})
        if distinct >= DISTINCT and 2 * distinct > len(self._kept):
            self._wanders = True
            kept, self._kept = self._kept, []
            return [(None, _parts(kept))]
        if len(self._kept) >= 2 * DISTINCT:
            self._leave_out()
        return []

    def _still_wanders(self, pieces: Sequence[Piece[Part]]) -> bool:
        for piece in pieces:
            self._latest.append(piece.sender)
            if self._latest.count(piece.sender) >= RETURNS:
                self._wanders, self._sender = False, None
                self._latest.clear()
                return False
        return True

    def _leave_out(self) -> None:
        self._left_out.update(piece.sender for piece in self._kept)
        self._kept = []


def _parts(pieces: Iterable[Piece[Part]]) -> list[Part]:
    return [part for piece in pieces for part in piece.parts]


def _shown(sender: object) -> str:
    """Return `HOST:PORT` of the address of a socket."""
    return ":".join(map(str, sender[:2])) if isinstance(sender, tuple) else str(sender)
