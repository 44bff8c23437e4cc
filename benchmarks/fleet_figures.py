"""Cost of a fleet beside a plain loop, gain of a second worker, memory of the driver, and a model of cost."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import tumble
from benchmarks.memory import peak_here
from benchmarks.results import Content, machine
from tumble.fleet.driver import FleetRun
from tumble.fleet.inputs import FleetInput, InputList
from tumble.fleet.job import FleetJob
from tumble.fleet.local_engine import LocalEngine
from tumble.fleet.task import computed_outcome
from tumble.foundation.recording import Chunk
from tumble.logs import open_recording
from tumble.tools.simulate import Step, simulate_spin, write_spin
from tumble.tools.simulate.files import LogFormat

LARGEST_OVERHEAD = 1.05
"""Time of a job with one worker over that of a plain loop."""
LEAST_GAIN = 1.9
"""Speed of two workers over that of one."""
LARGEST_GROWTH = 1.10
"""Memory of the driver of the largest job over that of one of a thousand inputs."""
FEWEST = 1000
MOST = 100_000
LOGS = 500
MADE = 8
"""Logs that differ; the others are links to them."""
A_MILLION = 1_000_000
RATE = 100.0
"""Hz."""
TEN_MINUTES = (
    *(Step("rest", 6.0), Step("turn", turns=3.0), Step("turn", turns=-3.0)),
    *(Step("drive", 550.0), Step("rest", 6.0)),
)
FORMATS: tuple[LogFormat, ...] = ("csv", "parquet", "mcap")
REPEATS = 3


def nothing(seed: int) -> Mapping[str, Any]:
    """Computes next to nothing, so that only the driver's work is left."""
    return {"seed": seed}


def figures(logs: int, most: int) -> Content:
    """Measures all figures; each is held against its peer in the same run."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        job = _logs(logs, folder / "logs")
        rounds = [
            (_looped(job), _ran(job, 1, folder / "one"), _ran(job, 2, folder / "two")) for _ in range(2)
        ]
        loop, one, two = (min(times) for times in zip(*rounds, strict=True))
        return {
            "logs": logs,
            "loop": loop,
            "one_worker": one,
            "two_workers": two,
            "memory": {str(inputs): _memory_of_driver(inputs) for inputs in (FEWEST, most)},
            "cost": {each: _cost(each, folder) for each in FORMATS},
            "machine": machine(),
        }


def _logs(count: int, folder: Path) -> FleetJob:
    """Writes logs of robots; returns a job over them."""
    folder.mkdir(parents=True)
    for seed in range(MADE):
        write_spin(simulate_spin(seed=seed), folder / f"made-{seed}")
    for number in range(count):
        (folder / f"{number:06d}.csv").symlink_to(folder / f"made-{number % MADE}" / "spin.csv")
    content = {"procedure": "spin", "inputs": f"{folder}/*.csv", "results": str(folder / "results")}
    return FleetJob.model_validate(content)


def _looped(job: FleetJob) -> float:
    """Times a plain loop over the inputs in this process, s."""
    inputs = list(InputList(job))
    computed_outcome(job, inputs[0], b"")
    begun = time.perf_counter()
    for each in inputs:
        computed_outcome(job, each, b"")
    return time.perf_counter() - begun


def _ran(job: FleetJob, workers: int, results: Path) -> float:
    """Runs a job, whose workers have imported all as those of a long job have; returns its time, s."""
    shutil.rmtree(results, ignore_errors=True)
    engine = LocalEngine(workers)
    for _ in range(workers):
        engine.add_worker()
    time.sleep(2.0)
    first = job.model_copy(update={"results": str(results)})
    begun = time.perf_counter()
    FleetRun(first, lambda: engine, "local").run()
    return time.perf_counter() - begun


def _memory_of_driver(inputs: int) -> float:
    """Returns the largest resident memory of a driver of so many inputs, MiB, in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.fleet", "drive", str(inputs)]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return float(printed.split()[-1])


def drive(inputs: int) -> float:
    """Runs a job of so many empty inputs; returns the memory that this process took, MiB."""
    with tempfile.TemporaryDirectory() as folder:
        job = FleetJob.model_validate(
            {"procedure": "benchmarks.fleet_figures:nothing", "seeds": {"count": inputs}, "results": folder}
        )
        FleetRun(job, lambda: LocalEngine(1), "local").run()
    return peak_here() / 2**20


def _cost(log_format: LogFormat, folder: Path) -> Content:
    """Measures bytes, one decoding and the fit of a log of ten minutes; returns those of a million."""
    made = simulate_spin(seed=0, rate_hz=RATE, plan=TEN_MINUTES)
    path = write_spin(made, folder / log_format, log_format)["log"]
    job = FleetJob.model_validate({"procedure": "spin", "inputs": str(path), "results": str(folder)})
    given = FleetInput(str(path))
    passes = _passes(path)
    whole = _least(lambda: computed_outcome(job, given, b""))
    decode = _least(lambda: sum(len(chunk) for chunk in open_recording(path).chunks()))
    fit = _least(lambda: tumble.spin(made.recording))
    hours = A_MILLION / 3600.0
    return {
        "terabytes": A_MILLION * path.stat().st_size / 1e12,
        "core_hours": whole * hours,
        "passes": passes,
        "decode": decode * hours,
        "fit": fit * hours,
        "megabytes_a_second_and_core": path.stat().st_size / whole / 1e6,
    }


def _passes(path: Path) -> int:
    """Returns the number of times that the procedure decodes a log."""
    log, passes = open_recording(path), 0

    def counted() -> Iterator[Chunk]:
        nonlocal passes
        passes += 1
        return log.open()

    tumble.spin(replace(log, open=counted))
    return passes


def _least(work: Callable[[], object]) -> float:
    """Returns the least processor time of some repeats, s."""

    def times() -> Iterator[float]:
        for _ in range(REPEATS):
            begun = time.process_time()
            work()
            yield time.process_time() - begun

    work()
    return min(times())
