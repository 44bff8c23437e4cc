"""Files that a live spin writes while samples go on."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tumble.procedures.spin.result import SpinResult


@contextmanager
def page_written_meanwhile(result: SpinResult, folder: Path | str) -> Iterator[dict[str, Path]]:
    """Write page and calibration into `folder`, the page beside the block, for which samples may not wait.

    Raises at the end what went wrong with it.
    """
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    from tumble.calibration.unit_files import prepare_unit_files

    page, path = prepare_unit_files(folder, result.name, "live")
    result.calibration.save(path)
    with ProcessPoolExecutor(1, get_context("spawn"), _leave_interrupts_to_others) as aside:
        writing = aside.submit(_write_page, result, page)
        yield {"calibration": path, "report": page}
        writing.result()


def _write_page(result: SpinResult, page: Path) -> None:
    from tumble.procedures.spin.report.page import SPIN_REPORT

    SPIN_REPORT.write(result, page)


def _leave_interrupts_to_others() -> None:
    """Lets Control-C end what runs beside this, and then this."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
