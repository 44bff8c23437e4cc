"""What `tumble multipose` writes and prints of a result."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tumble.cli.screen import print_json, print_summary
from tumble.file_names import unit_stem

if TYPE_CHECKING:
    from tumble.multipose.result import MultiposeResult


def prepare(folder: Path | str, name: str) -> tuple[Path, Path]:
    """Prove that page and calibration of a unit can be written into `folder`, and give the path of both."""
    from tumble.calibration.document import KIND
    from tumble.files import PAGE, check_output, prepare_folder

    stem = unit_stem(name, "multipose")
    folder = prepare_folder(folder)
    page, path = folder / f"{stem}.html", folder / f"{stem}.yaml"
    check_output(page, PAGE)
    check_output(path, KIND)
    return page, path


def write_results(result: MultiposeResult, folder: Path | str) -> dict[str, Path]:
    """Write everything into `folder`, named after the unit; give the path of each file by what it is."""
    from tumble.calibration.document import Calibration
    from tumble.multipose.report.page import MULTIPOSE_REPORT

    page, path = prepare(folder, result.name)
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
