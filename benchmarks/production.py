"""A production line: hundreds of logs of half a minute, from files to calibration files, pages and summary.

`python -m benchmarks.production [--tiny]`
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.arrow_csv import csv_of_ours
from benchmarks.results import Content, machine, save
from tumble.logs import open_writer
from tumble.tools.simulate import simulate_turntable

SEED = 20_254_000
DISTINCT = 10
"""Different logs, of which a batch has many copies."""
RATE_HZ, REST_SECONDS = 200.0, 3.0
LARGEST_GROWTH = 1.2
"""Largest growth of memory, where a batch has twenty times as many targets."""
PAGES = ("all", "none")
SECONDS = {"all": 15.0, "none": 10.0}
"""Goals for the batch with pages and without, on two cores with nothing else to do."""


@dataclass(frozen=True, slots=True)
class Size:
    """Numbers of targets."""

    batch: int = 500
    memory: tuple[int, int] = (50, 1000)


TINY = Size(batch=3, memory=(1, 4))


def write_line(folder: Path, targets: int) -> tuple[Path, Path]:
    """Writes the log of a reference and a folder with those of the targets; returns the places of both."""
    session = simulate_turntable(
        seed=SEED,
        grades=("consumer",) * DISTINCT,
        rate_hz=RATE_HZ,
        rest_seconds=REST_SECONDS,
        turn_rate_dps=90.0,
        turn_acceleration_dps2=180.0,
    )
    reference, units = folder / "reference.csv", folder / "units"
    units.mkdir()
    logs = [folder / f"{number}.csv" for number in range(DISTINCT)]
    for path, unit in zip([reference, *logs], session.units, strict=True):
        with open_writer(path) as writer:
            writer.write(unit.samples)
    for number in range(targets):
        os.link(logs[number % DISTINCT], units / f"unit_{number + 1}.csv")
    return reference, units


@dataclass(frozen=True, slots=True)
class Use:
    """Resources that one command took."""

    wall: float
    processor: float
    """s, of it and the processes it started."""
    memory: int
    """Bytes at its peak, of the largest process."""


def calibrated(reference: Path, targets: Sequence[Path], pages: str, out: Path) -> Use:
    """Runs the command in a process of its own."""
    code = "from tumble.cli.main import main\nif __name__ == '__main__': main()"
    arguments = ["turntable", reference, *targets, "--pages", pages, "-q", "-o", out, "--g-sensitivity"]
    begun = time.perf_counter()
    process = os.posix_spawn(sys.executable, [sys.executable, "-c", code, *map(str, arguments)], os.environ)
    _, status, usage = os.wait4(process, 0)
    if os.waitstatus_to_exitcode(status) not in (0, 3):
        raise RuntimeError("the batch was not calibrated: the time is not that of the whole work")
    return Use(time.perf_counter() - begun, usage.ru_utime + usage.ru_stime, 1024 * usage.ru_maxrss)


def read_by_arrow(units: Sequence[Path]) -> Use:
    """Reads the same logs one after the other with pyarrow, in this process."""
    begun, used = time.perf_counter(), time.process_time()
    for path in units:
        csv_of_ours(path)
    return Use(time.perf_counter() - begun, time.process_time() - used, 0)


def measure(size: Size, console: Console) -> Content:
    """Calibrates batches with and without pages, then batches of several sizes."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        reference, units = write_line(folder, max(size.batch, *size.memory))
        logs = sorted(units.iterdir(), key=lambda path: int(path.stem.removeprefix("unit_")))
        arrow = read_by_arrow(logs[: size.batch])
        batches = {}
        for pages in PAGES:
            use = calibrated(reference, logs[: size.batch], pages, folder / pages)
            batches[pages] = {
                "seconds": use.wall,
                "processor_seconds": use.processor,
                "ratio": use.processor / arrow.processor,
                "peak_bytes": use.memory,
            }
            console.print(f"{pages} pages done")
        few, many = (calibrated(reference, logs[:n], "none", folder / f"of_{n}") for n in size.memory)
    return {
        "targets": size.batch,
        "batches": batches,
        "arrow_processor_seconds": arrow.processor,
        "memory": {
            "targets": size.memory,
            "peak_bytes": [few.memory, many.memory],
            "growth": many.memory / few.memory,
        },
    }


def table(content: Content) -> Table:
    """Figures as a table on screen."""
    shown = Table("pages", "seconds", "of processor", "against pyarrow", "peak", title="production line")
    for pages, of in content["batches"].items():
        figures = (of["seconds"], of["processor_seconds"], of["ratio"])
        shown.add_row(pages, *(f"{figure:.1f}" for figure in figures), f"{of['peak_bytes'] / 2**20:.0f} MiB")
    for count, peak in zip(content["memory"]["targets"], content["memory"]["peak_bytes"], strict=True):
        shown.add_row(f"{count} targets", "", "", "", f"{peak / 2**20:.0f} MiB")
    return shown


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tiny", action="store_true", help="only see that it runs")
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    size = TINY if options.tiny else Size()
    content = {"machine": machine(), "seed": SEED, "load": os.getloadavg()[0]} | measure(size, console)
    console.print(table(content))
    if not options.no_save:
        console.print(f"written to {save('production', content)}")
    return content


if __name__ == "__main__":
    main()
