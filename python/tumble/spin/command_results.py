"""What `tumble spin` writes and prints of a result, from a log or live."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tumble.cli.screen import print_json, print_summary
from tumble.file_names import UnitProcedure, unit_stem

if TYPE_CHECKING:
    from tumble.calibration.document import Calibration
    from tumble.spin.result import SpinResult

SOME_FAILED = 3
"""Exit code where not all was found that was asked for."""


def write_results(
    result: SpinResult, found: Calibration, folder: Path, procedure: UnitProcedure = "spin"
) -> dict[str, str]:
    """Write everything into `folder`, with names of `procedure`; give the path of each file by what it is."""
    from tumble.spin.report.page import write_spin_page

    stem = unit_stem(result.name, procedure)
    page, path = folder / f"{stem}.html", folder / f"{stem}.yaml"
    write_spin_page(result, page)
    found.save(path)
    return {"calibration": str(path), "report": str(page)}


def show_results(result: SpinResult, found: Calibration, files: dict[str, str], as_json: bool) -> None:
    """Print what was found, and where it is."""
    from tumble.spin.summary import json_content, screen_summary

    if as_json:
        print_json(json_content(result, found, files))
        return
    print_summary(screen_summary(result))
    print(f"Calibration: {files['calibration']}")
    print(f"Report: {files['report']}")
