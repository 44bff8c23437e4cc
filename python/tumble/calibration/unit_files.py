"""The two files that most procedures write of a unit: its page and its calibration."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeVar

from tumble.calibration.document import KIND, Calibration
from tumble.foundation.file_names import unit_stem
from tumble.foundation.files import PAGE, check_output, prepare_folder


class UnitResult(Protocol):
    """Result of a procedure for one unit."""

    @property
    def name(self) -> str:
        """Name of the unit."""

    @property
    def calibration(self) -> Calibration:
        """The calibration made of it."""


_Result = TypeVar("_Result", bound=UnitResult)


def prepare_unit_files(folder: Path | str, name: str, ending: str) -> tuple[Path, Path]:
    """Proves that page and calibration of a unit can be written into `folder`, and returns the path of both.

    Raises `OutputError` where they cannot, or something else stands there.
    """
    folder, stem = prepare_folder(folder), unit_stem(name, ending)
    page, path = folder / f"{stem}.html", folder / f"{stem}.yaml"
    check_output(page, PAGE)
    check_output(path, KIND)
    return page, path


def write_unit_files(
    result: _Result,
    write_page: Callable[[_Result, Path], None],
    folder: Path | str,
    ending: str,
) -> dict[str, Path]:
    """Writes page and calibration of a unit into `folder`; returns the path of each by what it is.

    Raises `OutputError` where a file cannot be written; what stood there before is untouched.
    """
    page, path = prepare_unit_files(folder, result.name, ending)
    write_page(result, page)
    result.calibration.save(path)
    return {"calibration": path, "report": page}
