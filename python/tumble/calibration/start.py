"""The calibration of a unit that a procedure is given: the one that it builds on, or corrects a log with."""

from __future__ import annotations

from pathlib import Path

from tumble.calibration.document import Calibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Metadata
from tumble.foundation.serials import are_of_two


def calibration_of(
    given: Calibration | Path | str | None,
    serial: str = "",
    *,
    about: str = "",
    option: str = "--calibration",
) -> Calibration | None:
    """Reads the calibration of the unit with a serial number, if one is given; `about` is its log.

    Raises `CalibrationFileError` where it cannot be read, `ProcedureError` where it is of another unit.
    """
    found = Calibration.load(given) if isinstance(given, str | Path) else given
    if found is not None and are_of_two(found.serial, serial):
        raise ProcedureError(
            f"{option}: is of unit {found.serial}, the log of unit {serial}; give one of the same unit",
            about=about,
        )
    return found


def started_from(start: Calibration | Path | str | None, log: Metadata) -> Calibration | None:
    """Reads the calibration of the unit of the log, if there is one to start from.

    Raises `CalibrationFileError` where it cannot be read, `ProcedureError` where it is of another unit, or
    would take the effect of temperature off a log that was corrected already.
    """
    before = calibration_of(start, log.serial, about=log.source)
    if before is not None and log.already_corrected and before.temperature_drifts():
        raise ProcedureError(
            "was corrected already, so that --calibration would correct it for temperature again; give the "
            "log as recorded",
            about=log.source,
        )
    return before
