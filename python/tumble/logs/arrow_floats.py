"""Arrow columns as arrays of numpy, from their memory: `to_numpy` of pyarrow imports pandas."""

from __future__ import annotations

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]

from tumble.foundation.recording import FloatArray


def as_floats(column: pa.ChunkedArray | pa.Array) -> FloatArray:
    """Returns a column as (n,) float64, NaN where it is null; date and time become nanoseconds.

    They count from 1970, a time of day from midnight.
    """
    if pa.types.is_dictionary(column.type):
        parts = [_of_dictionary(part) for part in getattr(column, "chunks", [column])]
        return np.concatenate([np.empty(0), *parts])
    if pa.types.is_timestamp(column.type):
        column = column.cast(pa.timestamp("ns", column.type.tz)).cast(pa.int64())
    if pa.types.is_time(column.type):
        column = column.cast(pa.int64())
    if column.type != pa.float64():
        column = column.cast(pa.float64(), safe=False)
    parts = [_floats(part) for part in getattr(column, "chunks", [column])]
    return parts[0] if len(parts) == 1 else np.concatenate([np.empty(0), *parts])


def _of_dictionary(array: pa.DictionaryArray) -> FloatArray:
    """Returns values that stand for many each: to put each in its places first would take any memory."""
    places = as_floats(array.indices)
    is_known = ~np.isnan(places)
    values = np.full(len(places), np.nan)
    values[is_known] = as_floats(array.dictionary)[places[is_known].astype(np.int64)]
    return values


def _floats(array: pa.Array) -> FloatArray:
    validity, data = array.buffers()
    first, end = array.offset, array.offset + len(array)
    values: FloatArray = np.frombuffer(data or b"", np.float64)[first:end]
    if not array.null_count:
        return values
    bits = np.frombuffer(validity, np.uint8)
    valid = np.unpackbits(bits, count=end, bitorder="little")[first:]
    return np.where(valid, values, np.nan)
