"""Files that `tumble align` writes: the settings of the units for `tumble redundancy`, and the page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tumble.foundation.file_names import ALIGN_PAGE, ALIGN_SETTINGS
from tumble.foundation.files import PAGE, check_output, prepare_folder
from tumble.procedures.align.procedure import SETTINGS_KIND, write_settings

if TYPE_CHECKING:
    from tumble.procedures.align.result import AlignResult


def prepare(folder: Path | str) -> tuple[Path, Path]:
    """Proves that settings and page can be written into `folder`, and returns the path of both."""
    folder = prepare_folder(folder)
    settings, page = folder / ALIGN_SETTINGS, folder / ALIGN_PAGE
    check_output(settings, SETTINGS_KIND)
    check_output(page, PAGE)
    return settings, page


def save(result: AlignResult, folder: Path | str) -> dict[str, Path]:
    """Write everything into `folder`; give the path of each file by what it is."""
    from tumble.procedures.align.report.page import ALIGN_REPORT

    settings, page = prepare(folder)
    ALIGN_REPORT.write(result, page)
    write_settings(result, settings)
    return {"settings": settings, "report": page}
