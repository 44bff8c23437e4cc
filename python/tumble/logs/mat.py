"""MATLAB files of version 4, and of 5 to 7.2: matrices, and those in structures and cells.

Format: MathWorks, MAT-File Format. No size in them is trusted beyond the bytes that are there; files of
version 7.3 are HDF5.

`scipy.io.loadmat` was tried: it holds all of a file (157 MiB where this reader takes 76), raises four kinds
of errors on damaged ones, and nothing else here needs scipy.
"""

from __future__ import annotations

import os
import re
import struct
import tempfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import prod
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.errors import LogError
from tumble.foundation.regular_files import open_regular
from tumble.logs.budget import unpacked_budget
from tumble.logs.damage import COPY_OR_SAVE, damage_said
from tumble.logs.options import ReadOptions
from tumble.logs.track import CHUNK_SAMPLES, LoggedImu
from tumble.logs.variables import (
    MOST_VARIABLES,
    Variable,
    VariablesFile,
    list_variable_imus,
    open_variables,
)

_MAGIC = b"MATLAB 5.0 MAT-file"
_DEEPEST = 32
"""Structures in one another."""

_MOST_ELEMENTS = 16 * MOST_VARIABLES
"""Tags of a file: a variable has five, and a member of a structure as many."""
_PIECE = 1 << 18
"""Bytes that are unpacked at a time."""
_HEADER = 128
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""Types of data elements that hold numbers."""
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _OBJECT, _OPAQUE = 1, 2, 3, 17
_NUMERIC = range(6, 16)
"""Classes of matrices."""
_COMPLEX = 0x08

_HEADER_4 = 20
_NUMBERS_4 = ("f8", "f4", "i4", "i2", "u2", "u1")
"""Types by the tens of the type of a matrix of version 4."""
_NAME_4 = re.compile(rb"[A-Za-z]\w{0,62}\x00")


def recognises(path: Path, head: bytes) -> bool:
    """Returns whether a file is of version 5, or begins with a matrix of version 4."""
    return head.startswith(_MAGIC) or _header_4(head) is not None


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the prefixes of the variables' names."""
    return list_variable_imus(_opened(path), options)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds the variables, or the fields of a structure, of one IMU."""
    return open_variables(_opened(path), imu, options)


class _Bytes:
    """Bytes of a file, or those that a compressed part of it unpacks to."""

    def __init__(self, path: Path, packed: tuple[int, int] | None = None, most: int = 0) -> None:
        """`packed` is where the compressed part begins and how long it is, `most` what it may unpack to."""
        self._path = path
        self._packed = packed
        self._most = most

    @cached_property
    def size(self) -> int:
        """Number of bytes of the file, unpacked."""
        return (
            self._path.stat().st_size if self._packed is None else os.fstat(self._unpacked.fileno()).st_size
        )

    def read(self, offset: int, size: int) -> bytes:
        """Returns some; raises `EOFError` where there are fewer."""
        if offset + size > self.size:
            raise EOFError(f"{offset + size - self.size} bytes of a variable are missing")
        if self._packed is not None:
            self._unpacked.seek(offset)
            return self._unpacked.read(size)
        with open_regular(self._path) as file:
            file.seek(offset)
            return file.read(size)

    @cached_property
    def _unpacked(self) -> BinaryIO:
        """A temporary file, as columns are read side by side and memory would take as much as the log."""
        assert self._packed is not None
        offset, size = self._packed
        unpacked: BinaryIO = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 - lives as long as these bytes
        with open_regular(self._path) as file:
            file.seek(offset)
            for piece in _unpacked_pieces(file, size, self._most):
                unpacked.write(piece)
        return unpacked


def _unpacked_pieces(file: BinaryIO, size: int, most: int) -> Iterator[bytes]:
    """Unpacks the next `size` bytes; raises `EOFError` where they have no end, `ValueError` beyond `most`."""
    unpacker, left = zlib.decompressobj(), most
    while not unpacker.eof:
        packed = unpacker.unconsumed_tail or file.read(min(size, _PIECE))
        size -= 0 if unpacker.unconsumed_tail else len(packed)
        piece = unpacker.decompress(packed, _PIECE)
        if not packed and not piece:
            break
        left -= len(piece)
        if left < 0:
            raise ValueError("its variables unpack to more than readings do")
        yield piece
    if not unpacker.eof:
        raise EOFError("a compressed variable has no end")


@dataclass(frozen=True, slots=True)
class _Matrix:
    """Where the numbers of a matrix stand, column after column."""

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    source: _Bytes
    offset: int

    def pieces(self, axis: int) -> Iterator[NDArray[Any]]:
        """Reads it along an axis."""
        rows, columns = self.shape
        for start in range(0, self.shape[axis], CHUNK_SAMPLES):
            count = min(CHUNK_SAMPLES, self.shape[axis] - start)
            if axis == 1:
                yield self.numbers(start * rows, count * rows).reshape((rows, count), order="F")
            else:
                yield np.stack([self.numbers(each * rows + start, count) for each in range(columns)], axis=1)

    def numbers(self, first: int, count: int) -> NDArray[Any]:
        """Returns some of its numbers as they stand."""
        size = self.dtype.itemsize
        return np.frombuffer(self.source.read(self.offset + first * size, count * size), self.dtype)


def _opened(path: Path) -> VariablesFile:
    with damage_said(path, COPY_OR_SAVE):
        file = _Bytes(path)
        reader = _Version5(path) if file.read(0, len(_MAGIC)) == _MAGIC else None
        found = list(_matrices_4(file) if reader is None else reader.matrices())
        matrices = [each for each in found if len(each.shape) == 2 and 0 not in each.shape]
        if not matrices and reader is not None and reader.opaque:
            raise LogError(
                f"{path}: holds tables or objects of MATLAB, which MATLAB alone reads; save their columns as "
                "arrays, as with s = table2struct(T, 'ToScalar', true)"
            )
        numbers = {each.name: float(each.numbers(0, 1)[0]) for each in matrices if prod(each.shape) == 1}
        variables = [Variable(each.name, each.shape, each.dtype, each.pieces) for each in matrices]
        return VariablesFile(path, "mat", variables, numbers)


@dataclass(frozen=True, slots=True)
class _Element:
    """A data element: what stands behind a tag."""

    kind: int
    offset: int
    size: int
    next: int
    """Beginning of the next one."""


class _Version5:
    """Walks the data elements of a file; what holds numbers is found, and read later."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = _Bytes(path)
        self._order = "<" if self._file.read(_HEADER - 2, 2) == b"IM" else ">"
        self._found = self._elements = 0
        self._left = unpacked_budget(path.stat().st_size)
        self.opaque = False
        """Indicates whether there are tables, or objects of classes."""

    def matrices(self) -> Iterator[_Matrix]:
        """Returns all matrices of real numbers, by name and the structures that they are in."""
        position = _HEADER
        while position < self._file.size:
            element = self._element(self._file, position)
            if element.kind == _COMPRESSED:
                unpacked = _Bytes(self._path, (element.offset, element.size), self._left)
                self._left -= unpacked.size
                yield from self._matrix(unpacked, self._element(unpacked, 0), "", 0)
            elif element.kind == _MATRIX:
                yield from self._matrix(self._file, element, "", 0)
            else:
                raise ValueError(f"no variable of MATLAB begins at byte {position}")
            position = element.next

    def _element(self, source: _Bytes, position: int) -> _Element:
        self._elements += 1
        if self._elements > _MOST_ELEMENTS:
            raise ValueError(f"it holds more than {_MOST_ELEMENTS} parts, which is no log")
        kind, size = struct.unpack(f"{self._order}II", source.read(position, 8))
        if kind >> 16:  # a short one, whose data stand in its tag
            return _Element(kind & 0xFFFF, position + 4, min(kind >> 16, 4), position + 8)
        if position + 8 + size > source.size:
            raise EOFError(f"a variable says {size} bytes, of which {source.size - position - 8} are there")
        padding = 0 if kind == _COMPRESSED else -size % 8
        return _Element(kind, position + 8, size, position + 8 + size + padding)

    def _matrix(self, source: _Bytes, element: _Element, group: str, depth: int) -> Iterator[_Matrix]:
        """Returns what a matrix holds; `group` is the name of the structure that it is a field of."""
        if element.kind != _MATRIX or element.size == 0:
            return
        self._found += 1
        if self._found > MOST_VARIABLES or depth > _DEEPEST:
            raise LogError(
                f"{self._path}: holds too many variables in one another to be a log; check the file"
            )
        flags = self._element(source, element.offset)
        (word,) = struct.unpack(f"{self._order}I", source.read(flags.offset, 4))
        kind, is_complex = word & 0xFF, bool((word >> 8) & _COMPLEX)
        if kind == _OPAQUE:
            self.opaque = True
            return
        dimensions = self._element(source, flags.next)
        shape = tuple(
            int(each)
            for each in np.frombuffer(
                source.read(dimensions.offset, dimensions.size - dimensions.size % 4), f"{self._order}i4"
            )
        )
        naming = self._element(source, dimensions.next)
        own = source.read(naming.offset, naming.size).split(b"\x00")[0].decode("latin-1")
        name = group or own
        if not name or min(shape, default=0) < 0:
            return
        if kind in _NUMERIC and not is_complex:
            yield from self._numbers(source, self._element(source, naming.next), name, shape)
        elif kind in (_CELL, _STRUCT, _OBJECT):
            yield from self._members(source, naming.next, name, shape, kind, depth)

    def _numbers(
        self, source: _Bytes, element: _Element, name: str, shape: tuple[int, ...]
    ) -> Iterator[_Matrix]:
        if element.kind not in _NUMBERS:
            return
        dtype = np.dtype(f"{self._order}{_NUMBERS[element.kind]}")
        if prod(shape) * dtype.itemsize > element.size:
            raise ValueError(f"{name} says it is {'x'.join(map(str, shape))}, in {element.size} bytes")
        yield _Matrix(name, shape, dtype, source, element.offset)

    def _members(
        self, source: _Bytes, position: int, name: str, shape: tuple[int, ...], kind: int, depth: int
    ) -> Iterator[_Matrix]:
        """Contents of a structure or a cell; each of its members has a tag at least."""
        fields = [""]
        if kind == _OBJECT:
            position = self._element(source, position).next
        if kind != _CELL:
            length = self._element(source, position)
            (longest,) = struct.unpack(f"{self._order}i", source.read(length.offset, 4))
            names = self._element(source, length.next)
            if longest < 1:
                return
            text = source.read(names.offset, names.size)
            fields = [
                text[start : start + longest].split(b"\x00")[0].decode("latin-1")
                for start in range(0, len(text) - len(text) % longest, longest)
            ]
            position = names.next
        count = prod(shape)
        if not fields or 8 * count * len(fields) > source.size:
            return
        for number in range(count):
            each = name if count == 1 else f"{name}{number + 1}"
            for field in fields:
                element = self._element(source, position)
                yield from self._matrix(source, element, f"{each}/{field}" if field else each, depth + 1)
                position = element.next


def _header_4(head: bytes) -> tuple[str, int, int, int, bool, int] | None:
    """Reads the header: byte order, type, rows, columns, complex, length of the name; None if it is none."""
    if len(head) < _HEADER_4 + 2:
        return None
    for order in "<>":
        kind, rows, columns, imaginary, length = struct.unpack_from(f"{order}5i", head)
        plain = kind % 1000
        if (
            kind // 1000 == (0 if order == "<" else 1)
            and plain // 10 < len(_NUMBERS_4)
            and plain % 10 in (0, 1, 2)
            and min(rows, columns) >= 0
            and imaginary in (0, 1)
            and _NAME_4.fullmatch(head[_HEADER_4 : _HEADER_4 + length]) is not None
        ):
            return order, plain, rows, columns, bool(imaginary), length
    return None


def _matrices_4(file: _Bytes) -> Iterator[_Matrix]:
    position = found = 0
    while position < file.size:
        head = file.read(position, min(file.size - position, _HEADER_4 + 64))
        header = _header_4(head)
        found += 1
        if header is None or found > MOST_VARIABLES:
            raise ValueError(f"no variable of MATLAB begins at byte {position}")
        order, kind, rows, columns, is_complex, length = header
        dtype = np.dtype(f"{order}{_NUMBERS_4[kind // 10]}")
        offset = position + _HEADER_4 + length
        size = rows * columns * dtype.itemsize * (2 if is_complex else 1)
        name = head[_HEADER_4 : _HEADER_4 + length - 1].decode("latin-1")
        if offset + size > file.size:
            raise EOFError(f"{name} says {size} bytes, of which {file.size - offset} are there")
        if kind % 10 == 0 and not is_complex:
            yield _Matrix(name, (rows, columns), dtype, file, offset)
        position = offset + size
