"""Datagrams overtake each other: samples are put back in order within a window, and none is lost."""

from __future__ import annotations

import json
import socket

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ports import free_port
from simulated_clock import SimulatedClock
from tumble.foundation import clock
from tumble.live import open_source
from tumble.live.readings import Readings
from tumble.live.reordering import ReorderBuffer
from tumble.logs.track import RawSamples

RATE = 100.0
WINDOW = 0.05


def readings(stamps):
    stamps = np.asarray(stamps, dtype=np.float64)
    values = np.repeat(stamps[:, np.newaxis], 3, axis=1)
    return Readings(RawSamples(stamps, values, -values, 2.0 * stamps), 3.0 * stamps)


def passed(stamps, arrivals, window=WINDOW):
    """Stamps as they come out of a buffer, with the times at which they do; both (n,)."""
    buffer = ReorderBuffer(window)
    out, when = [], []
    head = readings(np.arange(-20, 0) / RATE)
    buffer.push(head, arrivals[0] - 1.0)
    for stamp, arrival in zip(stamps, arrivals, strict=True):
        given_now, _ = buffer.push(readings([stamp]), arrival)
        out += given_now.samples.time.tolist()
        when += [arrival] * len(given_now)
    last, _ = buffer.due(arrivals[-1] + 2.0 * window)
    return np.array([*out, *last.samples.time]), np.array([*when, *[np.inf] * len(last)]), buffer


@settings(max_examples=200)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.04), st.floats(0.0, 0.2), st.floats(0.0, 0.5))
def test_samples_within_the_window_come_out_in_order_and_whole(seed, delay, loss, unevenness):
    rng = np.random.default_rng(seed)
    stamps = (np.arange(300) + unevenness * rng.uniform(0.0, 0.4, 300)) / RATE
    stamps = stamps[rng.random(300) >= loss]
    arrivals = stamps + rng.uniform(0.0, delay, len(stamps))
    order = np.argsort(arrivals, kind="stable")
    out, _, buffer = passed(stamps[order], 100.0 + arrivals[order])
    assert np.array_equal(out, stamps)
    overtaken = np.count_nonzero(stamps[order] < np.maximum.accumulate(stamps[order]))
    assert buffer.sorted == overtaken


def test_samples_in_order_are_not_delayed():
    stamps = np.arange(300) / RATE
    _, when, buffer = passed(stamps, 100.0 + stamps)
    assert np.array_equal(when, 100.0 + stamps)
    assert buffer.sorted == 0


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.3))
def test_no_sample_waits_longer_than_the_window_and_one_step(seed, loss):
    rng = np.random.default_rng(seed)
    stamps = np.arange(300) / RATE
    stamps = stamps[rng.random(300) >= loss]
    _, when, _ = passed(stamps, 100.0 + stamps)
    gaps = np.diff(stamps, append=np.inf)
    waited = when - (100.0 + stamps)
    assert np.all(waited[np.isfinite(when)] <= WINDOW + gaps[np.isfinite(when)].max() + 1e-9)


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_samples_of_a_sender_that_caught_up_wait_a_step_at_most(seed):
    held_up = np.zeros(300)
    held_up[10::20] = np.random.default_rng(seed).uniform(0.0, 6.0, 15)
    stamps = np.zeros(300)
    for number in range(1, 300):
        stamps[number] = max(number + held_up[number], stamps[number - 1] + 0.02)
    _, when, _ = passed(stamps / RATE, 100.0 + stamps / RATE)
    assert np.all(when - (100.0 + stamps / RATE) <= 1.0 / RATE)


def test_a_sample_beyond_the_window_comes_late_and_holds_nothing_up():
    stamps = np.concatenate([np.arange(100), [50.0], np.arange(100, 200)]) / RATE
    arrivals = 100.0 + np.maximum.accumulate(stamps)
    out, when, _ = passed(stamps, arrivals)
    assert np.array_equal(out, stamps)
    assert np.array_equal(when, arrivals)


@pytest.mark.parametrize("leap", [-20.0, 1e6, np.nan])
def test_a_clock_that_leaps_is_not_sorted(leap):
    stamps = np.concatenate([np.arange(100), leap + np.arange(100)]) / RATE
    out, _, _ = passed(stamps, 100.0 + np.arange(200) / RATE)
    assert np.array_equal(out, stamps, equal_nan=True)


def test_all_columns_of_a_sample_move_together():
    buffer = ReorderBuffer(WINDOW)
    buffer.push(readings(np.arange(-20, 0) / RATE), 99.0)
    buffer.push(readings([0.01]), 100.0)
    out, _ = buffer.push(readings([0.0]), 100.001)
    assert np.array_equal(out.samples.time, [0.0, 0.01])
    assert np.array_equal(out.samples.accelerometer[:, 1], [0.0, 0.01])
    assert np.array_equal(out.samples.gyroscope[:, 1], [0.0, -0.01])
    assert np.array_equal(out.samples.temperature, [0.0, 0.02])
    assert np.array_equal(out.moving, [0.0, 0.03])


def test_the_usual_step_follows_a_new_rate():
    stamps = np.concatenate([np.arange(200) / RATE, 2.0 + np.arange(400) * 4.0 / RATE])
    _, when, _ = passed(stamps, 100.0 + stamps)
    assert np.array_equal(when[-100:], 100.0 + stamps[-100:])


def sent_over_udp(order, setting=""):
    """Stamps that a source gives of datagrams sent in this order, and its remarks."""
    port = free_port()
    with SimulatedClock(), open_source(f"udp://127.0.0.1:{port}{setting}") as source:

        def send():
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
                for number in order:
                    sample = {"t": number / RATE, "acc": [0.1, 0.2, 9.8], "gyro": [0.0, 0.01, 0.0]}
                    line.sendto(json.dumps(sample).encode(), ("127.0.0.1", port))
                    clock.sleep(0.0005)

        sender = clock.thread(send)
        sender.start()
        times, silent = [], 0
        for chunk in source:
            times += chunk.time.tolist()
            silent = 0 if len(chunk) else silent + (not sender.is_alive())
            if silent > 3:
                break
        clock.wait(sender)
        return np.array(times), source.remarks


def shuffled(seed=11):
    """Numbers of 400 datagrams of which a fifth is overtaken by up to three others."""
    return np.argsort(np.arange(400) + np.random.default_rng(seed).choice([0.0, 2.5], 400, p=[0.8, 0.2]))


def test_datagrams_that_overtake_each_other_are_sorted_by_default():
    times, remarks = sent_over_udp(shuffled())
    assert np.array_equal(times, np.arange(400) / RATE)
    assert any("that others had overtaken" in remark for remark in remarks)


def test_reorder_zero_takes_samples_as_they_come():
    times, remarks = sent_over_udp(shuffled(), "?reorder=0")
    assert len(times) < 380
    assert any("came twice or out of order" in remark for remark in remarks)


def test_a_window_that_is_no_time_is_refused():
    with pytest.raises(Exception, match="reorder=-1: give a number of 0 or more"):
        open_source("udp://127.0.0.1:9000?reorder=-1")
