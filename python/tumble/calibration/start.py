"""The calibration that a procedure builds on."""

from __future__ import annotations

from pathlib import Path

from tumble.calibration.document import Calibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Metadata


def started_from(start: Calibration | Path | str | None, log: Metadata) -> Calibration | None:
    """Reads the calibration of the unit of the log, if there is one to start from.

    Raises `CalibrationFileError` where it cannot be read, `ProcedureError` where it is of another unit, or
    would take the effect of temperature off a log that was corrected already.
    """
    before = Calibration.load(start) if isinstance(start, str | Path) else start
    if before is None:
        return None
    if before.serial and log.serial and before.serial != log.serial:
        raise ProcedureError(
            f"--calibration: is of unit {before.serial}, the log of unit {log.serial}; give one of the "
            "same unit",
            about=log.source,
        )
    if log.already_corrected and before.temperature_drifts():
        raise ProcedureError(
            "was corrected already, so that --calibration would correct it for temperature again; give the "
            "log as recorded",
            about=log.source,
        )
    return before
