"""Root-mean-square error against the Cramer-Rao bound, and coverage of the 95 % intervals.

`python -m benchmarks.accuracy [--sessions 1000]`
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, fields
from multiprocessing import get_context

# One process a core: threads of the simulator's own would only get in each other's way.
os.environ.setdefault("RAYON_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.bound import GROUPS, PARAMETERS, TRIADS
from benchmarks.results import Content, machine, save
from benchmarks.settings import BASE_SEED, Cell, cells
from benchmarks.trial import Outcome, run, share_of_information_in_integrals
from tumble.foundation.recording import FloatArray

LARGEST_RATIO = 1.05
COVERAGE = (0.93, 0.97)
BATCH = 25
CORES = 2


@dataclass(frozen=True, slots=True)
class Sample:
    """Outcomes of many sessions of one triad, (n, 12) each; see `Outcome`."""

    error: FloatArray
    sigma: FloatArray
    reach: FloatArray
    bound: FloatArray
    best: FloatArray

    @classmethod
    def of(cls, outcomes: Sequence[Outcome]) -> Sample:
        """Stacks outcomes."""
        return cls(*(np.array([getattr(o, field.name) for o in outcomes]) for field in fields(cls)))

    def figures(self, columns: slice) -> Content:
        """Ratio and coverage of some of the twelve parameters together."""
        share = (self.error / self.bound)[:, columns] ** 2
        luck = (self.best / self.bound)[:, columns] ** 2
        inside = np.abs(self.error / self.reach)[:, columns] <= 1.0
        ratio, ratio_error = _root_mean(share.mean(axis=1))
        # Control variate: the error of the efficient estimate on the same data has a known mean square.
        corrected, corrected_error = _root_mean((share - luck).mean(axis=1) + 1.0)
        covered = inside.mean(axis=1)
        return {
            "bound": float(np.sqrt((self.bound[:, columns] ** 2).mean())),
            "rmse": float(np.sqrt((self.error[:, columns] ** 2).mean())),
            "ratio": ratio,
            "ratio_error": ratio_error,
            "ratio_without_luck": corrected,
            "ratio_without_luck_error": corrected_error,
            "efficient": _root_mean(luck.mean(axis=1))[0],
            "coverage": float(covered.mean()),
            "coverage_error": float(covered.std(ddof=1) / np.sqrt(len(covered))),
            "stated": float(np.sqrt((self.sigma[:, columns] ** 2 / self.bound[:, columns] ** 2).mean())),
        }


def _root_mean(squares: FloatArray) -> tuple[float, float]:
    """Root of a mean, and its Monte Carlo standard error."""
    root = float(np.sqrt(squares.mean()))
    return root, float(squares.std(ddof=1) / (2.0 * root * np.sqrt(len(squares))))


def summary(samples: dict[str, Sample]) -> Content:
    """Figures of each triad by group and by parameter."""
    return {
        triad: {
            "groups": {g: samples[triad].figures(slice(3 * k, 3 * k + 3)) for k, g in enumerate(GROUPS)},
            "parameters": {p: samples[triad].figures(slice(k, k + 1)) for k, p in enumerate(PARAMETERS)},
        }
        for triad in TRIADS
    }


def brief(figures: Content) -> Content:
    """Summary of one cell: its parameters that are furthest from the bound, and the coverage of its groups.

    The figures of each parameter are on screen while a cell is measured; its seed gives them again.
    """
    single = [
        {"triad": triad, "parameter": name, **of}
        for triad in TRIADS
        for name, of in figures[triad]["parameters"].items()
    ]
    drawn = max(single, key=lambda of: float(of["ratio"]))
    return {
        "parameters": len(single),
        "above": sum(of["ratio"] > LARGEST_RATIO for of in single),
        "largest": {key: drawn[key] for key in ("triad", "parameter", "ratio", "ratio_error")},
        "largest_without_luck": max(of["ratio_without_luck"] for of in single),
        "coverage": {
            triad: {group: of["coverage"] for group, of in figures[triad]["groups"].items()}
            for triad in TRIADS
        },
    }


def _batch(cell: Cell, sessions: range) -> dict[str, Sample]:
    outcomes = [run(cell, session) for session in sessions]
    return {triad: Sample.of([outcome[triad] for outcome in outcomes]) for triad in TRIADS}


def measure(
    chosen: Sequence[Cell], sessions: int, console: Console
) -> Iterator[tuple[Cell, dict[str, Sample]]]:
    """Runs all sessions; a cell is given as soon as it is done."""
    batches = [range(start, min(start + BATCH, sessions)) for start in range(0, sessions, BATCH)]
    with ProcessPoolExecutor(CORES, get_context("spawn")) as pool:
        work = {pool.submit(_batch, cell, batch): (cell, batch) for cell in chosen for batch in batches}
        done: dict[int, dict[int, dict[str, Sample]]] = {cell.number: {} for cell in chosen}
        finished = track(
            as_completed(work), "sessions", total=len(work), console=console, disable=not console.is_terminal
        )
        for future in finished:
            cell, batch = work[future]
            done[cell.number][batch.start] = future.result()
            if len(done[cell.number]) == len(batches):
                # In the order of the seeds, so that the figures are the same in every run.
                yield cell, joined([samples for _, samples in sorted(done.pop(cell.number).items())])


def joined(parts: Sequence[dict[str, Sample]]) -> dict[str, Sample]:
    """Sessions of several batches or cells together."""
    return {
        triad: Sample(
            *(np.vstack([getattr(part[triad], field.name) for part in parts]) for field in fields(Sample))
        )
        for triad in TRIADS
    }


def table(content: Content, title: str) -> Table:
    """Figures of one cell as a table on screen."""
    shown = Table(
        "triad",
        "group",
        "RMSE / bound",
        "corrected for sampling",
        "95 % covers",
        "stated / bound",
        title=title,
    )
    for triad in TRIADS:
        for group, figures in content[triad]["groups"].items():
            shown.add_row(
                triad,
                group,
                _marked(
                    f"{figures['ratio']:.3f} +- {figures['ratio_error']:.3f}",
                    figures["ratio"] <= LARGEST_RATIO,
                ),
                f"{figures['ratio_without_luck']:.3f} +- {figures['ratio_without_luck_error']:.3f}",
                _marked(
                    f"{100 * figures['coverage']:.1f} +- {100 * figures['coverage_error']:.1f} %",
                    COVERAGE[0] <= figures["coverage"] <= COVERAGE[1],
                ),
                f"{figures['stated']:.2f}",
            )
    return shown


def _marked(text: str, good: bool) -> str:
    return text if good else f"[bold red]{text}[/]"


def main(arguments: Sequence[str] | None = None) -> Content:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=1000, help="simulated sessions a cell")
    parser.add_argument(
        "--cells", default="", help="numbers of the cells to run, with commas; all where left out"
    )
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    numbers = {int(number) for number in options.cells.split(",") if number}
    chosen = [cell for cell in cells() if not numbers or cell.number in numbers]
    console = Console()
    console.print(f"{len(chosen)} cells of {options.sessions} sessions, seeds from {BASE_SEED}")
    begun = time.perf_counter()
    rows: list[Content] = []
    pools: dict[bool, list[dict[str, Sample]]] = {False: [], True: []}
    for cell, samples in measure(chosen, options.sessions, console):
        figures = summary(samples)
        pools[cell.bias_instability].append(samples)
        rows.append({"cell": cell.number, "name": cell.name, "seed": cell.seed(0), **brief(figures)})
        console.print(table(figures, cell.name))
    pooled = {
        "bias instability" if unstable else "white": summary(joined(parts))
        for unstable, parts in pools.items()
        if parts
    }
    for name, figures in pooled.items():
        console.print(table(figures, f"all cells, {name}"))
    integrals = share_of_information_in_integrals(chosen[0], 0)
    seconds = time.perf_counter() - begun
    content: Content = {
        "machine": machine(),
        "sessions": options.sessions,
        "seconds": round(seconds, 1),
        "cells": sorted(rows, key=lambda row: int(row["cell"])),
        "pooled": pooled,
        "bound_of_samples_over_integrals": dict(zip(PARAMETERS, integrals.tolist(), strict=True)),
    }
    console.print(f"{len(chosen) * options.sessions} sessions in {seconds:.0f} s")
    if not options.no_save:
        console.print(f"written to {save('accuracy', content)}")
    return content


if __name__ == "__main__":
    main()
