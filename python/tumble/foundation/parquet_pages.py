"""Heads of the pages of a file of Parquet: libraries make room by them, whatever the end of the file states.

A head is a structure of Thrift's compact protocol: https://github.com/apache/parquet-format, PageHeader in
src/main/thrift/parquet.thrift, and https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO, Final, TypeAlias

Structure: TypeAlias = dict[int, Any]
"""Whole numbers and structures by their number; others are skipped."""
_HEADS: Final = {5: 2, 7: 2, 8: 4}
"""Numbers of the heads of data pages, dictionaries and data pages of version 2; with that of the encoding."""
_VALUES: Final = 1
"""Number of the count of values in these."""
_UNPACKED, _PACKED = 2, 3
"""Numbers of the sizes of a page, bytes."""
_LARGEST_HEAD: Final = 1 << 16
"""Bytes of the head of a page: statistics of its texts are the longest part, and writers cut them short."""
_MORE: Final = 100
"""Bytes that libraries read beyond a chunk of old versions of a writer, which left a head out of its size."""
_OLD_WRITER: Final = "parquet-mr"
_LIKE_THE_LAST: Final = 7
"""Encoding of texts by their difference to the last, DELTA_BYTE_ARRAY: a few bytes stand for any length."""
_DEEPEST: Final = 8
_TRUE, _FALSE, _BYTE, _SHORT, _INT, _LONG, _DOUBLE, _BINARY, _LIST, _SET, _, _STRUCT = range(1, 13)


class PageError(ValueError):
    """A page whose head is none, or that stands for more than its size."""


@dataclass(frozen=True, slots=True)
class Page:
    """A page of a column."""

    size: int
    """Bytes once it is unpacked."""
    values: int


def pages_of(file: BinaryIO, chunk: Any, written_by: str) -> Iterator[Page]:  # noqa: ANN401 - pyarrow
    """Yields the pages of a chunk of a column, as libraries find them; raises `PageError`.

    The writer is as the end of the file states it, `created_by`.
    """
    more = _MORE if _OLD_WRITER in written_by.lower() else 0
    starts = (chunk.dictionary_page_offset or 0, chunk.data_page_offset)
    place = min((each for each in starts if each > 0), default=0)
    end = place + chunk.total_compressed_size
    while place < end + more:
        file.seek(place)
        head = file.read(_LARGEST_HEAD)
        try:
            size, found = _structure(memoryview(head), 0, 0)
            packed, unpacked = _size(found, _PACKED), _size(found, _UNPACKED)
            heads = [(found[each], encoding) for each, encoding in _HEADS.items() if each in found]
            values = max((_size(each, _VALUES) for each, _ in heads), default=0)
        except (IndexError, KeyError, TypeError, ValueError) as error:
            if place >= end:
                return
            raise PageError("has a page whose head is none") from error
        if any(each.get(encoding) == _LIKE_THE_LAST for each, encoding in heads):
            raise PageError("holds texts as their difference to the last; write it without DELTA_BYTE_ARRAY")
        yield Page(unpacked, values)
        place += size + packed


def _size(found: Structure, number: int) -> int:
    size = found[number]
    if not 0 <= size < 1 << 31:
        raise ValueError("is no size")
    return int(size)


def _structure(data: memoryview, place: int, level: int) -> tuple[int, Structure]:
    """Reads a structure; returns where it ends. Raises `IndexError` or `ValueError` where it is none."""
    if level > _DEEPEST:
        raise ValueError("is nested too deep")
    found: Structure = {}
    number = 0
    while kind := data[place] & 15:
        step = data[place] >> 4
        place += 1
        if step:
            number += step
        else:
            place, number = _number(data, place)
        if kind in (_TRUE, _FALSE):
            continue
        place, value = _value(data, place, kind, level)
        # Libraries take the last of several, and cut the bits of numbers off that are too long.
        if number in found or abs(number) >= 1 << 15 or (kind == _INT and abs(value) >= 1 << 31):
            raise ValueError("is no structure that libraries write")
        if kind in (_INT, _STRUCT):
            found[number] = value
    return place + 1, found


def _value(data: memoryview, place: int, kind: int, level: int) -> tuple[int, Any]:
    if kind in (_TRUE, _FALSE, _BYTE):
        return place + 1, None
    if kind in (_SHORT, _INT, _LONG):
        return _number(data, place)
    if kind == _DOUBLE:
        return place + 8, None
    if kind == _BINARY:
        place, length = _unsigned(data, place)
        return place + length, None
    if kind in (_LIST, _SET):
        return _after_list(data, place, level), None
    if kind == _STRUCT:
        return _structure(data, place, level + 1)
    raise ValueError("is of a type that no head has")


def _after_list(data: memoryview, place: int, level: int) -> int:
    count, kind = data[place] >> 4, data[place] & 15
    place += 1
    if count == 15:
        place, count = _unsigned(data, place)
    if level > _DEEPEST:
        raise ValueError("is nested too deep")
    for _ in range(count):
        place, _ = _value(data, place, kind, level + 1)
        if place > len(data):
            raise IndexError("ends before its list")
    return place


def _number(data: memoryview, place: int) -> tuple[int, int]:
    place, number = _unsigned(data, place)
    return place, (number >> 1) ^ -(number & 1)


def _unsigned(data: memoryview, place: int) -> tuple[int, int]:
    number = shift = 0
    while True:
        byte = data[place]
        place += 1
        number |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            return place, number
        if shift > 63:
            raise ValueError("is no number")
