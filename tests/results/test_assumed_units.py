"""Values in a unit that nothing shows are no success, in every procedure that a still log suits."""

from __future__ import annotations

import numpy as np
import pytest

from turntable_sessions import typed

SEED = 4
RATE_HZ = 10.0
HEAD = "time,ax,ay,az,{},temperature"


@pytest.fixture(scope="module")
def rows():
    """An hour of a unit that lies still in a box that warms and cools, as lines."""
    print(f"seed {SEED}")
    draws = np.random.default_rng(SEED)
    time = np.arange(int(3600 * RATE_HZ)) / RATE_HZ
    warmth = 40.0 - 20.0 * np.cos(2.0 * np.pi * time / time[-1])
    force = (
        np.array([0.1, 0.2, 9.8]) + 1e-3 * (warmth[:, None] - 25.0) + draws.normal(0.0, 0.02, (len(time), 3))
    )
    rate = 0.02 + 1e-4 * (warmth[:, None] - 25.0) + draws.normal(0.0, 0.003, (len(time), 3))
    table = np.column_stack([time, force, rate, warmth])
    form = ",".join(["%.3f", *["%.6f"] * 3, *["%.7f"] * 3, "%.4f"])
    return [form % tuple(row) for row in table.tolist()]


def run(folder, rows, procedure, names, *options):
    log = folder / "still.csv"
    log.write_text("\n".join([HEAD.format(names), *rows, ""]))
    return typed(procedure, log, "-o", folder / "out", *options)


@pytest.mark.parametrize("procedure", ["thermal", "noise"])
def test_an_assumed_unit_is_no_success_and_is_named(tmp_path, rows, procedure):
    done = run(tmp_path, rows, procedure, "gx,gy,gz")
    assert done.code == 3
    assert "state it with --gyroscope-unit" in " ".join((done.out + done.err).split())


@pytest.mark.parametrize(
    ("names", "options"),
    [("gx [rad/s],gy [rad/s],gz [rad/s]", ()), ("gx,gy,gz", ("--gyroscope-unit", "rad/s"))],
)
def test_a_stated_unit_is_a_success(tmp_path, rows, names, options):
    done = run(tmp_path, rows, "thermal", names, *options)
    assert done.code == 0, done.out
