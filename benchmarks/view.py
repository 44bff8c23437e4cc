"""`tumble view` in a browser: time to open and to zoom a long log, memory, and what others take for the same.

`python -m benchmarks.view [--samples 10000000] [--zooms 60]`
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow.parquet as pq  # type: ignore[import-untyped]
from rich.console import Console
from rich.table import Table
from tsdownsample import MinMaxLTTBDownsampler

from benchmarks.results import Content, machine, save
from tumble.foundation.recording import Chunk, FloatArray
from tumble.logs import Facts, open_recording, open_writer
from tumble.tools.view.samples import KeptSamples

if TYPE_CHECKING:
    from playwright.sync_api import Page

OPEN_GOAL, ZOOM_GOAL = 2.0, 0.150
"""s, to the chart of the whole log, and to a new range at p95."""
SEED, RATE, CHUNK = 20_260_000_031, 1000.0, 1 << 16
CHROMIUM = "/usr/bin/chromium"
COLUMNS = ("ax", "ay", "az", "gx", "gy", "gz")
BINS = 600
"""Bins in which peers show a window, those of a page 1400 px wide."""

_ZOOM = """async (ends) => {
  const plot = document.querySelector(".tumble-plot");
  const drawn = () => plot.dataset.drawn;
  const before = drawn();
  const began = performance.now();
  for (const key of ends) plot.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  while (drawn() === before) await new Promise((resolve) => setTimeout(resolve, 1));
  await new Promise((resolve) => requestAnimationFrame(resolve));
  return (performance.now() - began) / 1000;
}"""


def written(path: Path, samples: int) -> Path:
    """Writes a log in which a unit rests and turns, with knocks of one sample."""
    random = np.random.default_rng(SEED)
    with open_writer(path, facts=Facts()) as writer:
        for first in range(0, samples, CHUNK):
            time_ = np.arange(first, min(first + CHUNK, samples)) / RATE
            place, within = np.divmod(time_, 20.0)
            angle = (place + np.clip((within - 14.0) / 6.0, 0.0, 1.0)) * np.pi / 2.0
            force = 9.81 * np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=1)
            rate = np.zeros_like(force)
            rate[:, 1] = np.where(within > 14.0, np.pi / 12.0, 0.0)
            force += random.normal(0.0, 0.02, force.shape)
            rate += random.normal(0.0, 0.002, rate.shape)
            force[random.integers(0, len(force), 3)] += random.normal(0.0, 30.0, (3, 3))
            writer.write(Chunk(time_, force, rate))
    return path


@contextmanager
def served(path: Path) -> Iterator[tuple[str, int]]:
    """Serves the page of a log; gives its address, and the number of its process."""
    command = [sys.executable, "-m", "tumble", "view", str(path), "--no-browser", "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield json.loads(process.stdout.readline())["address"], process.pid
    finally:
        process.terminate()
        process.wait()


def in_browser(path: Path, zooms: int) -> Content:
    """Opens a log in a browser, zooms, and looks at the memory of the server."""
    from playwright.sync_api import sync_playwright

    began = time.perf_counter()
    with served(path) as (address, process), sync_playwright() as driver:
        answered = time.perf_counter()
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        opened = time.perf_counter()
        page.goto(address)
        page.wait_for_selector(".tumble-plot[data-drawn]")
        first = time.perf_counter()
        duration = (path_samples(path) - 1) / RATE
        page.wait_for_function(
            "end => Number(document.querySelector('.tumble-plot')?.dataset.drawn?.split(' ')[1]) > end",
            arg=duration - 1e-3,
            polling=5,
        )
        whole = time.perf_counter()
        page.get_by_text("Procedures that it suits").wait_for(timeout=120_000)
        inspected = time.perf_counter()
        taken = zoom_times(page, zooms)
        browser.close()
        return {
            "command": answered - began,
            "first_picture": first - opened,
            "open": whole - opened,
            "inspected": inspected - opened,
            "zoom": {"p50": float(np.median(taken)), "p95": float(np.quantile(taken, 0.95)), "count": zooms},
            "memory": memory_of(process),
        }


def path_samples(path: Path) -> int:
    """Returns the number of samples of a Parquet file."""
    return int(pq.read_metadata(path).num_rows)


def zoom_times(page: Page, zooms: int) -> FloatArray:
    """Returns the times, s, from a key to the picture of another range; ranges from all to milliseconds."""
    random = np.random.default_rng(SEED)
    taken = []
    depth = 0
    for _ in range(zooms):
        zooms_in = depth < 20 and (depth == 0 or random.random() < 0.6)
        keys = (
            ["ArrowUp"]
            if zooms_in
            else random.choice([["ArrowDown"], ["ArrowRight"], ["ArrowLeft"]]).tolist()
        )
        keys = ["ArrowUp"] if depth == 0 else keys
        depth += {"ArrowUp": 1, "ArrowDown": -1}.get(keys[0], 0)
        taken.append(page.evaluate(_ZOOM, keys))
    return np.array(taken)


def memory_of(process: int) -> Content:
    """Returns the memory of a process, MiB: its own, and of files that it maps."""
    rows = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()[1:]
    sizes = {row.split(":")[0]: float(row.split()[1]) / 1024.0 for row in rows}
    return {"own": sizes["Anonymous"], "mapped": sizes["Rss"] - sizes["Anonymous"]}


def peers(path: Path) -> list[Content]:
    """Measures what others take for the whole log: samples in memory, and a picture of all or of some."""
    began = time.perf_counter()
    table = pq.read_table(path)
    values = {name: table[name].to_numpy() for name in ("time", *COLUMNS)}
    bare = time.perf_counter() - began
    kept = KeptSamples(open_recording(path))
    began = time.perf_counter()
    kept.read()
    ours = time.perf_counter() - began
    count = len(values["time"])
    downsampler = MinMaxLTTBDownsampler()  # type: ignore[no-untyped-call]
    every = max(count // (2 * BINS), 1)
    ways: dict[str, tuple[float, Callable[[], Any]]] = {
        "tumble view, without the browser": (ours, lambda: kept.lines(0.0, kept.duration, BINS)),
        "pyarrow, tsdownsample": (
            bare,
            lambda: [downsampler.downsample(values[name], n_out=2 * BINS) for name in COLUMNS],
        ),
        "pyarrow, every nth sample": (bare, lambda: [values[name][::every].copy() for name in COLUMNS]),
        "pyarrow, matplotlib": (bare, lambda: drawn(values)),
    }
    return [
        {"way": way, "read": read, "window": timed(act), "lost": lost(way, values, kept, every)}
        for way, (read, act) in ways.items()
    ]


def timed(act: Callable[[], Any]) -> float:
    """Returns the least of three times, s."""
    taken = []
    for _ in range(3):
        began = time.perf_counter()
        act()
        taken.append(time.perf_counter() - began)
    return min(taken)


def drawn(values: dict[str, FloatArray]) -> None:
    """Draws all samples as lines, 1400 px wide."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14.0, 5.0), dpi=100)
    for place, names in enumerate((COLUMNS[:3], COLUMNS[3:]), start=1):
        axes = figure.add_subplot(2, 1, place)
        for name in names:
            axes.plot(values["time"], values[name], linewidth=0.8)
    with tempfile.TemporaryFile() as file:
        figure.savefig(file, format="png")


def lost(way: str, values: dict[str, FloatArray], kept: KeptSamples, every: int) -> float | None:
    """Returns the share of bins whose highest specific force along x is hidden; None where all is drawn.

    It is hidden where nothing that is shown, in its bin and those beside it, reaches it.
    """
    wanted = values["ax"]
    edges = np.linspace(0, len(wanted), BINS + 1).astype(int)
    if "matplotlib" in way:
        return None
    if "tsdownsample" in way:
        found = MinMaxLTTBDownsampler().downsample(wanted, n_out=2 * BINS)  # type: ignore[no-untyped-call]
        at = found.astype(np.int64)
    elif "nth" in way:
        at = np.arange(0, len(wanted), every)
    else:
        line = kept.lines(0.0, kept.duration, BINS)[0]
        at = np.searchsorted(values["time"], line.time + values["time"][0] - 1e-9)
    highest = np.maximum.reduceat(wanted, edges[:-1])
    shown = np.full(BINS, -np.inf)
    np.maximum.at(shown, np.searchsorted(edges, at, side="right").clip(1, BINS) - 1, wanted[at])
    beside = np.pad(shown, 1, mode="edge")
    reached = np.max([beside[:-2], shown, beside[2:]], axis=0)
    return float((reached < highest).mean())


def measure(samples: int, zooms: int) -> Content:
    """Measures all of it on one log."""
    with tempfile.TemporaryDirectory() as folder:
        path = written(Path(folder) / "log.parquet", samples)
        browser = in_browser(path, zooms)
        size = path.stat().st_size / 1e6
        return {
            "samples": samples,
            "channels": len(COLUMNS),
            "megabytes": size,
            "browser": browser,
            "peers": peers(path),
            "machine": machine(),
        }


def show(content: Content) -> None:
    """Prints the figures."""
    table = Table("way", "read s", "window ms", "extremes lost")
    for row in content["peers"]:
        lost_share = "" if row["lost"] is None else f"{100.0 * row['lost']:.1f} %"
        table.add_row(row["way"], f"{row['read']:.2f}", f"{1e3 * row['window']:.1f}", lost_share)
    console = Console()
    console.print(table)
    console.print(content["browser"])


def main() -> int:
    """Measures, prints and keeps the figures; 1 if a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=10_000_000)
    parser.add_argument("--zooms", type=int, default=60)
    options = parser.parse_args()
    content = measure(options.samples, options.zooms)
    show(content)
    save("view", content)
    browser = content["browser"]
    return int(browser["open"] > OPEN_GOAL or browser["zoom"]["p95"] > ZOOM_GOAL)


if __name__ == "__main__":
    sys.exit(main())
