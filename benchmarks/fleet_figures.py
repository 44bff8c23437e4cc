"""Fleets: cost beside a plain loop, gain of a second worker, memory of the driver, and a model of cost.

`python -m benchmarks.fleet [--logs 400] [--most 100000] [--sessions 0]`

All figures of a table are of one run, and each is held against its peer in it. `--sessions N` also computes
so many simulated sessions on two nodes of Ray, one of which is removed in mid-run.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.results import Content, machine, save
from tumble.fleet.driver import FleetRun
from tumble.fleet.engine import FleetEngine
from tumble.fleet.inputs import InputList
from tumble.fleet.job import FleetJob
from tumble.fleet.ledger import JobStatus
from tumble.fleet.local_engine import LocalEngine
from tumble.fleet.task import computed_outcome
from tumble.tools.simulate.spin.files import write_spin
from tumble.tools.simulate.spin.procedure import simulate_spin

LARGEST_OVERHEAD = 1.05
"""Time of a job with one worker over that of a plain loop."""
LEAST_GAIN = 1.9
"""Speed of two workers over that of one."""
LARGEST_GROWTH = 1.10
"""Memory of the driver of the largest job over that of one of a thousand inputs."""
FEWEST = 1000
A_MILLION = 1_000_000
LOG_SECONDS = 600.0
"""Length of a log of the model of cost, s."""


def nothing(seed: int) -> Mapping[str, Any]:
    """Computes next to nothing, so that only the driver's work is left."""
    return {"seed": seed}


def logs(count: int, folder: Path) -> FleetJob:
    """Writes logs of robots, eight in all and the rest links to them; returns a job over them."""
    folder.mkdir(parents=True)
    for seed in range(8):
        write_spin(simulate_spin(seed=seed), folder / f"made-{seed}")
    for number in range(count):
        (folder / f"{number:06d}.csv").symlink_to(folder / f"made-{number % 8}" / "spin.csv")
    content = {"procedure": "spin", "inputs": f"{folder}/*.csv", "results": str(folder / "results")}
    return FleetJob.model_validate(content)


def looped(job: FleetJob) -> float:
    """Times a plain loop over the inputs, s."""
    inputs = InputList(job)
    work = job.work
    for each in inputs:
        computed_outcome(job, each, each.key(work))
        break
    begun = time.perf_counter()
    for each in inputs:
        computed_outcome(job, each, each.key(work))
    return time.perf_counter() - begun


def ran(job: FleetJob, workers: int, results: Path) -> JobStatus:
    """Runs a job; its workers have started before, as those of a long job have."""
    return FleetRun(job.model_copy(update={"results": str(results)}), _Warm(workers), "local").run()


class _Warm(LocalEngine):
    """FleetEngine whose workers have begun and imported all before it gets work."""

    def __init__(self, workers: int) -> None:
        super().__init__(workers)
        for _ in range(workers):
            self.add_worker()


def driver_memory(inputs: int) -> float:
    """Returns the largest resident memory of a driver of so many inputs, MiB, in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.fleet", "--driver-of", str(inputs)]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return float(printed.split()[-1])


def _drive(inputs: int) -> None:
    """Runs a job of so many empty inputs and prints the memory it took."""
    with tempfile.TemporaryDirectory() as folder:
        job = FleetJob.model_validate(
            {"procedure": "benchmarks.fleet:nothing", "seeds": {"count": inputs}, "results": folder}
        )
        FleetRun(job, LocalEngine(1), "local").run()
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)


def sessions_on_two_nodes(count: int, folder: Path) -> Content:
    """Computes simulated sessions on two nodes of Ray, one of which goes in mid-run and is replaced."""
    import ray
    from ray.cluster_utils import Cluster

    from tumble.fleet.ray_engine import RayEngine

    nodes = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    second = nodes.add_node(num_cpus=1)
    ray.init(nodes.address, log_to_driver=False)
    removed: list[int] = []

    def watch(status: JobStatus) -> None:
        if not removed and status.done >= count // 2:
            removed.append(status.done)
            threading.Thread(target=_replace, args=(nodes, second)).start()

    options = {"rate": 20, "still": "2s"}
    job = FleetJob.model_validate(
        {
            "procedure": "spin",
            "simulate": {"scenario": "spin", "count": count, "options": options},
            "results": str(folder / "sessions"),
        }
    )
    engine: FleetEngine = RayEngine("", 2)
    try:
        status = FleetRun(job, engine, "ray", show=watch).run()
    finally:
        ray.shutdown()
        nodes.shutdown()  # type: ignore[no-untyped-call]
    return {
        "sessions": status.done,
        "failed": status.failed,
        "lost_tasks": status.retried,
        "removed_at": removed[0] if removed else None,
        "seconds": status.seconds,
    }


def _replace(nodes: Any, gone: Any) -> None:  # noqa: ANN401 - Ray's types are its own
    nodes.remove_node(gone, allow_graceful=False)
    nodes.add_node(num_cpus=1)


def cost(seconds_a_log: float, bytes_a_log: float, log_seconds: float) -> Content:
    """Returns what a million logs of ten minutes would take, in proportion to what was measured."""
    scale = LOG_SECONDS / log_seconds
    return {
        "core_hours": A_MILLION * seconds_a_log * scale / 3600.0,
        "terabytes": A_MILLION * bytes_a_log * scale / 1e12,
        "megabytes_a_second_and_core": bytes_a_log / seconds_a_log / 1e6,
    }


def measure(count: int, most: int, sessions: int) -> Content:
    """Measures all figures."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        job = logs(count, folder / "logs")
        recorded = simulate_spin(seed=0).samples.time
        size = (folder / "logs" / "made-0" / "spin.csv").stat().st_size
        one, two, loop = (
            _least(lambda: ran(job, 1, _fresh(folder / "one")).seconds),
            _least(lambda: ran(job, 2, _fresh(folder / "two")).seconds),
            _least(lambda: looped(job)),
        )
        return {
            "logs": count,
            "loop": loop,
            "one_worker": one,
            "two_workers": two,
            "memory": {str(inputs): driver_memory(inputs) for inputs in (FEWEST, most)},
            "cost": cost(loop / count, size, float(recorded[-1] - recorded[0])),
            "sessions": sessions_on_two_nodes(sessions, folder) if sessions else None,
            "machine": machine(),
        }


def _least(ask: Callable[[], float]) -> float:
    return min(ask() for _ in range(2))


def _fresh(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    return folder


def show(content: Content, console: Console) -> None:
    """Prints the table."""
    table = Table("figure", "goal", "measured")
    overhead, gain = content["one_worker"] / content["loop"], content["one_worker"] / content["two_workers"]
    table.add_row("one worker over a plain loop", f"{LARGEST_OVERHEAD:g}", f"{overhead:.3f}")
    table.add_row("two workers over one", f"{LEAST_GAIN:g}", f"{gain:.2f}")
    (fewest, small), (most, large) = content["memory"].items()
    table.add_row(
        f"memory of the driver, {most} inputs over {fewest}", f"{LARGEST_GROWTH:g}",
        f"{large / small:.2f} ({small:.0f} -> {large:.0f} MiB)",
    )  # fmt: skip
    console.print(table)
    console.print(content["cost"])
    console.print(content["sessions"])


def main() -> int:
    """Measures, prints and saves."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--logs", type=int, default=400)
    parser.add_argument("--most", type=int, default=100_000)
    parser.add_argument("--sessions", type=int, default=0)
    parser.add_argument("--driver-of", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.driver_of:
        _drive(options.driver_of)
        return 0
    content = measure(options.logs, options.most, options.sessions)
    show(content, Console())
    save("fleet", content)
    return 0


if __name__ == "__main__":
    sys.exit(main())
