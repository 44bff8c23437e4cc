"""Robots whose gyroscope is so coarse that it shows one value while they turn evenly."""

from __future__ import annotations

import json

import numpy as np
import pytest

from repetitions import repetitions
from spin_sessions import record, still, turn
from tumble.foundation.results import INTERVAL
from turntable_sessions import one_line, typed

SEED = 7_300
RUNS = repetitions(48)
STEPS = np.geomspace(0.01, 1.0, RUNS)
"""deg/s."""
WAYS = {
    "one way": (still(), turn(3), still()),
    "both ways": (still(), turn(3), still(3), turn(-3), still()),
}


def coarse(moves, seed, step, noise):
    """A session whose gyroscope reads in steps, deg/s; noise is a share of a step.

    Its bias lies away from the edge of a step, where a rest that flickers is taken for motion.
    """
    size = np.radians(step)
    random = np.random.default_rng([SEED, seed])
    bias = size * (np.round(random.normal(0.0, 0.02, 3) / size) + random.uniform(-0.3, 0.3, 3))
    session = record(moves, seed, gyroscope_noise=noise * size, gyroscope_bias=tuple(bias))
    session.gyroscope[:] = size * np.round(session.gyroscope / size)
    return session


@pytest.mark.parametrize("moves", WAYS.values(), ids=WAYS)
@pytest.mark.parametrize("noise", [0.02, 0.2], ids=["one value", "few values"])
def test_no_even_turn_of_a_coarse_gyroscope_is_the_end_of_its_range(tmp_path, moves, noise):
    off = []
    for seed, step in enumerate(STEPS, start=SEED):
        session = coarse(moves, seed, step, noise)
        log = session.write(tmp_path / f"robot{seed}.csv")
        done = typed("spin", log, "-o", tmp_path / "out", "--json")
        assert done.code == 0, f"{step:.3g} deg/s: {done.err}"
        assert "saturated" not in done.out
        found = json.loads(done.out)
        for triad in ("accelerometer", "gyroscope"):
            bias = found[f"{triad}_bias"]
            truth = np.array(getattr(session.robot, f"{triad}_bias"))
            off.append(np.abs(np.array(bias["value"]) - truth) / bias["sigma"])
    found_off = np.array(off)
    fewest = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / found_off.size)
    assert (found_off <= INTERVAL).mean() > fewest
    assert found_off.max() < 6.0


@pytest.mark.parametrize("noise", [0.02, 2.0], ids=["quiet", "noisy"])
def test_a_gyroscope_that_ends_below_the_turn_is_saturated(tmp_path, noise):
    session = coarse((still(), turn(3, rate=2.5), still()), SEED, 0.25, noise)
    end = np.radians(125.0)
    session.gyroscope[:] = np.clip(session.gyroscope, -end, end)
    log = session.write(tmp_path / "robot.csv")
    done = typed("spin", log, "-o", tmp_path / "out")
    assert done.code == 2
    assert "gyroscope z is saturated at 2.182 rad/s" in one_line(done.err)
