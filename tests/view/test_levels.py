"""Levels of detail: what is left out of a chart is within what it shows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tumble.tools.view import levels
from tumble.tools.view.column import BLOCK, Extremes, GrowingColumn
from tumble.tools.view.levels import POINTS_OF_A_BIN, level, shown


def column_of(values, pieces=1):
    column, extremes = GrowingColumn(), Extremes()
    for piece in np.array_split(values, pieces):
        column.append(piece)
        extremes.append(piece)
    return column, extremes


def drawn(seed, count):
    """Noise with rare spikes, in which a stride would miss most of what happened."""
    random = np.random.default_rng(seed)
    return random.normal(size=count) + 100.0 * (random.random(count) > 0.999) * random.normal(size=count)


@given(seed=st.integers(0, 2**32), bins=st.integers(2, 60), count=st.integers(4, 300))
def test_lowest_and_highest_of_each_bin_are_shown(seed, bins, count):
    values = drawn(seed, bins * count)
    at = shown(values, bins)
    for number, part in enumerate(values.reshape(bins, count)):
        of_bin = values[at[(at >= number * count) & (at < (number + 1) * count)]]
        assert of_bin.min() == part.min(), (seed, bins, count)
        assert of_bin.max() == part.max(), (seed, bins, count)


@given(seed=st.integers(0, 2**32), bins=st.integers(3, 100), count=st.integers(1, 30_000))
def test_few_points_are_shown_in_order_and_ends_among_them(seed, bins, count):
    at = shown(drawn(seed, count), bins)
    assert (np.diff(at) > 0).all()
    assert at[0] == 0
    assert at[-1] == count - 1
    assert len(at) <= POINTS_OF_A_BIN * bins + 2


@given(
    seed=st.integers(0, 2**32),
    first=st.integers(0, 3000),
    count=st.integers(5000, 20_000),
    pieces=st.integers(1, 40),
)
def test_blocks_keep_the_extremes_of_any_window(seed, first, count, pieces):
    values = drawn(seed, first + count + 700)
    column, extremes = column_of(values, pieces)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(levels, "DIRECT", 0)
        at = level(column, extremes, first, first + count, 8)
    window = values[first : first + count]
    assert first == at[0]
    assert at[-1] == first + count - 1
    assert values[at].min() == window.min(), seed
    assert values[at].max() == window.max(), seed
    # No sample lies outside of what is shown within a bin to either side of it.
    bin_width = -(-count // 8) + 2 * BLOCK
    for place in np.random.default_rng(seed).integers(first, first + count, 20):
        near = values[at[abs(at - place) <= bin_width]]
        assert near.min() <= values[place] <= near.max(), (seed, place)


def test_values_without_number_hide_no_others():
    values = np.full(10_000, np.nan)
    values[5000] = 3.0
    assert 5000 in shown(values, 20)


def test_a_column_holds_its_values_bit_by_bit():
    values = drawn(1, 70_001)
    column, _ = column_of(values, 13)
    np.testing.assert_array_equal(column.values(), values)
    column.close()
