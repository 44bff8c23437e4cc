"""What `tumble spin` writes and prints of a result, from a log or live."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tumble.cli.screen import print_json, print_summary
from tumble.file_names import UnitProcedure, unit_stem

if TYPE_CHECKING:
    from tumble.calibration.document import Calibration
    from tumble.spin.result import SpinResult


def calibration_of(result: SpinResult) -> Calibration:
    """Make the calibration file of what was found, on top of the one that was applied first."""
    from tumble.calibration.document import Calibration

    applied = Calibration.model_validate(dict(result.applied)) if result.applied else None
    return Calibration.from_spin(result, applied)


def prepare(folder: Path | str, name: str, procedure: UnitProcedure) -> tuple[Path, Path]:
    """Prove that page and calibration of a unit can be written into `folder`, and give the path of both."""
    from tumble.calibration.document import SCHEMA
    from tumble.documents import document_kind
    from tumble.files import PAGE, check_output, prepare_folder

    stem = unit_stem(name, procedure)
    folder = prepare_folder(folder)
    page, path = folder / f"{stem}.html", folder / f"{stem}.yaml"
    check_output(page, PAGE)
    check_output(path, document_kind(SCHEMA))
    return page, path


def write_results(result: SpinResult, found: Calibration, folder: Path | str) -> dict[str, Path]:
    """Write everything into `folder`, named after the unit; give the path of each file by what it is."""
    page, path = prepare(folder, result.name, "live" if result.options.get("live") else "spin")
    _write_page(result, page)
    found.save(path)
    return {"calibration": path, "report": page}


@contextmanager
def page_written_meanwhile(
    result: SpinResult, found: Calibration, folder: Path | str
) -> Iterator[dict[str, Path]]:
    """Do what `write_results` does, but write the page beside the block, which samples may not wait for.

    Raises at the end what went wrong with it.
    """
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    page, path = prepare(folder, result.name, "live")
    found.save(path)
    with ProcessPoolExecutor(1, get_context("spawn"), _leave_interrupts_to_others) as aside:
        writing = aside.submit(_write_page, result, page)
        yield {"calibration": path, "report": page}
        writing.result()


def _write_page(result: SpinResult, page: Path) -> None:
    from tumble.spin.report.page import SPIN_REPORT

    SPIN_REPORT.write(result, page)


def _leave_interrupts_to_others() -> None:
    """Have Control-C end what runs beside this, and this where that has ended."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


def show_results(result: SpinResult, found: Calibration, files: dict[str, Path], as_json: bool) -> None:
    """Print what was found, and where it is."""
    from tumble.spin.summary import json_content, screen_summary

    if as_json:
        print_json(json_content(result, found, files))
        return
    print_summary(screen_summary(result))
    print(f"Calibration: {files['calibration']}")
    print(f"Report: {files['report']}")
