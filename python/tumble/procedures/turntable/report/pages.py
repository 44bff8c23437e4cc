"""Writing the pages: one file for the batch and one a target, each complete in itself."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING

from tumble.foundation.file_names import TAKEN, TURNTABLE_PAGE, file_stem
from tumble.foundation.files import PAGE, prepare_folder, write_text
from tumble.foundation.translation import language, speak
from tumble.foundation.workers import WorkerContext, begin
from tumble.procedures.turntable.record import TargetRecord
from tumble.procedures.turntable.report.batch_page import batch_page
from tumble.procedures.turntable.report.records import record_of
from tumble.procedures.turntable.report.target_page import target_page
from tumble.procedures.turntable.result import TargetResult, TurntableResult
from tumble.report.identity import Identity
from tumble.report.page import plot, render

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TARGETS_PER_TASK = 8


def write_reports(result: TurntableResult, directory: Path | str, *, jobs: int = 1) -> list[Path]:
    """Writes `turntable.html` and a page for each target into `directory`, which is made where it is missing.

    With `jobs` above one, that many processes draw; the pages are the same. The batch page comes last, so
    that its links lead somewhere. Returns the paths, the batch page first.

    Raises `OutputError` where a file cannot be written; what stood there before is untouched.
    """
    directory = prepare_folder(directory)
    names = page_names(result.targets)
    paths = [directory / name for name in names]
    context = replace(result, targets=())
    tasks = [(context, target) for target in result.targets]
    workers = min(jobs, -(-len(tasks) // _TARGETS_PER_TASK))
    if workers > 1:
        with drawing_processes(workers) as pool:
            _write_all(paths, pool.map(_draw, tasks, chunksize=_TARGETS_PER_TASK))
    else:
        _write_all(paths, map(_draw, tasks))
    batch = directory / TURNTABLE_PAGE
    write_text(batch, render_batch(result, records_of(result)), PAGE)
    return [batch, *paths]


def render_target(result: TurntableResult, target: TargetResult) -> str:
    """Renders the page of one target as HTML."""
    page = target_page(result, target)
    started = target.log.time.date
    identity = Identity("Turntable", target.name, target.serial, target.provenance, result.software, started)
    return render(
        "tumble.procedures.turntable.report", "target.html.j2", identity, page=page, batch_page=TURNTABLE_PAGE
    )


def plot_target(result: TurntableResult, target: TargetResult, figure: str | None) -> Figure:
    """Draws the figures of a target's page with matplotlib, or the one of that name."""
    return plot(target_page(result, target), figure, target.name)


def plot_batch(result: TurntableResult, figure: str | None) -> Figure:
    """Draws the figures of the batch's page with matplotlib, or the one of that name."""
    return plot(batch_page(result, records_of(result)), figure, type(result).__name__)


def render_batch(batch: TurntableResult, records: Iterable[TargetRecord]) -> str:
    """Renders the page of all targets on record as HTML; `batch` is what those of the last run share."""
    page = batch_page(batch, records)
    identity = Identity(
        "Turntable", page.title, page.serials, page.provenance, batch.software, batch.reference.log.time.date
    )
    return render("tumble.procedures.turntable.report", "batch.html.j2", identity, page=page)


def records_of(result: TurntableResult) -> Iterator[TargetRecord]:
    """Returns the records of targets in memory, all with pages of their own."""
    for target, page in zip(result.targets, page_names(result.targets), strict=True):
        yield record_of(result, target, page.removesuffix(".html"))


def page_names(targets: Sequence[TargetResult]) -> list[str]:
    """Chooses file names for the targets' pages: their own where a file can bear it, and none twice."""
    taken = set(TAKEN)
    names: list[str] = []
    for target in targets:
        stem = file_stem(target.name)
        numbered = (f"{stem}-{number}" for number in count(2))
        name = next(name for name in chain([stem], numbered) if name.casefold() not in taken)
        taken.add(name.casefold())
        names.append(f"{name}.html")
    return names


def drawing_processes(workers: int) -> ProcessPoolExecutor:
    """Starts processes that draw pages in the language of this context."""
    return ProcessPoolExecutor(workers, WorkerContext(), _begin_to_draw, (language(),))


def _begin_to_draw(language_of_pages: str) -> None:
    begin()
    speak(language_of_pages)


def _draw(task: tuple[TurntableResult, TargetResult]) -> str:
    return render_target(*task)


def _write_all(paths: Sequence[Path], pages: Iterable[str]) -> None:
    for path, page in zip(paths, pages, strict=True):
        write_text(path, page, PAGE)
