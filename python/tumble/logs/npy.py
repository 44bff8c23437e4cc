"""Files of NumPy: `.npy` with one array, `.npz` with several. Pickled objects are never loaded.

Format: numpy.org/doc/stable/reference/generated/numpy.lib.format.html
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator
from io import BytesIO
from math import prod
from pathlib import Path
from typing import IO
from weakref import finalize

import numpy as np
from numpy.lib import format as npy_format

from tumble.foundation.errors import LogError
from tumble.foundation.regular_files import open_regular
from tumble.foundation.words import quoted
from tumble.logs.damage import COPY_OR_SAVE, damage_said
from tumble.logs.options import ReadOptions
from tumble.logs.stored_array import BLOCK, StoredArray
from tumble.logs.track import LARGEST_RATIO, LoggedImu
from tumble.logs.variables import (
    MOST_VARIABLES,
    Variable,
    VariablesFile,
    is_numeric,
    list_variable_imus,
    open_variables,
)

_MAGIC = b"\x93NUMPY"
_ARCHIVE = b"PK\x03\x04"
_ENDING = ".npy"
_LARGEST_HEADER = 1 << 16


def recognises(path: Path, head: bytes) -> bool:
    """Returns whether a file is an archive with arrays, or a damaged one by its name."""
    if not head.startswith(_ARCHIVE):
        return False
    try:
        with open_regular(path) as file, zipfile.ZipFile(file) as archive:
            return any(name.endswith(_ENDING) for name in archive.namelist())
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return path.suffix.lower() == ".npz"


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the prefixes of the arrays' names."""
    return list_variable_imus(_opened(path), options)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds the arrays, or the fields of a structured array, of one IMU."""
    return open_variables(_opened(path), imu, options)


def _opened(path: Path) -> VariablesFile:
    with damage_said(path, COPY_OR_SAVE):
        with open_regular(path) as file:
            single = file.read(len(_MAGIC)) == _MAGIC
        found = [_single(path)] if single else _members(path)
        if objects := [each.name or path.name for each in found if each.dtype.hasobject]:
            raise LogError(
                f"{path}: {objects[0]} holds Python objects, which can run any program and are never loaded; "
                "save it as numbers, as with numpy.asarray(x, float)"
            )
        numeric = [each for each in found if _is_readable(each)]
        return VariablesFile(
            path,
            "npy",
            [Variable(each.name, each.shape, each.dtype, each.pieces) for each in numeric],
            dict(_single_numbers(numeric)),
            block=BLOCK,
        )


def _single(path: Path) -> StoredArray:
    return _array("", lambda: open_regular(path), path.stat().st_size)


def _members(path: Path) -> list[StoredArray]:
    # Read once: to read the directory for each of its members would take the square of their number.
    file = open_regular(path)
    archive = zipfile.ZipFile(file)
    finalize(archive, file.close)
    infos = [each for each in archive.infolist() if each.filename.endswith(_ENDING)]
    if not infos:
        raise LogError(f"{path}: not a log: holds no array of NumPy; {COPY_OR_SAVE}")
    if len(infos) > MOST_VARIABLES:
        raise LogError(f"{path}: holds {len(infos)} arrays, which is no log; check the file")
    found: list[StoredArray] = []
    names: set[str] = set()
    for info in infos:
        if info.filename in names:
            raise LogError(f"{path}: holds {quoted(info.filename)} twice; {COPY_OR_SAVE}")
        names.add(info.filename)
        if info.file_size > LARGEST_RATIO * (info.compress_size + 1):
            raise LogError(
                f"{path}: {info.filename} says it unpacks from {info.compress_size} to {info.file_size} "
                f"bytes, which no archive of numbers does; {COPY_OR_SAVE}"
            )
        name = info.filename.removesuffix(_ENDING)
        found.append(_array(name, _opener(archive, info.filename), info.file_size))
    return found


def _opener(archive: zipfile.ZipFile, member: str) -> Callable[[], IO[bytes]]:
    def opened() -> IO[bytes]:
        # The archive goes with its last array.
        return archive.open(member)

    return opened


def _array(name: str, opened: Callable[[], IO[bytes]], size: int) -> StoredArray:
    """Reads the header of an array; raises `ValueError` where it states more than `size` bytes."""
    with opened() as stream:
        start = stream.read(len(_MAGIC) + 2)
        version = tuple(start[len(_MAGIC) :])
        width = 2 if version == (1, 0) else 4
        length_bytes = stream.read(width)
        length = int.from_bytes(length_bytes, "little")
        if not start.startswith(_MAGIC) or len(length_bytes) < width or length > _LARGEST_HEADER:
            raise ValueError(f"{name or 'the array'} has no header of NumPy")
        header = BytesIO(start + length_bytes + stream.read(length))
    npy_format.read_magic(header)
    read = npy_format.read_array_header_1_0 if width == 2 else npy_format.read_array_header_2_0
    shape, column_major, dtype = read(header)
    offset = len(start) + width + length
    if min(shape, default=0) < 0 or (not dtype.hasobject and offset + prod(shape) * dtype.itemsize > size):
        raise ValueError(f"{name or 'the array'} says shape {shape} of {dtype}, more than its {size} bytes")
    return StoredArray(name, opened, shape, column_major, dtype, offset)


def _is_readable(array: StoredArray) -> bool:
    if 0 in array.shape or len(array.shape) > 2:
        return False
    if array.dtype.names is None:
        return is_numeric(array.dtype) and array.dtype.itemsize > 0
    return len(array.shape) == 1


def _single_numbers(arrays: list[StoredArray]) -> Iterator[tuple[str, float]]:
    for array in arrays:
        if prod(array.shape) == 1 and array.dtype.kind in "iuf":
            with array.open() as stream:
                stream.seek(array.offset)
                data = stream.read(array.dtype.itemsize)
            yield array.name, float(np.frombuffer(data, array.dtype)[0])
