"""Rows that came late are sorted within a window; a wrong time is not."""

from __future__ import annotations

import numpy as np
import pytest

from log_fixtures import join, made_up, read, real, refusal, same, write
from tumble.foundation.recording import Chunk
from tumble.logs import open_recording
from tumble.logs.row_order import LARGEST_DISPLACEMENT
from turntable_sessions import typed


def parts(chunk):
    return [chunk.time, chunk.accelerometer, chunk.gyroscope, chunk.temperature]


def shuffled(chunk, places, seed):
    """The chunk with its rows as datagrams bring them: each up to so many places late."""
    random = np.random.default_rng(seed)
    arrival = np.argsort(
        np.arange(len(chunk)) + random.uniform(0.0, places + 0.99, len(chunk)), kind="stable"
    )
    return in_order(chunk, arrival)


def in_order(chunk, order):
    return Chunk(*[None if part is None else part[order] for part in parts(chunk)])


def reordering(path):
    stream = open_recording(path).chunks()
    for _ in stream:
        pass
    return stream.counts.reordering


@pytest.mark.parametrize("name", ["log.csv", "log.parquet"])
@pytest.mark.parametrize("places", [1, 3, 40])
def test_late_rows_read_as_the_sorted_log_reads(tmp_path, name, places):
    chunk = made_up(90_000)
    path = write(tmp_path / name, shuffled(chunk, places, seed=places))
    assert same(read(path), read(write(tmp_path / f"sorted-{name}", chunk)))


def test_a_remark_counts_the_moved_rows_and_their_distance(tmp_path):
    chunk = made_up(500, temperature=False)
    order = np.arange(500)
    order[100:104] = [101, 102, 103, 100]
    found = reordering(write(tmp_path / "log.parquet", in_order(chunk, order)))
    assert (found.rows, found.places) == (4, 3)
    assert found.late == pytest.approx(3 / 200.0)
    assert "4 rows stood up to 3 places" in found.phrase()


def test_a_row_is_sorted_within_the_window_and_not_beyond(tmp_path):
    chunk = made_up(100_000, temperature=False)
    for distance in (LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT + 1):
        order = np.insert(np.delete(np.arange(100_000), 50_000), 50_000 + distance, 50_000)
        path = write(tmp_path / f"{distance}.parquet", in_order(chunk, order))
        if distance == LARGEST_DISPLACEMENT:
            assert same(read(path), chunk)
        else:
            assert "time runs backwards by 5.125 s" in refusal(path)


def test_two_recordings_in_one_file_are_not_interleaved(tmp_path):
    one, two = made_up(400, temperature=False), made_up(400, start=0.0021, temperature=False)
    both = Chunk(
        *[np.concatenate(pair) for pair in zip(parts(one)[:3], parts(two)[:3], strict=True)],
    )
    line = refusal(write(tmp_path / "log.parquet", both))
    assert "row 401" in line
    assert "recordings were joined; cut the log there" in line
    assert "--rate" not in line


@pytest.mark.parametrize("late", [1, 15, 300])
def test_samples_that_came_by_two_ways_count_once(tmp_path, late):
    chunk = made_up(3000, temperature=False)
    order = np.argsort(np.concatenate([np.arange(3000), np.arange(3000) + late + 0.5]), kind="stable") % 3000
    recording = open_recording(write(tmp_path / "log.parquet", in_order(chunk, order)))
    stream = recording.chunks()
    assert same(join(list(stream)), chunk)
    assert "left out 3000 samples with the time stamp of the one before" in stream.counts.notices()


def test_late_samples_that_differ_are_not_taken_for_copies(tmp_path):
    chunk = made_up(3000, temperature=False)
    order = np.argsort(np.concatenate([np.arange(3000), np.arange(3000) + 15.5]), kind="stable") % 3000
    both = in_order(chunk, order)
    changed = Chunk(both.time, both.accelerometer + 1e-6 * (np.arange(6000) % 7)[:, None], both.gyroscope)
    assert "1024 rows" in refusal(write(tmp_path / "log.parquet", changed))


def test_held_rows_are_few_however_long_the_log(tmp_path):
    path = write(tmp_path / "log.parquet", shuffled(made_up(400_000, temperature=False), 5, seed=1))
    longest = max(len(chunk) for chunk in open_recording(path).chunks())
    assert longest < 70_000


def test_an_ordered_log_keeps_its_chunks(tmp_path):
    path = write(tmp_path / "log.parquet", made_up(140_000))
    recording = open_recording(path)
    assert reordering(path).rows == 0
    assert len({len(chunk) for chunk in recording.chunks()}) <= 2


def test_the_spin_of_a_shuffled_log_gives_all_figures(tmp_path):
    log = real("cases/out_of_order/spin.csv.gz")
    done = typed("spin", log, "--gyroscope-unit", "rad/s", "-o", tmp_path)
    assert done.code == 0
    assert "842 rows stood up to 3 places" in " ".join((done.out + done.err).split())
