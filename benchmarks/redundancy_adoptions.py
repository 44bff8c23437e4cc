"""Adoptions of the monitor, and their triggers, in missions with drawn faults and settings.

`python -m benchmarks.redundancy_adoptions [--missions 2000] [--seed 0] [--only SEED] [--cores N] [--no-save]`

`redundancy_judge.py` defines the counts, `redundancy_mission.py` the draws. Missions have the
seeds `--seed`, `--seed` + 1 ... `--only SEED` flies one of them alone and shows all events of the monitor.
"""

from __future__ import annotations

import argparse
import os
import sys
import traceback
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.redundancy_flown import SENSORS, replayed
from benchmarks.redundancy_judge import judged
from benchmarks.redundancy_mission import draw
from benchmarks.redundancy_verdict import Verdict
from benchmarks.results import Content, machine, save

MISSIONS = 2000
CORES = max(1, (os.cpu_count() or 2) // 2)
FAILURES = (
    "wrongly adopted",
    "missed triggers",
    "false triggers",
    "crashes",
)
"""Kinds of findings whose goal is none."""


def flown(seed: int) -> dict[str, Any]:
    """Judges a mission; an error of judge or monitor is a finding as well."""
    try:
        return judged(seed).plain()
    except Exception as error:
        verdict = Verdict(seed, 0.0, 0, counts={"crashes": 1})
        place = traceback.extract_tb(error.__traceback__)[-1]
        verdict.findings.append(f"crash: {error!r} at {place.name}:{place.lineno}")
        return verdict.plain()


def campaign(seeds: Sequence[int], cores: int, console: Console) -> list[dict[str, Any]]:
    """Flies all missions, in order of their seeds."""
    if cores == 1:
        return [flown(seed) for seed in track(seeds, "missions", console=console)]
    with ProcessPoolExecutor(cores, mp_context=get_context("spawn")) as pool:
        results = pool.map(flown, seeds, chunksize=4)
        return list(track(results, "missions", total=len(seeds), console=console))


def summary(verdicts: Sequence[dict[str, Any]]) -> Content:
    """Puts the figures of all missions together."""
    counts: Counter[str] = Counter(dict.fromkeys(FAILURES, 0))
    for verdict in verdicts:
        counts.update(verdict["counts"])
    return {
        "missions": len(verdicts),
        "hours": sum(verdict["duration"] for verdict in verdicts) / 3600.0,
        "counts": dict(sorted(counts.items())),
        "adoptions": {name: _adoptions(verdicts, name) for name in SENSORS},
        "replay_rate": _percentiles([v["replay_rate"] for v in verdicts if v["replay_rate"]]),
        "failed": [
            {"seed": verdict["seed"], "findings": verdict["findings"]}
            for verdict in verdicts
            if verdict["findings"]
        ],
    }


def _adoptions(verdicts: Sequence[dict[str, Any]], name: str) -> Content:
    """Returns what adopted errors leave as a share of what was left before."""
    adopted = [a for verdict in verdicts for a in verdict["adoptions"] if a["sensor"] == name]
    first = [a for a in adopted if not a["misled"]]
    fit_models: dict[str, list[float]] = defaultdict(list)
    for each in first:
        fit_models[each["fit_model"]].append(each["after"] / each["before"])
    return {
        "judged": len(adopted),
        "share": _percentiles([a["after"] / a["before"] for a in first]),
        "before": _percentiles([a["before"] for a in first]),
        "after": _percentiles([a["after"] for a in first]),
        "share_by_fit_model": {
            fit_model: _percentiles(shares) for fit_model, shares in sorted(fit_models.items())
        },
    }


def _percentiles(values: Iterable[float]) -> Content:
    """Median, 95 % and largest; nothing of nothing."""
    known = np.array([value for value in values if np.isfinite(value)])
    if not len(known):
        return {"number": 0}
    median, high = np.percentile(known, [50.0, 95.0])
    return {"number": len(known), "median": float(median), "high": float(high), "max": float(known.max())}


def show(figures: Content, console: Console) -> None:
    """Prints the tables."""
    counts = figures["counts"]
    table = Table("what", "count", title=f"{figures['missions']} missions, {figures['hours']:.1f} h")
    for name, count in counts.items():
        table.add_row(name, str(count), style="red" if name in FAILURES and count else "")
    console.print(table)
    table = Table("adopted", "judged", "share left: median", "95 %", "max", "rms left: median", "95 %")
    for name, of in figures["adoptions"].items():
        table.add_row(name, str(of["judged"]), *_three(of["share"]), *_three(of["after"])[:2])
        for fit_model, share in of["share_by_fit_model"].items():
            table.add_row(f"  {fit_model}", str(share["number"]), *_three(share))
    console.print(table)


def _three(percentiles: Content) -> list[str]:
    if not percentiles["number"]:
        return ["-"] * 3
    return [f"{percentiles[name]:.3g}" for name in ("median", "high", "max")]


def show_one(seed: int, console: Console) -> int:
    """Flies one mission and prints all of it."""
    mission = draw(seed)
    console.print(mission)
    for time, unit, what, figures in replayed(mission).events:
        console.print(f"{time:9.3f} s  unit {unit}  {what}", dict(figures), highlight=False)
    verdict = flown(seed)
    console.print(verdict)
    return int(any(verdict["counts"].get(name, 0) for name in FAILURES))


def main(arguments: Sequence[str] | None = None) -> int:
    """Flies all missions; 1 if anything went wrong whose goal is none."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--missions", type=int, default=MISSIONS)
    parser.add_argument("--seed", type=int, default=0, help="of the first mission")
    parser.add_argument("--only", type=int, metavar="SEED", help="one mission, with all its events")
    parser.add_argument("--cores", type=int, default=CORES)
    parser.add_argument(
        "--no-save", action="store_true", help="show figures, but leave benchmarks/results alone"
    )
    options = parser.parse_args(arguments)
    console = Console()
    if options.only is not None:
        return show_one(options.only, console)
    seeds = range(options.seed, options.seed + options.missions)
    figures = summary(campaign(seeds, options.cores, console))
    show(figures, console)
    for each in figures["failed"]:
        for finding in each["findings"]:
            console.print(f"--only {each['seed']}: {finding}", highlight=False)
    if not options.no_save:
        save("redundancy_adoptions", {"seed": options.seed, **figures, "machine": machine()})
    return int(any(figures["counts"][name] for name in FAILURES))


if __name__ == "__main__":
    sys.exit(main())
