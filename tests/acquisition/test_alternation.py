"""A log in which units take turns is refused by every procedure; one unit never is, however it moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tumble
from align_motions import Motion, Sensor, drawn, record
from log_fixtures import made_up
from tumble.acquisition.acquire import acquire
from tumble.acquisition.alternation import MOST_UNITS, AlternationWatch
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Chunk, Recording
from tumble.foundation.units import TRIADS


def taking_turns(motion, units, seconds=30.0):
    """Samples of units on one body, each in turn."""
    parts = [
        record(motion, replace(drawn(k), sensor_from_body=Sensor().sensor_from_body, offset=0.0), seconds, k)
        for k in range(units)
    ]
    turn = np.arange(len(parts[0][0])) % units
    columns = (np.stack(each) for each in zip(*parts, strict=True))
    return [each[turn, np.arange(len(turn))] for each in columns]


@pytest.mark.parametrize("units", range(2, MOST_UNITS + 1))
@pytest.mark.parametrize("seed", range(3))
def test_units_that_take_turns_are_counted_and_refused(units, seed):
    time, force, rate = taking_turns(Motion(seed, turning=(0.3, 0.3, 0.3)), units)
    recording = Recording.from_arrays("unit", time, force, rate)
    with pytest.raises(ProcedureError, match=f"samples of {units} units take turns"):
        acquire(recording)
    with pytest.raises(ProcedureError, match=f"samples of {units} units take turns"):
        tumble.align(recording, [Recording.from_arrays("other", *record(Motion(seed), Sensor(), 30.0))])


@settings(max_examples=20)
@given(st.integers(0, 10**6), st.floats(0.0, 3.0), st.sampled_from([25.0, 100.0, 400.0]), st.floats(0.0, 0.9))
def test_one_unit_takes_no_turns_however_it_moves(seed, turning, rate_hz, jitter):
    motion = Motion(seed, turning=(turning,) * 3, fastest=4.0)
    time, force, rate = record(motion, Sensor(rate_hz=rate_hz, jitter=jitter), 60.0, seed)
    watch = AlternationWatch(TRIADS)
    for rows in np.array_split(np.arange(len(time)), 3):
        watch.push(Chunk(time[rows], force[rows], rate[rows]))
    assert watch.units() == 1


def test_a_line_near_half_the_rate_in_one_channel_is_no_other_unit():
    chunk = made_up(4000)
    force = chunk.accelerometer.copy()
    force[:, 2] += 5.0 * (-1.0) ** np.arange(len(chunk))
    watch = AlternationWatch(TRIADS)
    watch.push(replace(chunk, accelerometer=force))
    assert watch.units() == 1
