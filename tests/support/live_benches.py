"""A simulated bench over real sockets that waits for its reader, so that no test depends on a clock."""

from __future__ import annotations

import math
import time
from contextlib import contextmanager

import numpy as np
import yaml

from tumble.live import multi_source
from tumble.procedures.turntable import live
from tumble.tools.record import live_procedure
from tumble.tools.simulate import LiveSimulation
from tumble.tools.table import guarded, text
from tumble.tools.table.profile import load_profile

LEAD = 0.5
"""s that the bench is ahead of what was looked at."""
QUICK_BENCH = {
    "motion": "table",
    "rate_hz": 50.0,
    "grades": ("reference", "tactical", "tactical"),
    "port": 0,
    "table_port": 0,
    "clock_offset_seconds": 0.0,
    "clock_skew_ppm": 0.0,
    "delay_seconds": 0.0,
    "jitter_seconds": 0.0,
}


ANSWERS_WITHIN = 60.0
"""s of ours that the table may take on a busy computer."""


def patient_profile(name):
    """Returns a profile of a table that may take its time."""
    profile = load_profile(name)
    return profile.model_copy(update={"line": profile.line.model_copy(update={"timeout": ANSWERS_WITHIN})})


def patient_table(folder):
    """Writes the profile of such a table, for programs in their own processes; returns its path."""
    path = folder / "table.yaml"
    path.write_text(yaml.safe_dump(patient_profile("scpi").content()))
    return str(path)


class SensorClock:
    """In place of `HostClock`: units of such a bench share a clock, and that of the computer is none."""

    remark = ""

    def __init__(self, *, stamped):
        assert stamped

    def host_times(self, stamps, arrival):
        return np.array(stamps)


class WaitingBench(LiveSimulation):
    """Time goes on at real pace until somebody listens, then only as fast as that is looked at."""

    def __init__(self, **changes):
        self._time, self._before, self._allowed = 0.0, time.monotonic(), math.inf
        super().__init__(**{**QUICK_BENCH, **changes})

    def now(self):
        wall = time.monotonic()
        if math.isinf(self._allowed):
            self._time += wall - self._before
        else:
            self._time = max(self._time, self._allowed)
        self._before = wall
        return self._time

    def allow(self, stamp):
        """Continues until a little after a stamp of a sensor; at real pace where none was seen."""
        seen = math.isfinite(stamp)
        self._allowed = stamp - self.scenario.uptime + LEAD if seen else math.inf


@contextmanager
def waiting_bench(monkeypatch, procedure=live.LiveTurntable, **changes):
    """Serves a bench that waits for whoever runs a live session of a procedure on it."""
    print(f"seed {changes.get('seed', 1)}")
    with WaitingBench(**changes) as bench, monkeypatch.context() as patch:
        watched = procedure._watched

        def watched_and_allowed(session, step):
            yield from watched(session, step)
            bench.allow(session._time)

        patch.setattr(procedure, "_watched", watched_and_allowed)
        patch.setattr(live_procedure, "BETWEEN_REPORTS", 0.01)
        patch.setattr(multi_source, "HostClock", SensorClock)
        patch.setattr(text, "load_profile", patient_profile)
        patch.setattr(guarded, "AT_LEAST", ANSWERS_WITHIN)
        yield bench


def words_of(bench):
    """Units of a bench as they are typed."""
    return [f"{name}={address}" for name, address in bench.addresses.items()]
