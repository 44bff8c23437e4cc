"""HDF5 files, and those of MATLAB 7.3, which are HDF5: datasets in groups."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any

import h5py  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.foundation.regular_files import open_regular
from tumble.logs.budget import memory_budget
from tumble.logs.damage import damage_said
from tumble.logs.options import ReadOptions
from tumble.logs.stored_array import BLOCK, StoredArray
from tumble.logs.track import CHUNK_SAMPLES, LARGEST_RATIO, LoggedImu
from tumble.logs.units_beside import KEYS
from tumble.logs.variables import (
    MOST_VARIABLES,
    Variable,
    VariablesFile,
    is_numeric,
    list_variable_imus,
    open_variables,
)

_REMEDY = "copy it again, or repair it with h5clear and h5repack"
_SERIALS = ("serial", "serial_number", "Serial", "SerialNumber")


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Returns the groups, or prefixes of the datasets' names."""
    return list_variable_imus(_opened(path), options)


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Finds the datasets of one IMU."""
    return open_variables(_opened(path), imu, options)


def _opened(path: Path) -> VariablesFile:
    with damage_said(path, _REMEDY), open_regular(path) as stream, h5py.File(stream, "r") as file:
        datasets = _datasets(path, file)
        size = path.stat().st_size
        for name, each in datasets.items():
            _refuse_more_than_is_there(name, each, size)
        if sum(map(_chunk_bytes, datasets.values())) > memory_budget(size):
            raise ValueError("its chunks take more memory than the readings of such a file")
        variables = [_variable(path, file, name, each) for name, each in datasets.items()]
        numbers = {
            name: float(np.asarray(each[()]).ravel()[0])
            for name, each in datasets.items()
            if prod(each.shape) == 1 and each.dtype.kind in "iuf"
        } | {
            name: float(value)
            for name, value in _attributes(file.attrs).items()
            if np.ndim(value) == 0 and isinstance(value, np.number)
        }
        return VariablesFile(path, "hdf5", variables, numbers, _text(file.attrs, _SERIALS), _REMEDY, BLOCK)


def _variable(path: Path, file: Any, name: str, dataset: Any) -> Variable:  # noqa: ANN401
    pieces, unit = _pieces(path, name, dataset), _text(dataset.attrs, KEYS)
    columns = _columns_beside(file, name, dataset)
    packing = _packing(name, dataset)
    if packing is None:
        return Variable(name, dataset.shape, dataset.dtype, pieces, unit, columns)
    return Variable(
        name,
        dataset.shape,
        np.dtype(np.float64),
        lambda axis: map(packing.unpacked, pieces(axis)),
        unit,
        columns,
    )


@dataclass(frozen=True, slots=True)
class _Packing:
    """Packing of numbers, by attributes (CF conventions 1.11, sections 8.1 and 2.5.1)."""

    scale: float
    offset: float
    absent: tuple[float, ...]
    """Packed numbers that stand for none."""

    def unpacked(self, packed: NDArray[Any]) -> FloatArray:
        """Returns the numbers that packed ones stand for, NaN for none."""
        numbers = packed.astype(np.float64)
        is_absent = np.isin(numbers, self.absent)
        numbers *= self.scale
        numbers += self.offset
        numbers[is_absent] = np.nan
        return numbers


def _packing(name: str, dataset: Any) -> _Packing | None:  # noqa: ANN401
    """Returns how a dataset is packed; None where its numbers stand as they are.

    Raises `ValueError` where an attribute of it is no number.
    """
    scale, offset = _number(name, dataset, "scale_factor"), _number(name, dataset, "add_offset")
    stated = (_number(name, dataset, each) for each in ("_FillValue", "missing_value"))
    absent = tuple(each for each in stated if each is not None and not np.isnan(each))
    if scale in (None, 1.0) and offset in (None, 0.0) and not absent:
        return None
    if dataset.dtype.names is not None:
        raise ValueError(f"{name} has fields, and is packed")
    return _Packing(1.0 if scale is None else scale, 0.0 if offset is None else offset, absent)


def _number(name: str, dataset: Any, attribute: str) -> float | None:  # noqa: ANN401
    """Returns the one number of an attribute; None where there is none."""
    if attribute not in dataset.attrs:
        return None
    value = np.asarray(dataset.attrs[attribute])
    if value.size != 1 or value.dtype.kind not in "iuf":
        raise ValueError(f"{name} is packed, and its {attribute} is no number")
    return float(value.ravel()[0])


def _columns_beside(file: Any, name: str, dataset: Any) -> tuple[str, ...]:  # noqa: ANN401
    """Returns the names of the columns of a block of a pandas table, which stand in a dataset beside it.

    Raises `ValueError` where they are not as many.
    """
    block = re.fullmatch(r"((?:.*/)?block\d{1,4})_values", name)
    items = file.get(f"{block[1]}_items") if block else None
    if not isinstance(items, h5py.Dataset) or items.dtype.kind != "S" or len(items.shape) != 1:
        return ()
    if len(dataset.shape) != 2 or len(items) not in dataset.shape or len(items) > MOST_VARIABLES:
        raise ValueError(f"{name} has shape {dataset.shape} for {len(items)} names")
    return tuple(each.decode("utf-8", errors="replace") for each in items[()])


def _datasets(path: Path, file: Any) -> dict[str, Any]:  # noqa: ANN401 - h5py has no types
    """Returns the datasets of numbers by name, each once."""
    found: dict[str, Any] = {}
    for name, item in _objects(file, "", set()):
        # MATLAB keeps cells and objects in groups whose names begin so.
        if isinstance(item, h5py.Dataset) and not name.startswith("#") and _is_readable(item):
            found[name] = item
        if len(found) > MOST_VARIABLES:
            raise LogError(
                f"{path}: holds more than {MOST_VARIABLES} datasets, which is no log; check the file"
            )
    return found


def _objects(group: Any, above: str, seen: set[Any]) -> Iterator[tuple[str, Any]]:  # noqa: ANN401
    """Returns all objects of a group by name, each once; links to other names and files are not followed.

    `visititems` asks for the size of each group too, for which the library goes round a damaged one for ever.
    """
    for key in group:
        if not isinstance(group.get(key, getlink=True), h5py.HardLink):
            continue
        item, name = group[key], f"{above}{key}"
        if (number := h5py.h5g.get_objinfo(item.id).objno) in seen:
            continue
        seen.add(number)
        yield name, item
        if isinstance(item, h5py.Group):
            yield from _objects(item, f"{name}/", seen)


def _is_readable(dataset: Any) -> bool:  # noqa: ANN401
    if dataset.shape is None or 0 in dataset.shape or len(dataset.shape) > 2:
        return False
    if dataset.external or dataset.is_virtual or "MATLAB_empty" in dataset.attrs:
        return False
    if dataset.dtype.names is not None:
        return len(dataset.shape) == 1
    return is_numeric(dataset.dtype) and _text(dataset.attrs, ("MATLAB_class",)) not in ("char", "cell")


def _refuse_more_than_is_there(name: str, dataset: Any, size: int) -> None:  # noqa: ANN401
    """Raises `ValueError` where a dataset, or a chunk of it, states more than its bytes can hold."""
    kept = dataset.id.get_storage_size()
    packed = dataset.chunks is not None and dataset.id.get_create_plist().get_nfilters() > 0
    most = kept * (LARGEST_RATIO if packed else 1)
    if kept > size or dataset.nbytes > most + _chunk_bytes(dataset):
        raise ValueError(f"{name} says shape {dataset.shape}, and {kept} bytes of it are there")


def _chunk_bytes(dataset: Any) -> int:  # noqa: ANN401
    """Returns the bytes of memory that one chunk takes: the library unpacks it whole."""
    return 0 if dataset.chunks is None else prod(dataset.chunks) * int(dataset.dtype.itemsize)


def _attributes(attributes: Any) -> Mapping[str, Any]:  # noqa: ANN401
    return dict(attributes.items())


def _text(attributes: Any, names: tuple[str, ...]) -> str:  # noqa: ANN401
    """Returns the first of these attributes that is text."""
    for name in names:
        value = attributes.get(name)
        if isinstance(value, bytes):
            return value.decode("utf-8", errors="replace")
        if isinstance(value, str):
            return value
    return ""


def _pieces(path: Path, name: str, dataset: Any) -> Callable[[int], Iterator[NDArray[Any]]]:  # noqa: ANN401
    """Returns what passes over a dataset: over its bytes where they stand together and are as in memory."""
    offset, dtype = dataset.id.get_offset(), dataset.dtype
    if offset is None or dataset.file.userblock_size or dtype.kind not in "iuf":
        return _Pieces(path, name)
    if dataset.id.get_type() != h5py.h5t.py_create(dtype):
        return _Pieces(path, name)
    return StoredArray(name, lambda: open_regular(path), dataset.shape, False, dtype, offset).pieces


class _Pieces:
    """Passes over a dataset in whole chunks of those in which it is kept, so that each is unpacked once."""

    def __init__(self, path: Path, name: str) -> None:
        self._path = path
        self._name = name

    def __call__(self, axis: int) -> Iterator[NDArray[Any]]:
        with open_regular(self._path) as stream, h5py.File(stream, "r") as file:
            dataset = file[self._name]
            length = dataset.shape[axis]
            step = CHUNK_SAMPLES
            if dataset.chunks is not None:
                step = -(-step // dataset.chunks[axis]) * dataset.chunks[axis]
            for start in range(0, length, step):
                yield dataset[start : start + step] if axis == 0 else dataset[:, start : start + step]
