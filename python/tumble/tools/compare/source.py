"""Calibrations as they are named: files of Tumble, and those of other programs that Tumble reads."""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias

from tumble.calibration.document import KIND, Calibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.file_status import is_file
from tumble.foundation.words import join
from tumble.logs.spec import parse_spec
from tumble.tools.exchange.procedure import IMPORT, import_calibrations

CalibrationSource: TypeAlias = Calibration | Path | str


def open_calibration(source: CalibrationSource) -> Calibration:
    """Returns one calibration: FILE, or FILE:NAME for one IMU of several in a file of another program.

    Raises `TumbleError`, in one line, where there is no such file, it cannot be read, or the IMU
    is ambiguous.
    """
    if isinstance(source, Calibration):
        return source
    spec = parse_spec(source)
    if not _is_of_another_program(spec.path):
        return Calibration.load(spec.path)
    found = {each.name: each for each in import_calibrations(spec.path)}
    if spec.imu is None and len(found) == 1:
        return next(iter(found.values()))
    if spec.imu in found:
        return found[spec.imu]
    wanted = f"holds {join(list(found))}; name one, as in {spec.path}:{next(iter(found))}"
    raise ProcedureError(wanted, about=str(spec.path))


def _is_of_another_program(path: Path) -> bool:
    """True for a file to import; folders, devices and pipes are left to the loader of calibrations."""
    return is_file(path) and path.suffix != ".yml" and not KIND.begins(path)


def date_of(calibration: Calibration) -> str:
    """Date of the calibration, that of the last contribution included; empty for an import."""
    if calibration.method is not None and calibration.method.procedure == IMPORT:
        return ""
    return max([calibration.date, *(each.date for each in calibration.contributions or ())])
