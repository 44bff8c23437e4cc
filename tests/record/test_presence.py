"""Seconds of a rest that a unit has shown: gaps and readings of a frozen unit count for nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tumble.foundation.recording import Chunk
from tumble.tools.record.presence import frozen_while_others_moved, seconds_shown

RATE = 100.0
RESTS = [(0.0, 10.0), (12.0, 22.0), (24.0, 34.0)]


def samples_of(seconds, held=(), random=None):
    time = np.arange(0.0, seconds, 1.0 / RATE)
    draws = (random or np.random.default_rng(5)).normal(size=(len(time), 6))
    for first, last in held:
        which = (time >= first) & (time <= last)
        draws[which] = draws[which][0]
    return Chunk(time, draws[:, :3], draws[:, 3:])


@given(st.floats(1.0, 9.0), st.floats(0.3, 5.0))
def test_a_gap_is_no_rest_of_the_unit(start, length):
    time = np.arange(0.0, 10.0, 1.0 / RATE)
    left = time[(time < start) | (time > start + length)]
    missing = min(start + length, 10.0) - start
    assert seconds_shown(left, (0.0, 10.0)) == pytest.approx(10.0 - missing, abs=0.05)


def test_the_span_alone_counts_and_nothing_counts_where_nothing_came():
    time = np.arange(0.0, 10.0, 1.0 / RATE)
    assert seconds_shown(time, (2.0, 5.0)) == pytest.approx(3.0, abs=0.02)
    assert seconds_shown(time, (11.0, 15.0)) == 0.0
    assert seconds_shown(np.empty(0), (2.0, 5.0)) == 0.0


def test_a_unit_that_froze_from_one_rest_to_the_next_shows_neither():
    samples = samples_of(34.0, held=[(5.0, 20.0)])
    [frozen] = frozen_while_others_moved(samples, RESTS)
    assert frozen == pytest.approx((5.0, 20.0), abs=0.02)
    shown = [seconds_shown(samples.time, rest, [frozen]) for rest in RESTS]
    assert shown == pytest.approx([5.0, 2.0, 10.0], abs=0.05)


def test_a_coarse_sensor_may_repeat_itself_for_a_whole_rest():
    samples = samples_of(34.0, held=[(0.0, 10.5), (11.8, 22.3)])
    assert list(frozen_while_others_moved(samples, RESTS)) == []
