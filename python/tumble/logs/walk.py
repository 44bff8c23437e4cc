"""A file of messages, block by block, and what is met in it that is not as it should be."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BufferedReader
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FloatArray
from tumble.foundation.words import count_of

BLOCK = 1 << 20
"""Bytes read at a time."""

Take: TypeAlias = Callable[[bytes, int, bool], int]
"""Takes complete messages apart: bytes, their place in the file, and whether no more will follow; gives how
many bytes they are."""


@dataclass(slots=True)
class Damage:
    """Damage that a pass over a file met."""

    dropouts: int = 0
    lost: int = 0
    """ms of dropouts."""
    bytes: int = 0
    """Stepped over."""
    first: int = 0
    """Place of the first of them."""
    lines: int = 0
    """Number of lines of text that could not be read."""
    messages: int = 0
    """Garbled, by their checksum."""
    cut: bool = False
    """Indicates whether the last message is incomplete."""

    def add(self, position: int, count: int) -> None:
        """Counts bytes that were stepped over."""
        if not self.bytes:
            self.first = position
        self.bytes += count

    def notices(self) -> tuple[str, ...]:
        """Yields a notice on each kind of damage."""
        notices = []
        if self.dropouts:
            notices.append(
                f"{count_of('dropout', self.dropouts)}, {self.lost} ms in all, in which PX4 could not write: "
                "samples are missing"
            )
        if self.bytes:
            notices.append(f"left out {self.bytes} damaged bytes, the first at byte {self.first}")
        if self.lines:
            notices.append(f"left out {count_of('line', self.lines)} that cannot be read")
        if self.messages:
            notices.append(f"left out {count_of('garbled message', self.messages)}")
        if self.cut:
            notices.append("the file ends in the middle of a message: it was cut short")
        return tuple(notices)


def doubles(numbers: NDArray[Any]) -> FloatArray:
    """Returns numbers in double precision; those that are garbled are left to whoever checks them."""
    with np.errstate(invalid="ignore"):
        return numbers.astype(np.float64)


def walk(
    file: BufferedReader, start: int, end: int, take: Take, damage: Damage, block: int = BLOCK
) -> Iterator[None]:
    """Passes over the bytes from `start` to `end`; comes back after each block was taken apart.

    A hole in a sparse file holds no message: its last block is read, and no other.
    """
    file.seek(start)
    rest, position = b"", start
    while True:
        place = position + len(rest)
        if not rest.strip(b"\0") and (data_begin := _next_data(file, place, end)) > place + 2 * block:
            rest, position = b"", data_begin - block
            file.seek(position)
        read = file.read(max(min(block, end - position - len(rest)), 0))
        data = rest + read
        used = take(data, position, not read)
        yield
        rest, position = data[used:], position + used
        if not read:
            damage.cut |= bool(rest)
            return


def _next_data(file: BufferedReader, place: int, end: int) -> int:
    """Returns the first place from there on, up to `end`, that the file system holds bytes of."""
    if not hasattr(os, "SEEK_DATA"):
        return place
    before = file.raw.tell()
    try:
        return min(os.lseek(file.fileno(), place, os.SEEK_DATA), end)
    except OSError as error:
        return end if error.errno == errno.ENXIO else place
    finally:
        file.raw.seek(before, os.SEEK_SET)
