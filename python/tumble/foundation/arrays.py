"""The one place where numbers of a caller become the arrays that all else takes: float64, row after row.

Lists, numpy arrays of any kind and order, and columns of pandas, polars or pyarrow are taken alike: whatever
numpy can make an array of. None of these libraries is imported.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tumble.foundation.errors import ArrayError

FloatArray: TypeAlias = NDArray[np.float64]

AXES = 3
_FLOAT64 = np.dtype(np.float64)


def triad(values: ArrayLike, name: str) -> FloatArray:
    """Accepts (n, 3) readings of three axes, or (3,) of a single sample, and returns them as (n, 3).

    Raises `ArrayError`, in one line, where they are no numbers or have another shape; so do all here.
    """
    rows = values if _is_ready(values) else _floats(values, name)
    if rows.shape == (0,):
        return rows.reshape(0, AXES)
    if rows.shape == (AXES,):
        return rows.reshape(1, AXES)
    if rows.ndim != 2 or rows.shape[1] != AXES:
        turned = "; turn it round with .T" if rows.ndim == 2 and rows.shape[0] == AXES else ""
        raise ArrayError(f"{name}: has shape {rows.shape}; give (n, 3), a row for each sample{turned}")
    return rows


def triad_or_unknown(values: ArrayLike | None, name: str, samples: int) -> FloatArray:
    """Accepts readings as `triad` does, or None for NaN in their place."""
    return np.full((samples, AXES), np.nan) if values is None else triad(values, name)


def column(values: ArrayLike, name: str) -> FloatArray:
    """Accepts (n,) numbers, or a single one."""
    numbers = _floats(values, name)
    if numbers.ndim > 1:
        raise ArrayError(f"{name}: has shape {numbers.shape}; give (n,), a number for each sample")
    return np.atleast_1d(numbers)


def times(values: ArrayLike, name: str = "time") -> FloatArray:
    """Accepts (n,) numbers, or dates or durations, which become s, dates since 1970."""
    return column(_seconds(_array(values, name), name), name)


def are_dates(values: ArrayLike) -> bool:
    """Returns whether the values are dates or durations, which carry their unit."""
    array = _array(values, "time")
    return array.dtype.kind in "mM" or hasattr(next(iter(array.ravel()), None), "tzinfo")


def refuse_other_lengths(arrays: Sequence[tuple[str, FloatArray | None]]) -> None:
    """Raises `ArrayError` where arrays, each with its name, differ in their number of rows."""
    (first, expected), *others = [(name, len(array)) for name, array in arrays if array is not None]
    for name, length in others:
        if length != expected:
            raise ArrayError(
                f"{name}: holds {length} samples, {first} {expected}; give one of each for every sample"
            )


def are_samples(time: object, accelerometer: object, gyroscope: object, temperature: object) -> bool:
    """Returns whether shapes are (n,), (n, 3), (n, 3) and, if given, (n,), and need no conversion."""
    if not (_is_ready(time) and _is_ready(accelerometer) and _is_ready(gyroscope)):
        return False
    rows, triads = time.shape, (*time.shape, AXES)
    return (
        len(rows) == 1
        and accelerometer.shape == triads
        and gyroscope.shape == triads
        and (temperature is None or (_is_ready(temperature) and temperature.shape == rows))
    )


def _is_ready(values: object) -> TypeGuard[FloatArray]:
    """Returns whether the values need no conversion; a quick test for samples that come one by one."""
    return type(values) is np.ndarray and values.dtype is _FLOAT64 and values.flags.c_contiguous


def _floats(values: ArrayLike, name: str) -> FloatArray:
    if isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(np.float64), np.nan)
    array = _array(values, name)
    if array.dtype.kind not in "fiuO" or any(isinstance(value, str) for value in _objects(array)):
        kind = "text" if array.dtype.kind in "OUT" else array.dtype
        raise ArrayError(f"{name}: holds {kind}, not numbers; convert it first")
    try:
        return np.asarray(array, np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise ArrayError(
            f"{name}: holds what is no number ({error}); leave it out, or put NaN there"
        ) from None


def _objects(array: NDArray[Any]) -> NDArray[Any]:
    return array.ravel() if array.dtype.kind == "O" else array.ravel()[:0]


def _array(values: ArrayLike, name: str) -> NDArray[Any]:
    try:
        return np.asarray(values)
    except ValueError:
        raise ArrayError(f"{name}: has rows of different lengths; give as many numbers in each") from None


def _seconds(array: NDArray[Any], name: str) -> NDArray[Any]:
    if array.dtype.kind == "O" and are_dates(array):
        array = _dates(array, name)
    if array.dtype.kind not in "mM":
        return array
    nanoseconds = array.astype(f"{'datetime64' if array.dtype.kind == 'M' else 'timedelta64'}[ns]")
    return np.where(np.isnat(nanoseconds), np.nan, nanoseconds.astype(np.int64) / 1e9)


def _dates(objects: NDArray[Any], name: str) -> NDArray[Any]:
    """Accepts dates that numpy has no type for: those with a time zone become s since 1970."""
    try:
        if next(iter(objects.ravel())).tzinfo is None:
            return objects.astype("datetime64[ns]")
        return np.array([date.timestamp() for date in objects.ravel()]).reshape(objects.shape)
    except (AttributeError, TypeError, ValueError) as error:
        raise ArrayError(f"{name}: holds what is no date ({error}); leave it out") from None
