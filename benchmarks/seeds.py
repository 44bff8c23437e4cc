"""Campaigns as jobs of a fleet: a function of a seed over many of them, resumed where it was interrupted."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

from tumble.fleet.driver import FleetRun
from tumble.fleet.engine import engine_of
from tumble.fleet.job import FleetJob
from tumble.fleet.ledger import JobStatus
from tumble.fleet.parts import rows
from tumble.fleet.places import FileStore


def digest_of(*files: Path) -> str:
    """Returns a digest of files: what a campaign is simulated, judged and scored by."""
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def computed(
    function: str,
    seeds: Sequence[int],
    results: Path,
    console: Console,
    *,
    options: Mapping[str, Any] | None = None,
    engine: str = "local",
    jobs: int = 1,
) -> list[dict[str, Any]]:
    """Calls `MODULE:FUNCTION` with each seed, and returns what it gives, in their order.

    Seeds whose results are there already are not computed again. Raises `RuntimeError` where a seed has no
    result.
    """
    job = FleetJob.model_validate(
        {"procedure": function, "seeds": list(seeds), "results": str(results), "options": dict(options or {})}
    )
    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("seeds", total=len(seeds))

        def show(status: JobStatus) -> None:
            bar.update(task, completed=status.done)

        FleetRun(job, partial(engine_of, engine, jobs), engine, resume=True, show=show).run()
    found: dict[int, dict[str, Any]] = {}
    for row in rows(FileStore(str(results)), ("place", "failure", "summary")):
        if row["failure"] and int(str(row["place"])) in seeds:
            raise RuntimeError(f"seed {row['place']}: {row['failure']}")
        found[int(str(row["place"]))] = json.loads(str(row["summary"] or "{}"))
    return [found[seed] for seed in seeds]
