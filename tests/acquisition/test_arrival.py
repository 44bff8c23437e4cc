"""Stamps that drift from the times of their recording are as uncertain as both clocks differ."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from log_fixtures import made_up
from tumble.acquisition.stamps import with_sample_times
from tumble.foundation.recording import Recording

SEED = 6
ROWS = 6000


def recording(skew, jitter, stall=0.0):
    """A log whose recorder gains on the stamps by a share, behind delays of an exponential distribution."""
    print(f"seed {SEED}")
    draws = np.random.default_rng(SEED)
    chunk = made_up(ROWS)
    time = np.arange(ROWS) / 100.0
    received = 1e9 + (1.0 + skew) * time + draws.exponential(jitter, ROWS)
    received[ROWS // 2 : ROWS // 2 + 200] += stall
    log = Recording.from_arrays("unit", time, chunk.accelerometer, chunk.gyroscope)
    whole = replace(chunk, time=time, temperature=None, received=received)
    return replace(log, open=lambda: iter([whole]))


@pytest.mark.parametrize("jitter", [1e-4, 2e-3, 2e-2])
@pytest.mark.parametrize("skew", [0.02, -0.02, 1e-3])
def test_the_difference_of_two_clocks_is_in_the_sigma_of_the_pace(skew, jitter):
    found = with_sample_times(recording(skew, jitter)).metadata
    assert found.pace_sigma == pytest.approx(abs(skew), abs=3.0 * jitter / 60.0)
    (remark,) = found.remarks
    assert f"stamps run {100.0 * abs(skew):.2g}"[:13] in remark
    assert ("slow" if skew > 0.0 else "fast") in remark


@pytest.mark.parametrize("stall", [0.0, 0.5])
@pytest.mark.parametrize("jitter", [1e-4, 2e-3, 2e-2])
def test_clocks_as_alike_as_crystals_bear_no_remark(jitter, stall):
    found = with_sample_times(recording(5e-5, jitter, stall)).metadata
    assert found.remarks == ()
    assert found.pace_sigma <= 1e-4


def test_a_log_with_one_time_is_as_it_was():
    log = Recording.from_arrays("unit", np.arange(100) / 100.0, np.ones((100, 3)), np.zeros((100, 3)))
    assert with_sample_times(log) is log
