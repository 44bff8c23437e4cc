"""Workers, nodes and drivers of a job are killed at random moments, and its store fails now and then.

The job is given again after each death of its driver, as a supervisor would, until all is computed. Then its
results are held against those of a plain loop, and the next job begins, until enough was killed.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import yaml

from benchmarks.fleet_cluster import TwoNodes
from benchmarks.fleet_sessions import FUNCTION
from benchmarks.results import Content, machine
from tumble.cli.exit_code import ExitCode
from tumble.fleet.inputs import FleetInput
from tumble.fleet.job import FleetJob
from tumble.fleet.parts import part_tables, whole_table
from tumble.fleet.places import FileStore
from tumble.fleet.task import computed_outcome

KILLS = 100
MINUTES = 20.0
SHARE_FAILED = 0.02
"""Share of the calls that the store fails."""
SESSIONS = 2000
TASK_SECONDS = 0.5
LONGEST_PAUSE = 3.0
"""s at most from when a worker computes to a kill."""
LOOK = 0.1
"""s between two looks at the processes."""
KINDS = ("worker", "node", "driver")
MOST_STARTS = 200
"""Starts of a driver of one job; a job that needs more does not end."""


def kills(minutes: float, most: int, folder: Path, seed: int) -> Content:
    """Runs jobs while something is killed every few seconds, for so long or so often.

    Raises `AssertionError` where an input is lost, doubled, or another than that of a plain loop.
    """
    from benchmarks.fleet_store import BUCKET, busy_store  # a server of S3 takes a second to import

    draws = random.Random(seed)
    until = time.monotonic() + 60.0 * minutes
    job = _job("")
    expected = {
        str(seed): computed_outcome(job, FleetInput(str(seed)), b"").summary for seed in range(SESSIONS)
    }
    killed: Counter[str] = Counter()
    jobs = ended_by_store = rows_twice = 0
    with busy_store(SHARE_FAILED, seed) as store:
        nodes = TwoNodes()
        try:
            while time.monotonic() < until and killed.total() < most:
                job = _job(f"s3://{BUCKET}/results-{jobs}")
                run = _Run(job, folder, nodes, draws)
                while not run.is_done():
                    time.sleep(LOOK)
                    # A driver that is killed before it gave any work would prove little.
                    if time.monotonic() < until and killed.total() < most and nodes.workers():
                        killed.update(run.kill())
                rows_twice += _checked(job, expected)
                ended_by_store += run.ended_by_store
                jobs += 1
        finally:
            nodes.close()
    return {
        "jobs": jobs,
        "sessions": jobs * SESSIONS,
        "killed": {kind: killed[kind] for kind in KINDS},
        "kills": killed.total(),
        "store_calls": store.calls,
        "store_failed": store.failed,
        "drivers_ended_by_store": ended_by_store,
        "rows_written_twice": rows_twice,
        "machine": machine(),
    }


def _job(results: str) -> FleetJob:
    return FleetJob.model_validate(
        {
            "procedure": FUNCTION,
            "seeds": {"count": SESSIONS},
            "results": results,
            "reduce": [],
            "task_seconds": TASK_SECONDS,
        }
    )


class _Run:
    """A job whose driver is started again until all is computed."""

    def __init__(self, job: FleetJob, folder: Path, nodes: TwoNodes, draws: random.Random) -> None:
        self._nodes = nodes
        self._draws = draws
        self._file = folder / "job.yaml"
        self._file.write_text(yaml.safe_dump(job.content()))
        self._starts = 0
        self.ended_by_store = 0
        self._driver = self._started()

    def is_done(self) -> bool:
        """Starts the driver again where it ended early; returns whether all is computed."""
        code = self._driver.poll()
        if code is None:
            return False
        if code in (ExitCode.DONE, ExitCode.NOT_ALL_WELL):
            # An input that lost three workers by chance is computed by another run.
            if self._starts > 1 or code == ExitCode.DONE:
                return True
        elif code == ExitCode.USER_ERROR:
            self.ended_by_store += 1
        else:
            assert code == -signal.SIGKILL, f"the driver ended with exit code {code}"
        self._driver = self._started()
        return False

    def kill(self) -> list[str]:
        """Kills a worker, a node or the driver after a while; returns which, if it was still there."""
        time.sleep(self._draws.uniform(0.0, LONGEST_PAUSE))
        kind = self._draws.choice(KINDS)
        if kind == "node":
            self._nodes.replace_second()
        elif kind == "worker":
            if not (workers := self._nodes.workers()):
                return []
            self._draws.choice(workers).kill()
        elif self._driver.poll() is None:
            self._driver.kill()
            self._driver.wait()
        else:
            return []
        return [kind]

    def _started(self) -> subprocess.Popen[bytes]:
        self._starts += 1
        assert self._starts < MOST_STARTS, "the job does not end"
        command = [sys.executable, "-m", "tumble", "fleet", "run", str(self._file), "--resume", "--quiet"]
        command += ["--engine", f"ray:{self._nodes.address}"]
        return subprocess.Popen(command, env=os.environ, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _checked(job: FleetJob, expected: Mapping[str, str]) -> int:
    """Compares results with those of a plain loop; returns the number of rows that were written twice."""
    results = FileStore(job.results)
    table = whole_table(results)
    places, found = (table.column(name).to_pylist() for name in ("place", "summary"))
    assert len(places) == len(expected), f"{len(places)} rows of {len(expected)} sessions"
    assert dict(zip(places, found, strict=True)) == expected, "another result than that of a plain loop"
    written = sum(int(each.num_rows) for each in part_tables(results, ["key"]))
    return written - len(expected)
