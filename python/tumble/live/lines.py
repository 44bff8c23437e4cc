"""From bytes to whole lines: bytes come in pieces that know nothing of lines."""

from __future__ import annotations

from dataclasses import dataclass, field

LONGEST_LINE = 1 << 12
"""Bytes without a line end beyond which they are no text."""


@dataclass(slots=True)
class LineSplitter:
    """Gathers bytes and gives whole lines, without their ends."""

    torn: int = 0
    """Times that more than `LONGEST_LINE` bytes came without a line end among them and were thrown away."""
    _rest: bytearray = field(default_factory=bytearray)

    def split(self, piece: bytes) -> list[bytes]:
        """Adds bytes; returns complete lines, without blank ones, of no more than `LONGEST_LINE` bytes."""
        self._rest += piece
        *lines, rest = self._rest.replace(b"\r", b"\n").split(b"\n")
        if len(rest) > LONGEST_LINE:
            self.torn += 1
            rest = bytearray()
        self._rest = rest
        self.torn += sum(len(line) > LONGEST_LINE for line in lines)
        return [bytes(line) for line in lines if len(line) <= LONGEST_LINE and line.strip()]
