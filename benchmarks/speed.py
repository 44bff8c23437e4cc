"""Speed as ratios to well-known routines over the same data, measured side by side in one run.

`python -m benchmarks.speed [--tiny]`
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

import numpy as np
from rich.console import Console
from rich.table import Table

import tumble
from benchmarks.arrow_csv import csv_of_ours
from benchmarks.results import Content, load, machine, save
from benchmarks.settings import ORDER, design_scenario
from tumble import _core
from tumble.foundation.recording import Chunk, Recording
from tumble.logs import open_writer
from tumble.tools.simulate import TurntableScenario, simulate_turntable

SEED = 20_252_000_000


@dataclass(frozen=True, slots=True)
class Size:
    """Sizes of all inputs."""

    repetitions: int = 15
    tours: int = 55
    """Tours of the six poses, in the recording that is acquired and corrected: 55 are 990 000 samples."""
    csv_rows: int = 2_000_000
    csv_repetitions: int = 5
    starts: int = 15
    targets: int = 500
    distinct_targets: int = 10
    minutes: float = 10.0
    batch_repetitions: int = 3


TINY = Size(
    repetitions=2, tours=2, csv_rows=20_000, csv_repetitions=2, starts=1, targets=4, distinct_targets=2,
    minutes=1.5, batch_repetitions=1,
)  # fmt: skip

Action = Callable[[], object]


def side_by_side(ours: Action, theirs: dict[str, Action], repetitions: int) -> Content:
    """Runs all in turn, again and again: median time of each, and median of the ratios within each turn.

    A slow phase of the machine slows both, and cancels in the ratio.
    """
    actions = {"ours": ours, **theirs}
    seconds: dict[str, list[float]] = {name: [] for name in actions}
    for action in actions.values():
        action()
    for turn in range(repetitions):
        names = list(actions) if turn % 2 == 0 else list(actions)[::-1]
        for name in names:
            begun = time.perf_counter()
            actions[name]()
            seconds[name].append(time.perf_counter() - begun)
    ratios = {
        name: sorted(a / b for a, b in zip(seconds["ours"], seconds[name], strict=True)) for name in theirs
    }
    return {
        "seconds": {name: median(times) for name, times in seconds.items()},
        "ratios": {name: median(found) for name, found in ratios.items()},
        "spread": {name: [found[0], found[-1]] for name, found in ratios.items()},
        "repetitions": repetitions,
    }


def _long_session(tours: int, targets: int, seed: int) -> TurntableScenario:
    base = design_scenario()
    return replace(base, seed=seed, visits=ORDER * tours, grades=tuple(base.grades) * targets)


def acquisition(size: Size) -> Content:
    """Rests and turns of a recording in memory, against its mean."""
    samples = simulate_turntable(_long_session(size.tours, 1, SEED)).target_units[0].samples
    table = np.column_stack([samples.time, samples.accelerometer, samples.gyroscope])

    def acquire() -> _core.Acquired:
        segmenter = _core.Segmenter()
        segmenter.push(samples.time, samples.accelerometer, samples.gyroscope)
        return segmenter.finish()

    by_channel, flat = "numpy.mean(table, axis=0)", "numpy.mean(table)"
    theirs: dict[str, Action] = {by_channel: lambda: np.mean(table, axis=0), flat: lambda: np.mean(table)}
    found = side_by_side(acquire, theirs, size.repetitions)
    if len(acquire().rest_times) != len(ORDER) * size.tours:
        raise RuntimeError("not every rest was found: the time measured is not that of the whole work")
    return found | {"samples": len(table), "samples_a_second": len(table) / found["seconds"]["ours"]}


def correction(size: Size) -> Content:
    """Correction of both triads into arrays that exist, against copying them there."""
    unit = simulate_turntable(_long_session(size.tours, 1, SEED)).target_units[0]
    pairs = [
        (unit.samples.accelerometer, unit.accelerometer),
        (unit.samples.gyroscope, unit.gyroscope),
    ]
    outputs = [np.empty_like(y) for y, _ in pairs]

    def correct() -> None:
        for (y, triad), out in zip(pairs, outputs, strict=True):
            _core.correct(y, triad.M, triad.b, out)

    def copy() -> None:
        for (y, _), out in zip(pairs, outputs, strict=True):
            np.copyto(out, y)

    found = side_by_side(correct, {"numpy.copyto": copy}, size.repetitions)
    samples = len(unit.samples)
    return found | {"samples": samples, "samples_a_second": samples / found["seconds"]["ours"]}


def csv_reading(size: Size, folder: Path) -> Content:
    """All chunks of a CSV file, checked and in SI units, against pyarrow's reader of the same file."""
    samples = simulate_turntable(_long_session(size.tours, 1, SEED)).target_units[0].samples
    path = folder / "long.csv"
    rows = 0
    with open_writer(path) as writer:
        while rows < size.csv_rows:
            count = min(len(samples), size.csv_rows - rows)
            time_on = samples.time[:count] + rows / 200.0
            writer.write(Chunk(time_on, samples.accelerometer[:count], samples.gyroscope[:count]))
            rows += count

    def read() -> int:
        return sum(len(chunk) for chunk in tumble.open_recording(path).chunks())

    if read() != rows:
        raise RuntimeError("not every row was read")
    theirs: dict[str, Action] = {"pyarrow.csv.read_csv": lambda: csv_of_ours(path)}
    found = side_by_side(read, theirs, size.csv_repetitions)
    return found | {
        "rows": rows,
        "bytes": path.stat().st_size,
        "rows_a_second": rows / found["seconds"]["ours"],
    }


def inspection(size: Size, folder: Path) -> Content:
    """The whole process of `tumble inspect` over a small table, against one that imports numpy."""
    path = folder / "small.csv"
    noise = np.random.default_rng(SEED).normal(0.0, 0.01, (2000, 6))
    with open_writer(path) as writer:
        writer.write(Chunk(np.arange(2000) / 100.0, noise[:, :3] + [0.0, 0.0, 9.81], noise[:, 3:]))

    return start_up(size, folder, "inspect", str(path))


def start_up(size: Size, folder: Path, *words: str) -> Content:
    """The whole process of a command, against one that imports numpy.

    Both find their modules compiled, as they are where a package was installed.
    """
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment["PYTHONPYCACHEPREFIX"] = str(folder / "compiled")

    def run(code: str, *arguments: str) -> None:
        command = [sys.executable, "-c", code, *arguments]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment)

    theirs: dict[str, Action] = {"python -c 'import numpy'": lambda: run("import numpy")}
    code = "from tumble.cli.main import main; main()"
    return side_by_side(lambda: run(code, *words), theirs, size.starts)


def batch(size: Size) -> Content:
    """Hundreds of targets against one reference, all in memory."""
    tours = max(1, round(size.minutes * 60.0 / (len(ORDER) * 15.0)))
    played = simulate_turntable(_long_session(tours, size.distinct_targets, SEED))
    units = played.target_units
    targets = [
        Recording.from_arrays(
            f"target_{number + 1}",
            unit.samples.time,
            unit.samples.accelerometer,
            unit.samples.gyroscope,
            unit.samples.temperature,
            clock="turntable",
        )
        for number in range(size.targets)
        for unit in (units[number % len(units)],)
    ]
    cores = os.cpu_count() or 1
    walls, shares = [], []
    for _ in range(size.batch_repetitions):
        wall, used = time.perf_counter(), time.process_time()
        result = tumble.turntable(played.reference, targets)
        wall, used = time.perf_counter() - wall, time.process_time() - used
        if any(target.failure for target in result.targets):
            raise RuntimeError(next(target.failure for target in result.targets if target.failure))
        walls.append(wall)
        shares.append(used / wall / cores)
    return {
        "targets": size.targets,
        "samples_a_target": len(units[0].samples),
        "minutes": len(units[0].samples) / 200.0 / 60.0,
        "seconds": median(walls),
        "targets_a_second": size.targets / median(walls),
        "share_of_cores": median(shares),
        "cores": cores,
        "repetitions": size.batch_repetitions,
    }


GOALS = {"acquisition": 3.0, "correction": 2.0, "csv": 1.5, "start_up": 2.0, "help": 2.0}


def tables(content: Content) -> list[Table]:
    """Figures as tables on screen."""
    shown = Table("what", "against", "ratio of times", "least and most", "goal", title="speed")
    for name, goal in GOALS.items():
        if name not in content:
            continue
        for other, ratio in content[name]["ratios"].items():
            low, high = content[name]["spread"][other]
            shown.add_row(name, other, f"{ratio:.2f}", f"{low:.2f} {high:.2f}", f"{goal:g}")
    if "batch" not in content:
        return [shown]
    whole = Table("targets", "minutes each", "targets a second", "share of all cores", title="batch")
    figures = content["batch"]
    whole.add_row(
        str(figures["targets"]),
        f"{figures['minutes']:.1f}",
        f"{figures['targets_a_second']:.0f}",
        f"{100 * figures['share_of_cores']:.0f} %",
    )
    return [shown, whole]


PARTS: dict[str, Callable[[Size, Path], Content]] = {
    "acquisition": lambda size, _: acquisition(size),
    "correction": lambda size, _: correction(size),
    "csv": csv_reading,
    "start_up": inspection,
    "help": lambda size, folder: start_up(size, folder, "--help"),
    "batch": lambda size, _: batch(size),
}
"""Measurements by their names; each gets an empty folder."""


def measure(size: Size, console: Console, names: Sequence[str]) -> Content:
    """Runs some parts."""
    content: Content = {"machine": machine(), "seed": SEED}
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            content[name] = PARTS[name](size, Path(folder))
        console.print(f"{name} done")
    return content


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tiny", action="store_true", help="only see that it runs")
    parser.add_argument("--no-save", action="store_true", help="print only")
    parser.add_argument("--only", choices=PARTS, help="measure one part anew, and keep the others")
    options = parser.parse_args(arguments)
    console = Console()
    content = load("speed") if options.only and not options.no_save else {}
    content |= measure(
        TINY if options.tiny else Size(), console, [options.only] if options.only else [*PARTS]
    )
    for shown in tables(content):
        console.print(shown)
    if not options.no_save:
        console.print(f"written to {save('speed', content)}")
    return content


if __name__ == "__main__":
    main()
