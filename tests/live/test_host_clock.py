"""Host times of samples from stamps and arrivals, where clocks and delays are known."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from repetitions import repetitions
from tumble.foundation.clock_skew import lower_hull
from tumble.live.host_clock import DelayCounts, HostClock
from tumble.live.least_delay import BLOCKS, MOST_CORNERS, LeastDelay

LEAST = 0.003
"""s that even the quickest sample takes."""


class Line:
    """A sensor with a skewed clock, and what lies between it and the computer."""

    def __init__(self, seed, rate=100.0, seconds=20.0, skew=None, jitter=1e-3, batch=1, stalls=0):
        generator = np.random.default_rng(seed)
        count = round(rate * seconds)
        self.skew = generator.uniform(-1e-4, 1e-4) if skew is None else skew
        self.taken = 1e5 + np.arange(count) / rate
        self.stamps = 40.0 + (self.taken - self.taken[0]) / (1.0 + self.skew)
        arrival = self.taken + LEAST + generator.exponential(jitter, count)
        for start in self.taken[0] + generator.uniform(0.0, seconds, stalls):
            held = (arrival >= start) & (arrival < start + 1.0)
            arrival[held] = start + 1.0
        arrival = np.maximum.accumulate(arrival)
        last = np.minimum(np.arange(count) // batch * batch + batch - 1, count - 1)
        self.arrivals = arrival[last]

    def pieces(self, up_to=None):
        """Stamps, arrival and true host times of samples that came together."""
        ends = [*(np.flatnonzero(np.diff(self.arrivals)) + 1).tolist(), len(self.stamps)]
        first = 0
        for end in ends:
            if up_to is not None and self.stamps[first] - self.stamps[0] > up_to:
                return
            yield self.stamps[first:end], float(self.arrivals[end - 1]), self.taken[first:end]
            first = end

    def followed(self, up_to=None):
        """The clock after so many seconds, and the error of its last host time beyond the least delay, s."""
        clock = HostClock()
        for stamps, arrival, taken in self.pieces(up_to):
            error = clock.host_times(stamps, arrival)[-1] - taken[-1] - LEAST
        return clock, float(error)


@pytest.mark.parametrize(
    ("way", "seconds"),
    [
        ({}, 0.3),
        ({}, 3.0),
        ({"rate": 50.0}, 15.0),
        ({"rate": 400.0, "batch": 10}, 0.5),
        ({"rate": 400.0, "batch": 10}, 10.0),
        ({"stalls": 1}, 2.0),
        ({"stalls": 2}, 10.0),
        ({"rate": 200.0, "batch": 10, "stalls": 1, "jitter": 5e-3}, 10.0),
    ],
)
def test_host_times_are_right_within_their_sigma_in_95_of_100_cases(way, seconds):
    runs = repetitions(400)
    print(f"seeds 0 to {runs - 1}")
    errors, sigmas = [], []
    for seed in range(runs):
        clock, error = Line(seed, seconds=seconds + 1.0, **way).followed(seconds)
        errors.append(abs(error))
        sigmas.append(clock.sigma)
    assert np.mean(np.array(errors) <= 2.0 * np.array(sigmas)) >= 0.95
    # A sigma that is honest because it is vast would be useless.
    assert np.median(sigmas) < 20.0 * np.quantile(errors, 0.8)


@pytest.mark.parametrize("seed", range(8))
def test_the_skew_of_a_clock_is_found_within_its_uncertainty(seed):
    line = Line(seed, seconds=60.0, batch=2, stalls=2)
    clock, _ = line.followed()
    assert abs(clock.skew - line.skew) < 3.0 * clock.skew_sigma
    assert clock.skew_sigma < 2e-6


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    batch=st.integers(1, 20),
    stalls=st.integers(0, 3),
    jitter=st.floats(1e-6, 0.1),
    cut=st.integers(2, 500),
    jump=st.floats(-200.0, 200.0) | st.floats(-1.0, 1.0),
)
def test_host_times_increase_strictly_whatever_comes(seed, batch, stalls, jitter, cut, jump):
    line = Line(seed, seconds=10.0, batch=batch, stalls=stalls, jitter=jitter)
    line.stamps[cut:] += jump
    clock, found = HostClock(), []
    for stamps, arrival, _ in line.pieces():
        ends = [0, *(np.flatnonzero(np.diff(stamps) <= 0.0) + 1).tolist(), len(stamps)]
        for first, end in pairwise(ends):
            found.append(clock.host_times(stamps[first:end], arrival))
    assert (np.diff(np.concatenate(found)) > 0.0).all()


def test_host_times_are_no_later_than_the_arrival_of_their_sample():
    line = Line(3, seconds=20.0, batch=5, stalls=1)
    clock = HostClock()
    late = [clock.host_times(stamps, arrival)[-1] - arrival for stamps, arrival, _ in line.pieces()]
    assert max(late[200:]) <= 1e-6


def test_once_settled_host_times_are_slewed_and_not_stepped():
    line = Line(1, seconds=30.0, jitter=5e-3)
    # The way becomes 2 ms shorter after 20 s: better to be known slowly than to jump.
    line.arrivals[2000:] -= 2e-3
    clock = HostClock()
    host = np.concatenate([clock.host_times(stamps, arrival) for stamps, arrival, _ in line.pieces()])
    pace = np.diff(host) / np.diff(line.stamps) - 1.0
    assert clock.settled
    assert np.abs(pace[1000:]).max() < 2e-3
    assert abs(host[-1] - line.taken[-1] - LEAST + 2e-3) < 1e-3


def test_a_stall_leaves_offset_and_skew_as_they_were():
    smooth, _ = Line(5, seconds=20.0).followed()
    line = Line(5, seconds=20.0)
    held = (line.arrivals > line.taken[0] + 16.0) & (line.arrivals < line.taken[0] + 19.0)
    line.arrivals[held] = line.taken[0] + 19.0
    stalled, error = line.followed()
    assert stalled.leaps == 0
    assert abs(error) < 1e-4
    assert abs(stalled.offset - smooth.offset) < 1e-4
    assert stalled.delays.largest > 2.9


def test_samples_waiting_in_buffers_at_the_start_are_no_leap():
    line = Line(6, seconds=10.0)
    line.arrivals[:80] = line.arrivals[80]
    line.arrivals[:80] -= np.repeat(np.arange(8)[::-1], 10) * 1e-4
    clock, error = line.followed()
    assert clock.leaps == 0
    assert abs(error) < 1e-4


class Load:
    """Arrivals at a computer whose load comes and goes: heavy-tailed delays, and all late for seconds."""

    def __init__(self, seed, seconds=60.0, rate=100.0):
        print(f"seed {seed}")
        generator = np.random.default_rng(seed)
        count = round(seconds * rate)
        self.taken = 1e5 + np.arange(count) / rate
        self.stamps = 40.0 + np.arange(count) / rate
        late = 1e-3 * generator.pareto(1.2, count)
        for start in np.cumsum(generator.exponential(6.0, 12)):
            busy = (self.taken - self.taken[0] > start) & (self.taken - self.taken[0] < start + 3.0)
            late[busy] += generator.exponential(0.2)
        # At first nothing comes quickly: the program is still loading.
        late[: generator.integers(100, 900)] += generator.uniform(0.05, 0.4)
        self.arrivals = np.maximum.accumulate(self.taken + LEAST + np.minimum(late, 0.9))

    def steps(self):
        """For each sample by how much host times step more than stamps, the step of these and sigma."""
        clock, last, sigma = HostClock(), None, np.inf
        for stamp, arrival in zip(self.stamps, self.arrivals, strict=True):
            host = float(clock.host_times(np.array([stamp]), float(arrival))[0])
            if last is not None:
                step = stamp - last[0]
                yield host - last[1] - step, step, sigma, clock
            last, sigma = (stamp, host), clock.sigma


@pytest.mark.parametrize("seed", range(12))
def test_under_load_host_times_never_jump_beyond_their_sigma(seed):
    for extra, step, sigma, clock in Load(seed).steps():
        assert extra > -step
        if clock.settled:
            assert abs(extra) <= (1.1e-3 + abs(clock.skew)) * step + 1e-9
        else:
            assert extra <= max(sigma, 0.92 * step)
    assert clock.leaps == 0


@pytest.mark.parametrize("seed", range(12))
def test_under_load_the_sigma_holds_what_is_yet_to_be_slewed(seed):
    load = Load(seed)
    clock = HostClock()
    for stamp, arrival, taken in zip(load.stamps, load.arrivals, load.taken, strict=True):
        error = float(clock.host_times(np.array([stamp]), float(arrival))[0]) - taken - LEAST
    assert abs(error) < 3.0 * clock.sigma


@pytest.mark.parametrize("jump", [-30.0, -2.0, 0.5, 3600.0])
def test_a_clock_that_is_set_is_followed_anew_and_that_is_counted(jump):
    line = Line(7, seconds=40.0)
    line.stamps[2000:] += jump
    clock, error = line.followed()
    assert clock.leaps == 1
    assert abs(error) < 2e-4
    assert abs(error) < 3.0 * clock.sigma


def test_warming_clock_is_followed_and_its_bend_is_in_the_sigma():
    line = Line(8, seconds=120.0, jitter=2e-4, skew=0.0)
    since = line.taken - line.taken[0]
    # 5 ppm in two minutes.
    line.stamps = line.stamps - 0.5 * (5e-6 / 120.0) * since**2
    clock, error = line.followed()
    assert abs(error) < 2.0 * clock.sigma
    assert clock.sigma < 3e-4


def test_nothing_is_called_certain_before_enough_samples():
    clock = HostClock()
    assert clock.sigma == np.inf
    assert clock.remark == ""
    host = clock.host_times(np.array([5.0, 5.01]), 100.0)
    assert host.tolist() == [99.99, 100.0]
    assert clock.sigma == np.inf
    assert not clock.settled


def test_the_remark_says_skew_sigma_and_delays_in_one_line():
    clock, _ = Line(9, seconds=20.0, skew=5e-5).followed()
    assert clock.remark.startswith("clock is 50.")
    assert "ppm slow; times are certain to" in clock.remark
    assert "(median)" in clock.remark
    assert "\n" not in clock.remark


def test_times_of_arrival_are_as_uncertain_as_arrivals_are_uneven():
    generator = np.random.default_rng(10)
    arrivals = 50.0 + np.cumsum(0.01 + generator.normal(0.0, 1e-3, 1000))
    clock = HostClock(stamped=False)
    for arrival in arrivals.tolist():
        host = clock.host_times(np.array([arrival - 50.0]), arrival)
        assert abs(host[0] - arrival) < 1e-6
    assert 0.8e-3 < clock.sigma < 1.2e-3
    assert "carry no time" in clock.remark


def test_memory_stays_the_same_however_long_a_stream_is():
    line = LeastDelay()
    generator = np.random.default_rng(11)
    for stamp in np.arange(0.0, 86400.0, 5.0).tolist():
        # A clock that bends makes a corner of every point.
        line.add(stamp, 1e-9 * stamp**2 + 1e-9 * float(generator.exponential()))
    assert len(line._blocks) <= BLOCKS
    assert max(len(block.corners) for block in line._blocks) <= MOST_CORNERS
    fast = LeastDelay()
    for k in range(50_000):
        fast.add(1e-3 * k, 1e-6 * (1e-3 * k - 25.0) ** 2)
    assert max(len(block.corners) for block in fast._blocks) <= MOST_CORNERS
    assert len(fast._older) <= BLOCKS * MOST_CORNERS


@given(
    st.lists(
        st.tuples(st.floats(0.0, 100.0), st.floats(-1.0, 1.0)),
        min_size=1,
        max_size=60,
        unique_by=lambda point: point[0],
    )
)
def test_no_point_lies_below_its_lower_hull(points):
    points.sort()
    corners = lower_hull(points)
    x, y = np.array(corners).T
    assert set(corners) <= set(points)
    for at, height in points:
        assert height >= np.interp(at, x, y) - 1e-9


@given(st.lists(st.floats(1e-6, 10.0), min_size=1, max_size=200), st.floats(0.01, 1.0))
def test_quantiles_of_delays_are_right_to_a_fifth(delays, share):
    counts = DelayCounts()
    counts.add(np.array(delays))
    true = sorted(delays)[max(0, int(np.ceil(share * len(delays))) - 1)]
    assert true * (1.0 - 1e-9) <= counts.quantile(share) <= 1.2 * true


def test_one_stamp_that_is_corrupted_moves_no_time_of_others():
    line, corrupted = (Line(2, seconds=30.0, batch=1) for _ in range(2))
    corrupted.stamps[2000] += 0.05

    def found(of):
        clock = HostClock()
        return np.concatenate([clock.host_times(stamps, arrival) for stamps, arrival, _ in of.pieces()])

    others = np.arange(len(line.stamps)) > 2010
    assert np.array_equal(found(corrupted)[others], found(line)[others])
