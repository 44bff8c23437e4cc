"""Peak memory of reading and acquiring a recording, and one ten times as long, in every format.

`python -m benchmarks.memory [--tiny]`
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.results import Content, machine, save

SEED = 20_253_000_000
TOURS = 7
"""Tours of the six poses, 90 s each: ten minutes, 126 000 samples at 200 Hz."""
LONGER = 10
LARGEST_GROWTH = 1.2
TINY = ("CSV", "ROS 1 bag")
"""Formats that show that it runs: text and bytes. Each takes two processes."""


def peak(path: Path) -> tuple[int, int]:
    """Peak resident memory, bytes, of a fresh process that acquires a recording, and the samples it found."""
    run = subprocess.run(
        [sys.executable, "-m", "benchmarks.memory", "--acquire", str(path)],
        check=True,
        capture_output=True,
        text=True,
        cwd=Path(__file__).parent.parent,
    )
    size, samples = run.stdout.split()
    return int(size), int(samples)


def acquire_here(path: Path) -> None:
    """Acquire in this process, and report the peak of memory."""
    import tumble
    from tumble import _core

    segmenter = _core.Segmenter()
    for chunk in tumble.open_recording(path).chunks():
        segmenter.push(chunk.time, chunk.accelerometer, chunk.gyroscope, chunk.temperature)
    acquired = segmenter.finish()
    print(peak_here(), acquired.samples)


def peak_here() -> int:
    """Peak resident memory of this process, bytes.

    On Linux `getrusage` counts what the process held before it became this program; `VmHWM` does not.
    """
    status = Path("/proc/self/status")
    if status.exists():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM:"))
        return int(line.split()[1]) * 1024
    kibibytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return kibibytes * (1 if sys.platform == "darwin" else 1024)


def measure(tours: int, longer: int, console: Console, names: Sequence[str] = ()) -> Content:
    """Writes, acquires and deletes one recording after the other, in some formats or in all."""
    from benchmarks.recordings import FORMATS, tours_of
    from tumble.foundation.recording import Chunk

    long = tours_of(tours * longer, SEED)
    count = len(long) // longer
    short = Chunk(long.time[:count], long.accelerometer[:count], long.gyroscope[:count])
    formats: Content = {}
    for name in track(names or FORMATS, "formats", console=console, disable=not console.is_terminal):
        file, write = FORMATS[name]
        peaks, sizes = [], []
        for chunk in (short, long):
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / file
                write(path, chunk)
                found, samples = peak(path)
                if samples != len(chunk):
                    raise RuntimeError(f"{name}: {samples} of {len(chunk)} samples were acquired")
                files = [path] if path.is_file() else [p for p in path.rglob("*") if p.is_file()]
                peaks.append(found)
                sizes.append(sum(p.stat().st_size for p in files))
        formats[name] = {
            "peak_bytes": peaks,
            "file_bytes": sizes,
            "growth": peaks[1] / peaks[0],
        }
    return {"samples": [len(short), len(long)], "formats": formats}


def table(content: Content) -> Table:
    """Figures as a table on screen."""
    few, many = content["samples"]
    shown = Table("format", f"{few} samples", f"{many} samples", "growth", "file", title="peak memory")
    for name, figures in content["formats"].items():
        first, second = (f"{size / 2**20:.0f} MiB" for size in figures["peak_bytes"])
        growth = f"{100 * (figures['growth'] - 1):+.1f} %"
        marked = growth if figures["growth"] <= LARGEST_GROWTH else f"[bold red]{growth}[/]"
        shown.add_row(name, first, second, marked, f"{figures['file_bytes'][1] / 2**20:.0f} MiB")
    return shown


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tiny", action="store_true", help="only see that it runs")
    parser.add_argument("--no-save", action="store_true", help="print only")
    parser.add_argument("--acquire", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.acquire:
        acquire_here(options.acquire)
        return {}
    console = Console()
    content = (
        {"machine": machine(), "seed": SEED} | measure(1, 2, console, TINY)
        if options.tiny
        else measure(TOURS, LONGER, console)
    )
    console.print(table(content))
    if not options.no_save:
        console.print(f"written to {save('memory', content)}")
    return content


if __name__ == "__main__":
    main()
