"""A page leads through a session on a table, stops it, goes on, and gives what the command gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from live_benches import simulated_bench
from tumble.tools.guided.order import RunOrder, TableOrder
from tumble.tools.guided.run import run_kind
from turntable_sessions import typed

ROLES = {"reference": "reference", "target_1": "target", "target_2": "target"}


@pytest.fixture
def order(tmp_path):
    """A session of two targets on a table that waits for it."""
    with simulated_bench(seed=44) as bench:
        yield RunOrder(
            folder=tmp_path / "run",
            sources=bench.addresses,
            roles=ROLES,
            serials={"target_1": "0815"},
            options={"pose_seconds": 3.0, "turns": False, "until": "bias 0.05"},
            table=TableOrder(address=bench.table_address, armed=True),
        )


def test_stopped_session_goes_on_and_equals_the_command(order, tmp_path):
    first = run_kind("turntable").begin(order)
    held = []
    for view in first.views():
        held += [view.subject] if view.kind == "held" else []
        if len(held) == 2:
            first.stop()
    assert len(held) >= 2
    second = run_kind("turntable").begin(replace(order, resume=True))
    views = list(second.views())
    assert views[-1].kind == "done"
    assert any(item.done for group in views[0].checks for item in group.items)
    assert all(item.done for group in views[-1].checks for item in group.items)
    (body,) = views[-1].bodies
    assert np.linalg.norm(body.up_now) == pytest.approx(1.0)
    assert {lamp.name for lamp in views[-1].lamps} == set(ROLES)

    outcome = second.outcome()
    assert outcome.complete
    assert [(unit.name, unit.serial, unit.verdict) for unit in outcome.units] == [
        ("target_1", "0815", "passed"),
        ("target_2", "", "passed"),
    ]
    done = typed("turntable", order.folder / "session", "-o", tmp_path / "command")
    assert done.code == 0, done.err
    for unit in outcome.units:
        for path in (unit.calibration, unit.page):
            assert path.read_bytes() == (tmp_path / "command" / path.name).read_bytes(), path.name
