"""Files that a live spin writes while samples go on."""

from __future__ import annotations

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

    from tumble.calibration.unit_files import prepare_unit_files
    from tumble.foundation.workers import WorkerContext

    page, path = prepare_unit_files(folder, result.name, "live")
    result.calibration.save(path)
    # It takes no Ctrl-C, which ends what runs beside it, and then this.
    with ProcessPoolExecutor(1, WorkerContext()) as aside:
        writing = aside.submit(_write_page, result, page)
        yield {"calibration": path, "report": page}
        writing.result()


def _write_page(result: SpinResult, page: Path) -> None:
    from tumble.procedures.spin.report.page import SPIN_REPORT

    SPIN_REPORT.write(result, page)
