"""The two files that most procedures write of a unit: its page and its calibration."""

from __future__ import annotations

from pathlib import Path

from tumble.calibration.document import KIND
from tumble.file_names import UnitProcedure, unit_stem
from tumble.files import PAGE, check_output, prepare_folder


def prepare_unit_files(folder: Path | str, name: str, procedure: UnitProcedure) -> tuple[Path, Path]:
    """Prove that page and calibration of a unit can be written into `folder`, and give the path of both.

    Raises `OutputError` where they cannot, or something else stands there.
    """
    folder, stem = prepare_folder(folder), unit_stem(name, procedure)
    page, path = folder / f"{stem}.html", folder / f"{stem}.yaml"
    check_output(page, PAGE)
    check_output(path, KIND)
    return page, path
