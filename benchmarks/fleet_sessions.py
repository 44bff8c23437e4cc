"""Simulated sessions as a job on two nodes, one of which is killed in mid-run; a plain loop is its peer.

A session is a robot that stands for three seconds, turns once and stands for two more, at 50 Hz: 500 samples
are simulated, calibrated, and held against their truth.
"""

from __future__ import annotations

import json
import random
import resource
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import tumble
from benchmarks.fleet_cluster import TwoNodes, two_nodes
from benchmarks.results import Content, machine
from tumble.fleet.driver import FleetRun
from tumble.fleet.inputs import FleetInput
from tumble.fleet.job import FleetJob
from tumble.fleet.ledger import JobStatus
from tumble.fleet.parts import part_tables, whole_table
from tumble.fleet.places import FileStore
from tumble.fleet.ray_engine import RayEngine
from tumble.fleet.task import computed_outcome
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.tools.simulate import Step, simulate_spin

FUNCTION = "benchmarks.fleet_sessions:session"
SESSIONS = 100_000
SAMPLE = 1000
"""Sessions that a plain loop computes again."""
RATE = 50.0
"""Hz."""
PLAN = (Step("rest", 3.0), Step("turn", turns=1.0), Step("rest", 2.0))
TURN_RATE = 2.0
"""rad/s."""
INTERVAL = 1.959964
"""Half a 95 % interval, in sigmas."""
EARLIEST, LATEST = 0.2, 0.8
"""Share of the sessions between which a node is killed."""


def session(seed: int) -> Mapping[str, Any]:
    """Simulates a robot that turns on the spot, calibrates it and returns its errors over their sigma."""
    made = simulate_spin(seed=seed, rate_hz=RATE, plan=PLAN, turn_rate=TURN_RATE)
    found = tumble.spin(made.recording, gravity=STANDARD_GRAVITY)
    errors = {
        "accelerometer": (found.accelerometer_bias, made.accelerometer_bias),
        "gyroscope": (found.gyroscope_bias, made.gyroscope_bias),
    }
    return {
        "verdict": found.verdict,
        **{
            triad: [float(each) for each in (bias.value - truth) / bias.sigma]
            for triad, (bias, truth) in errors.items()
            if bias.observable
        },
    }


def sessions(count: int, folder: Path, seed: int) -> Content:
    """Computes sessions on two nodes, of which one is killed at a moment drawn from `seed`.

    Raises `AssertionError` where a session is lost, doubled, or another than that of a plain loop.
    """
    draws = random.Random(seed)
    job = FleetJob.model_validate(
        {"procedure": FUNCTION, "seeds": {"count": count}, "results": str(folder / "sessions")}
    )
    with two_nodes() as nodes:
        kill = _NodeKill(nodes, draws.randrange(int(EARLIEST * count), int(LATEST * count)))
        status = FleetRun(job, partial(RayEngine, "", 2), "ray", show=kill).run()
    assert kill.done, "the job ended before a node was killed"
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    results = FileStore(job.results)
    table = whole_table(results)
    summaries = dict(zip(*(table.column(name).to_pylist() for name in ("place", "summary")), strict=True))
    _none_lost_or_doubled(status, table.column("place").to_pylist(), count)
    chosen = sorted(draws.sample(range(count), min(SAMPLE, count)))
    loop = _same_as_a_loop(job, chosen, summaries)
    found = [json.loads(each) for each in summaries.values()]
    return {
        "sessions": count,
        "failed": status.failed,
        "seconds": status.seconds,
        "a_second": count / status.seconds,
        "killed_at": kill.done,
        "tasks_lost": status.retried,
        "rows_written_twice": sum(each.num_rows for each in part_tables(results, ["key"])) - count,
        "driver_mib": memory,
        "results_mib": _size(folder) / 2**20,
        "compared": len(chosen),
        "loop_ms_a_session": 1e3 * loop / len(chosen),
        "verdicts": dict(Counter(each["verdict"] for each in found)),
        "coverage": {triad: _coverage(found, triad) for triad in ("accelerometer", "gyroscope")},
        "machine": machine(),
    }


class _NodeKill:
    """Progress of a job; kills a node once so many sessions are done, and adds another one."""

    def __init__(self, nodes: TwoNodes, after: int) -> None:
        self._nodes = nodes
        self._after = after
        self.done = 0
        """Sessions that were done by then."""

    def __call__(self, status: JobStatus) -> None:
        if not self.done and status.done >= self._after:
            self.done = status.done
            self._nodes.replace_second()


def _none_lost_or_doubled(status: JobStatus, places: Sequence[str], count: int) -> None:
    assert (status.done, status.failed) == (count, 0), status
    assert len(places) == count, f"{len(places)} rows of {count} sessions"
    assert set(map(int, places)) == set(range(count)), "a session is missing"


def _same_as_a_loop(job: FleetJob, seeds: Sequence[int], summaries: Mapping[str, str]) -> float:
    """Computes some sessions in this process and compares every bit; returns the time it took, s."""
    begun = time.perf_counter()
    expected = [computed_outcome(job, FleetInput(str(seed)), b"").summary for seed in seeds]
    seconds = time.perf_counter() - begun
    for seed, each in zip(seeds, expected, strict=True):
        assert summaries[str(seed)] == each, f"seed {seed}: another result than that of a plain loop"
    return seconds


def _coverage(found: Sequence[Mapping[str, Any]], triad: str) -> float:
    """Returns the share of 95 % intervals that hold the truth."""
    errors = np.array([each[triad] for each in found if triad in each])
    return float(np.mean(np.abs(errors) < INTERVAL))


def _size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*.parquet"))
