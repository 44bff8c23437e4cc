"""Recorded flights are listed by reference, and rates of verdicts have the interval of a Poisson process."""

import re

import numpy as np
import pytest
from benchmarks.flights import logs as flight_logs
from benchmarks.flights.body import fly
from benchmarks.flights.logs import interval, is_here, listed, place
from benchmarks.flights.units import Shaking, digitised, draw_unit, read


def test_every_log_is_listed_once_with_commit_and_checksum():
    rows = listed()
    assert len({row["sha256"] for row in rows}) == len(rows)
    for row in rows:
        assert re.fullmatch(r"[0-9a-f]{40}", row["commit"])
        assert re.fullmatch(r"[0-9a-f]{64}", row["sha256"])
        assert len(row["imus"]) >= 2
        assert (row["verdicts"] == 0) == ("why" not in row)


def test_a_log_of_another_version_is_left_out(tmp_path):
    row = listed()[0]
    assert not is_here(tmp_path, row)
    path = place(tmp_path, row)
    path.parent.mkdir(parents=True)
    path.write_bytes(b"another")
    assert not is_here(tmp_path, row)


@pytest.mark.parametrize(
    ("count", "hours", "expected"),
    [(0, 1.0, (0.0, 3.689)), (3, 1.0, (0.619, 8.767)), (3, 2.0, (0.309, 4.384))],
)
def test_a_rate_has_the_exact_interval_of_its_count(count, hours, expected):
    assert interval(count, hours) == pytest.approx(expected, abs=1e-3)


def test_a_unit_that_dies_in_a_log_of_two_is_named():
    print("seed 21")
    random = np.random.default_rng(21)
    body = fly(random, np.array([[8.0, 40.0]]), 50.0, 0.05)
    units = [draw_unit(random, 100.0, 0) for _ in range(2)]
    samples = [digitised(read(random, unit, body, Shaking((), 0.0), 0.0), unit) for unit in units]
    found = flight_logs.faulted(samples, "dead", 1, (0, 0))
    assert (found["outcome"], found["units"]) == ("right", 2)
    assert found["isolated"] < 0.2
