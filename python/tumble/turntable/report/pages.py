"""Writing the pages: one file for the batch and one a target, each complete in itself."""

from __future__ import annotations

import re
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import chain, count
from multiprocessing import get_context
from pathlib import Path

from tumble.files import prepare_folder, write_text
from tumble.report.page import environment
from tumble.turntable.report.batch_page import batch_page
from tumble.turntable.report.target_page import target_page
from tumble.turntable.result import TargetResult, TurntableResult

BATCH_PAGE = "report.html"

_TARGETS_PER_TASK = 8


def write_reports(result: TurntableResult, directory: Path | str, *, jobs: int = 1) -> list[Path]:
    """Write `report.html` and a page for each target into `directory`, which is made where it is missing.

    With `jobs` above one, that many processes draw; the pages are the same. Each file takes its name only
    once it is whole, and the batch page comes last, so that its links lead somewhere. Returns the paths, the
    batch page first.

    Raises `OutputError` where a file cannot be written; what stood there before is untouched.
    """
    directory = prepare_folder(directory)
    names = page_names(result.targets)
    paths = [directory / name for name in names]
    context = replace(result, targets=())
    tasks = [(context, target, path) for target, path in zip(result.targets, paths, strict=True)]
    workers = min(jobs, -(-len(tasks) // _TARGETS_PER_TASK))
    if workers > 1:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            list(pool.map(_write_target, tasks, chunksize=_TARGETS_PER_TASK))
    else:
        for task in tasks:
            _write_target(task)
    batch = directory / BATCH_PAGE
    write_text(batch, render_batch(result, names))
    return [batch, *paths]


def render_target(result: TurntableResult, target: TargetResult) -> str:
    """Render the page of one target as HTML."""
    page = target_page(result, target)
    return (
        environment("tumble.turntable.report")
        .get_template("target.html.j2")
        .render(page=page, batch_page=BATCH_PAGE)
    )


def render_batch(result: TurntableResult, names: Sequence[str]) -> str:
    """Render the page of the batch as HTML, with links to the targets' pages of those file names."""
    page = batch_page(result, names)
    return environment("tumble.turntable.report").get_template("batch.html.j2").render(page=page)


def page_names(targets: Sequence[TargetResult]) -> list[str]:
    """Choose file names for the targets' pages: their own where a file can bear it, and none twice."""
    taken = {BATCH_PAGE}
    names: list[str] = []
    for target in targets:
        stem = re.sub(r"[^\w.+-]+", "_", target.name).lstrip(".") or "target"
        numbered = (f"{stem}-{number}.html" for number in count(2))
        name = next(name for name in chain([f"{stem}.html"], numbered) if name.casefold() not in taken)
        taken.add(name.casefold())
        names.append(name)
    return names


def _write_target(task: tuple[TurntableResult, TargetResult, Path]) -> None:
    context, target, path = task
    write_text(path, render_target(context, target))
