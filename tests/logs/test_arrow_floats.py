"""Columns of Arrow as arrays, compared with what pyarrow itself makes of them."""

import numpy as np
import pyarrow as pa
import pytest

from tumble.logs.arrow_floats import as_floats

NUMBERS = pa.array([1.5, None, -2.0, 3.25, None, 0.0, 7.0, 8.0, None, 9.5])


@pytest.mark.parametrize(
    "column",
    [
        NUMBERS,
        NUMBERS[1:],
        NUMBERS[2:4],
        NUMBERS[:0],
        pa.array([1, None, 3], pa.int16()),
        pa.array([True, False, None]),
        pa.array([1.5, None, 1.5, 2.5]).dictionary_encode(),
        pa.array(["1.5", None, "2", "1.5"]).dictionary_encode()[1:],
        pa.chunked_array([NUMBERS.dictionary_encode(), NUMBERS[:0].dictionary_encode()]),
        pa.chunked_array([NUMBERS[:3], NUMBERS[3:3], NUMBERS[5:]]),
        pa.chunked_array([], pa.float64()),
        pa.chunked_array([NUMBERS[3:8]]),
    ],
    ids=lambda column: f"{column.type}-{len(column)}-{type(column).__name__}",
)
def test_a_column_of_arrow_is_the_same_numbers_in_numpy(column):
    assert np.array_equal(as_floats(column), np.array(column.to_pylist(), np.float64), equal_nan=True)


def test_dates_of_arrow_are_nanoseconds_since_1970():
    column = pa.array([1_000_001, None], pa.timestamp("us", tz="UTC"))
    assert np.array_equal(as_floats(column), [1_000_001_000.0, np.nan], equal_nan=True)
