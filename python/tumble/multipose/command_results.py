"""What `tumble multipose` writes and prints of a result."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tumble.cli.screen import print_json, print_summary

if TYPE_CHECKING:
    from tumble.multipose.result import MultiposeResult


def write_results(result: MultiposeResult, folder: Path | str) -> dict[str, Path]:
    """Write everything into `folder`, named after the unit; give the path of each file by what it is."""
    from tumble.calibration.document import Calibration
    from tumble.calibration.unit_files import prepare_unit_files
    from tumble.multipose.report.page import MULTIPOSE_REPORT

    page, path = prepare_unit_files(folder, result.name, "multipose")
    MULTIPOSE_REPORT.write(result, page)
    Calibration.from_multipose(result).save(path)
    return {"calibration": path, "report": page}


def show_results(result: MultiposeResult, files: dict[str, Path], as_json: bool) -> None:
    """Print what was found, and where it is."""
    from tumble.multipose.summary import json_content, screen_summary

    if as_json:
        print_json(json_content(result, files))
        return
    print_summary(screen_summary(result))
    print(f"Calibration: {files['calibration']}")
    print(f"Report: {files['report']}")
