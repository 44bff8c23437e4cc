"""A table moves only while the browser of its operator gives signs of life."""

from __future__ import annotations

from contextlib import closing

import pytest

from live_benches import simulated_bench
from tumble.bench.access import BROWSER_GONE
from tumble.bench.bench import GRACE, Bench
from tumble.bench.settings import BenchSettings
from tumble.bench.sources import BenchSource
from tumble.foundation import clock
from tumble.foundation.ending import watched

BEAT = 0.5
"""s between two signs of life."""


@pytest.fixture
def units():
    with watched(), simulated_bench(seed=3, grades=("reference", "industrial")) as units:
        yield units


@pytest.fixture
def bench(tmp_path, units):
    with closing(Bench(BenchSettings(folder=tmp_path))) as bench:
        for name, address in units.addresses.items():
            bench.add_source(BenchSource(name, address))
        bench.change_table(address=units.table_address)
        yield bench


def begin(bench, units):
    """Begins a run; the browser of its operator gives signs of life until the table moves."""
    operator = bench.access.enter("", "")
    bench.access.beat(operator.key)
    bench.arm()
    bench.start()
    stands = angles(units)
    while angles(units) == stands:
        assert bench.engine.state == "running", bench.engine.trouble
        bench.access.beat(operator.key)
        bench.pulse = clock.now()
        clock.sleep(BEAT)


def angles(units):
    return list(units.table.position())


def test_a_table_whose_operator_is_gone_stands_still(bench, units):
    begin(bench, units)
    clock.sleep(BROWSER_GONE + GRACE + 2.0)
    assert bench.engine.state == "paused"
    assert "browser was gone" in str(bench.engine.trouble)
    stopped = angles(units)
    clock.sleep(20.0)
    assert angles(units) == stopped
