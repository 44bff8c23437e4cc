"""A simulated bench over real sockets, whose time is simulated too."""

from __future__ import annotations

from contextlib import contextmanager

import pytest

from simulated_clock import SimulatedClock
from tumble.tools.record import writer
from tumble.tools.simulate import LiveSimulation
from tumble.tools.simulate.live import procedure

QUICK_BENCH = {
    "motion": "table",
    "rate_hz": 50.0,
    "grades": ("reference", "tactical", "tactical"),
    "port": 0,
    "table_port": 0,
}
"""Few samples, for sessions of minutes."""
TICK = 0.1
"""s between two rounds in which it sends: each takes as long as many samples."""
FLUSH = 10.0
"""s between two writings to the disk, which takes its time; less where a session is killed."""


@contextmanager
def simulated_bench(late=0.0, work=0.5, later=0.0, flush=FLUSH, **changes):
    """Serves a bench to whatever runs in the block, by a simulated clock, its `clock`."""
    seed = changes.get("seed", 1)
    print(f"seed {seed}")
    with pytest.MonkeyPatch.context() as patch, SimulatedClock(seed, late, work, later) as simulated:
        patch.setattr(procedure, "TICK", TICK)
        patch.setattr(writer, "FLUSH_EVERY", flush)
        with LiveSimulation(**{**QUICK_BENCH, **changes}) as bench:
            bench.clock = simulated
            yield bench


def words_of(bench):
    """Units of a bench as they are typed."""
    return [f"{name}={address}" for name, address in bench.addresses.items()]
