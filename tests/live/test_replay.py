"""A log replayed as if it were recorded just now."""

from __future__ import annotations

import numpy as np
import pytest

from live_fixtures import chunks_of, resting, samples_of, text_lines
from tumble.foundation import clock
from tumble.live import open_source
from tumble.logs import ReadOptions

TABLE = resting(150)


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "drive.csv"
    path.write_bytes(text_lines(TABLE))
    return path


def test_every_sample_is_replayed_whatever_the_speed(log, simulated_clock):
    for speed in ("max", "1", "0.5", "50"):
        assert np.array_equal(samples_of(open_source(f"replay:{log}?speed={speed}")), TABLE)


def test_no_time_passes_at_full_speed(log, simulated_clock):
    began = clock.now()
    assert len(chunks_of(open_source(f"replay:{log}?speed=max"))) > 1
    assert clock.now() == began


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_a_log_takes_its_own_time_at_its_own_pace(log, simulated_clock, speed):
    began = clock.now()
    with open_source(f"replay:{log}?speed={speed}") as source:
        seen = [(clock.now() - began, chunk.time[-1]) for chunk in source if len(chunk)]
    assert all(latest <= now * speed + 1e-9 for now, latest in seen)
    assert clock.now() - began == pytest.approx(TABLE[-1, 0] / speed, abs=0.01)


def test_a_log_is_asked_for_what_is_due_and_says_when_it_is_over(log, simulated_clock):
    with open_source(f"replay:{log}") as source:
        assert source.fileno() is None
        assert source.read().time.tolist() == TABLE[:1, 0].tolist()
        assert len(source.read()) == 0
        clock.sleep(TABLE[-1, 0] + 1e-6)
        assert source.read().time.tolist() == TABLE[1:, 0].tolist()
        with pytest.raises(EOFError):
            source.read()


def test_samples_are_paced_unless_a_log_is_read_at_full_speed(log, simulated_clock):
    arrivals = [chunk.arrival for chunk in chunks_of(open_source(f"replay:{log}"))]
    assert arrivals == sorted(arrivals)
    assert {chunk.arrival for chunk in chunks_of(open_source(f"replay:{log}?speed=max"))} == {None}


def test_a_gap_in_a_log_is_a_silence(tmp_path, simulated_clock):
    table = TABLE.copy()
    table[50:, 0] += 3.0
    path = tmp_path / "gap.csv"
    path.write_bytes(text_lines(table))
    with open_source(f"replay:{path}") as source:
        sizes = [len(chunk) for chunk in source]
    assert sizes.count(0) > 20
    assert sum(sizes) == len(table)


def test_name_and_reading_options_are_those_of_logs(log):
    source = open_source(f"replay:{log}?speed=max", ReadOptions(gyroscope_unit="deg/s"))
    assert source.name == "drive"
    assert not source.gyroscope_unit_is_assumed
    assert np.allclose(samples_of(source)[:, 4:], np.radians(TABLE[:, 4:]))
    assert open_source(f"replay:{log}?speed=max").gyroscope_unit_is_assumed
