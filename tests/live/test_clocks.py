"""Time of samples as they come: counters that begin again, clocks that start anew, devices without one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from live_fixtures import HEADER, pieces_of, resting, samples_of, scripted, text_lines
from simulated_clock import SimulatedClock
from tumble.foundation.errors import LogError
from tumble.live.clock import ArrivalClock, CountingClock, DeviceClock
from tumble.live.source import UnreadableSourceError

COUNTER = 2**32


@given(
    start=st.integers(0, COUNTER - 1),
    steps=st.lists(st.integers(1, COUNTER // 4), min_size=1, max_size=60),
    cut=st.integers(1, 20),
)
def test_a_counter_of_32_bits_runs_on_where_it_begins_again(start, steps, cut):
    truth = start + np.concatenate([[0], np.cumsum(steps)])
    clock = DeviceClock()
    shown = (truth % COUNTER).astype(np.float64)
    found = [clock.stamp(shown[first : first + cut]) for first in range(0, len(shown), cut)]
    assert np.array_equal(np.concatenate(found), truth)


def test_overtaken_sample_at_a_counter_restart_keeps_its_time():
    truth = COUNTER + np.array([-20.0, -10.0, 10.0, -5.0, 20.0, 30.0])
    clock = DeviceClock()
    found = np.concatenate([clock.stamp(truth[k : k + 1] % COUNTER) for k in range(len(truth))])
    assert np.array_equal(found, truth)
    assert np.array_equal(DeviceClock().stamp(truth % COUNTER), truth)


def test_stamps_larger_than_a_counter_are_left_as_they_are():
    stamps = 1.7e15 + np.array([0.0, 1e4, 2e4, -3e9, 3e4])
    assert np.array_equal(DeviceClock().stamp(stamps), stamps)
    leap = np.array([10.0, 20.0, 1.7e15, 1.7e15 + 10.0])
    assert np.array_equal(DeviceClock().stamp(leap), leap)


@pytest.mark.parametrize(("unit", "per_second"), [("us", 1e6), ("ms", 1e3)])
def test_time_runs_on_when_the_counter_of_a_device_begins_again(unit, per_second):
    table = resting(200)
    shown = table.copy()
    shown[:, 0] = (COUNTER - 1000 + np.round(table[:, 0] * per_second)) % COUNTER
    header = HEADER.replace("time", f"time_{unit}")
    found = samples_of(scripted([text_lines(shown, header=header)]))
    assert len(found) == len(table)
    assert np.allclose(np.diff(found[:, 0]), 0.01, rtol=0.0, atol=1e-6)


def test_samples_that_come_twice_or_late_are_left_out_and_counted():
    table = resting(100)
    order = [*range(40), 38, 39, *range(40, 100), 97]
    source = scripted([text_lines(table[order])])
    assert np.array_equal(samples_of(source), table)
    assert "left out 3 samples that came twice or out of order" in source.remarks


def coarse(step, rate=100.0):
    """Rows at rest whose stamps are rounded down to steps, s."""
    table = resting(400)
    table[:, 0] = np.floor(np.arange(len(table)) / rate / step + 1e-9) * step
    return table


@pytest.mark.parametrize("per_arrival", [1, 7, 400])
@pytest.mark.parametrize("step", [0.02, 0.05])
def test_samples_that_share_stamps_but_not_values_are_refused(step, per_arrival):
    lines = text_lines(coarse(step)).splitlines(keepends=True)
    pieces = [b"".join(lines[k : k + per_arrival]) for k in range(0, len(lines), per_arrival)]
    with pytest.raises(UnreadableSourceError, match=r"too coarse; give the rate of its samples with --rate"):
        samples_of(scripted(pieces))


def test_a_coarse_clock_is_no_matter_where_the_rate_is_stated():
    table = coarse(0.02)
    found = samples_of(scripted([text_lines(table)], rate=100.0))
    assert np.allclose(found[:, 0], np.arange(400) / 100.0)


def test_stamps_of_whole_milliseconds_serve_nearly_as_many_samples():
    """At 960 samples a second none shares its stamp, at 1050 one in 21."""
    for rate, least in ((960.0, 400), (1050.0, 380)):
        assert len(samples_of(scripted([text_lines(coarse(0.001, rate))]))) >= least


def test_a_device_that_starts_anew_is_refused():
    table = resting(200)
    with pytest.raises(LogError, match=r"time ran back by 1\.9\d* s .* the device restarted"):
        samples_of(scripted([text_lines(table), text_lines(table[5:], header=None)]))


def test_samples_without_time_get_their_arrival_and_it_is_reported():
    table = resting(100)
    lines = text_lines(table[:, 1:], header=HEADER.removeprefix("time,")).splitlines(keepends=True)
    source = scripted(lines)
    found = samples_of(source)
    # The first have no time where several come together, as on a busy computer.
    assert len(found) > 50
    assert np.array_equal(found[:, 1:], table[-len(found) :, 1:])
    assert (np.diff(found[:, 0]) > 0.0).all()
    assert any("time of their arrival" in remark or "of their arrival" in remark for remark in source.remarks)


def test_a_pause_among_first_samples_without_time_costs_none():
    table = resting(100)
    lines = text_lines(table[:, 1:], header=HEADER.removeprefix("time,")).splitlines(keepends=True)
    # A reader that was kept from the processor for a second, a thousand times the usual step.
    arrivals = np.arange(len(lines)) * 1e-3 + (np.arange(len(lines)) > 30)
    with SimulatedClock():
        found = samples_of(scripted(lines, arrivals=arrivals))
    assert np.array_equal(found[:, 1:], table[-len(found) :, 1:])
    assert len(found) > 90


def test_samples_that_arrive_together_are_spread_since_the_previous():
    clock = ArrivalClock()
    first, second, third = clock.stamp(3, 50.0), clock.stamp(4, 50.2), clock.stamp(1, 50.3)
    assert np.array_equal(first, [np.nan, np.nan, 0.0], equal_nan=True)
    assert np.allclose(second, [0.05, 0.10, 0.15, 0.20])
    assert np.allclose(third, [0.3])


def test_a_rate_replaces_time():
    table = resting(100)
    scrambled = table.copy()
    scrambled[:, 0] = 7.0
    found = samples_of(scripted([text_lines(scrambled)], rate=100.0))
    assert np.allclose(found, table, rtol=0.0, atol=1e-12)


def test_samples_are_counted_across_pieces():
    clock = CountingClock(200.0)
    found = np.concatenate([clock.stamp(3), clock.stamp(0), clock.stamp(5)])
    assert np.array_equal(found, np.arange(8) / 200.0)


@pytest.mark.parametrize("back", [0.3, 0.9])
def test_clock_set_back_by_under_1_s_is_refused_and_a_late_sample_not(back):
    table = resting(300)
    table[150:, 0] -= back
    with pytest.raises(LogError, match="time ran back"):
        samples_of(scripted(pieces_of(text_lines(table), 64)))
    table = resting(300)
    table[[100, 200], 0] -= back
    assert len(samples_of(scripted(pieces_of(text_lines(table), 64)))) >= 295
