"""A driver that is killed between any two operations on files loses, doubles and half-writes nothing."""

from __future__ import annotations

import random

import pytest

from fleet_jobs import SerialEngine, function_job, run_job, values_of
from killed_operations import killed_at
from repetitions import SOAK, drawn_seed
from tumble.fleet.ledger import KIND
from tumble.fleet.places import FileStore

SEEDS = (0, 9)
"""Inputs of two tasks and a part of one."""
KILLS = 400 if SOAK else 3
MOST_OPERATIONS = 80
"""Operations beyond those of a whole run, so that some draws kill nothing."""


@pytest.mark.parametrize("kind", ["", "file://"])
def test_a_killed_write_leaves_what_was_there(tmp_path, kind):
    store = FileStore(f"{kind}{tmp_path}")
    before, after = (
        b'{"written by": "tumble fleet", "state": "%s"}' % state for state in (b"before", b"after")
    )
    number = 1
    while True:
        store.write("part", before, KIND)
        was_killed = killed_at(lambda: store.write("part", after, KIND), number)
        assert store.read("part") in ((before, after) if was_killed else (after,))
        if not was_killed:
            break
        number += 1
    assert number > 3


def test_a_killed_driver_leaves_whole_results_that_go_on(tmp_path):
    chance = random.Random(drawn_seed())
    whole = function_job(tmp_path / "whole", seeds=SEEDS)
    run_job(whole, SerialEngine())
    expected = values_of(whole)
    kills = KILLS
    while kills > 0:
        job = function_job(tmp_path / f"killed-{kills}", seeds=SEEDS)
        while killed_at(lambda job=job: run_job(job, SerialEngine(), resume=True), drawn(chance)):
            kills -= 1
            found = values_of(job)
            assert set(found) <= set(expected)
            assert len(found) == len(set(found))
        assert values_of(job) == expected
        kills -= 1


def drawn(chance):
    """Number of the operation before which a driver is killed: early ones write the job, late ones parts."""
    return chance.randrange(1, chance.choice((20, MOST_OPERATIONS)))
