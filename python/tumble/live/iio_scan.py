"""Layout of the samples in a buffer of Linux IIO: `le:s12/16>>4` and the like.

Documentation/driver-api/iio/buffers.rst and Documentation/ABI/testing/sysfs-bus-iio of Linux.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.numbers import whole_number
from tumble.foundation.recording import FloatArray

_TYPE = re.compile(
    r"(?P<order>be|le):(?P<sign>[su])(?P<bits>\d+)/(?P<storage>\d+)(?:X(?P<repeat>\d+))?(?:>>(?P<shift>\d+))?"
)
_BYTES = (1, 2, 4, 8)


@dataclass(frozen=True, slots=True)
class Element:
    """One channel of a scan."""

    name: str
    """`in_accel_x`."""
    index: int
    """Its place among those that are captured."""
    is_big_endian: bool
    is_signed: bool
    bits: int
    storage_bits: int
    shift: int
    repeat: int

    @property
    def word_bytes(self) -> int:
        """Size of one stored number."""
        return self.storage_bits // 8

    @property
    def bytes(self) -> int:
        """Size in the buffer, to which it is aligned too."""
        return self.word_bytes * self.repeat


def parse_element(name: str, index: str, kind: str) -> Element | None:
    """Reads the description of a channel in sysfs; None where it is unknown."""
    found = _TYPE.fullmatch(kind.strip())
    number = whole_number(index.strip())
    if found is None or number is None:
        return None
    element = Element(
        name,
        number,
        found["order"] == "be",
        found["sign"] == "s",
        int(found["bits"]),
        int(found["storage"]),
        int(found["shift"] or 0),
        max(1, int(found["repeat"] or 1)),
    )
    fits = element.bits > 0 and element.bits + element.shift <= element.storage_bits
    return element if fits and element.word_bytes in _BYTES and element.storage_bits % 8 == 0 else None


class Scan:
    """The channels that a device captures at once, and their places in its buffer."""

    def __init__(self, elements: Sequence[Element]) -> None:
        self.elements = {element.name: element for element in elements}
        offset, largest, places = 0, 1, {}
        for element in sorted(elements, key=lambda element: element.index):
            # Each is aligned to its own size, and the whole to the largest of them.
            places[element.name] = offset = _aligned(offset, element.bytes)
            offset, largest = offset + element.bytes, max(largest, element.bytes)
        self.bytes = _aligned(offset, largest)
        """Size of one scan."""
        self._words = np.dtype(
            {
                "names": list(places),
                "formats": [
                    f"{'>' if each.is_big_endian else '<'}u{each.word_bytes}"
                    for each in map(self.elements.__getitem__, places)
                ],
                "offsets": list(places.values()),
                "itemsize": self.bytes,
            }
        )

    def numbers(self, data: bytes) -> dict[str, FloatArray]:
        """Returns each channel of whole scans, (n,), unscaled; a time in ns is exact to 1 us."""
        words = np.frombuffer(data, self._words)
        return {name: _value(words[name], element) for name, element in self.elements.items()}


def _aligned(offset: int, size: int) -> int:
    return -(-offset // size) * size


def _value(words: NDArray[np.unsignedinteger[np.typing.NBitBase]], element: Element) -> FloatArray:
    """Shifts, masks and extends the sign."""
    number = words.astype(np.uint64) >> np.uint64(element.shift)
    empty = np.uint64(64 - element.bits)
    number <<= empty
    if element.is_signed:
        return np.asarray(number.view(np.int64) >> np.int64(64 - element.bits), dtype=np.float64)
    return np.asarray(number >> empty, dtype=np.float64)
