"""The calibration of a unit that a procedure is given: the one that it builds on, or corrects a log with."""

from __future__ import annotations

from pathlib import Path

from tumble.calibration.document import Calibration
from tumble.calibration.turned_axes import in_axes
from tumble.foundation.errors import ProcedureError
from tumble.foundation.log_reading import CORRECTION, LogReading, corrected_alike, read_otherwise
from tumble.foundation.recording import Metadata
from tumble.foundation.serials import are_of_two


def calibration_of(
    given: Calibration | Path | str | None,
    serial: str = "",
    reading: LogReading | None = None,
    *,
    about: str = "",
    option: str = "--calibration",
) -> Calibration | None:
    """Reads the calibration of the unit with a serial number, if one is given; `about` is its log.

    `reading` is how that was read, where it is known. Raises `CalibrationFileError` where the calibration
    cannot be read, `ProcedureError` where it is of another unit, or of a log that was read otherwise.
    """
    if given is None:
        return None
    found = given if isinstance(given, Calibration) else Calibration.load(given)
    if are_of_two(found.serial, serial):
        raise ProcedureError(
            f"{option}: is of unit {found.serial}, the log of unit {serial}; give one of the same unit",
            about=about,
        )
    for why in read_otherwise(reading or {}, found.log_reading, f"that of {option}"):
        raise ProcedureError(f"{why}; read both alike", about=about)
    return found


def applied_first(
    given: Calibration | Path | str | None, log: Metadata, option: str = "--calibration"
) -> Calibration | None:
    """Reads the calibration that a log is corrected with, if one is given, in the axes of that log.

    Raises as `calibration_of`, and where one of the two logs was corrected before and the other was not.
    """
    found = calibration_of(given, log.serial, log.reading, about=log.source, option=option)
    found = None if found is None else in_axes(found, log.body)
    if found is not None and found.log_reading and not corrected_alike(log.reading, found.log_reading):
        was = "corrected already" if log.already_corrected else "not corrected before"
        raise ProcedureError(
            f"was {was}, and that of {option} was read otherwise: give a log with the same correction",
            about=log.source,
        )
    return found


def started_from(start: Calibration | Path | str | None, log: Metadata) -> Calibration | None:
    """Reads the calibration of the unit of the log, if there is one to start from.

    Raises as `calibration_of`, where the log states other axes, and where the effect of temperature would be
    taken off a log that was corrected already.
    """
    before = calibration_of(start, log.serial, log.reading, about=log.source)
    if before is not None and log.body and before.axes and log.body != before.axes:
        raise ProcedureError(
            f"has the axes {log.body}, that of --calibration {before.axes}: sigmas and angles of a "
            "calibration hold in its own; start from one whose log had these axes",
            about=log.source,
        )
    if before is None or not before.temperature_drifts():
        return before
    on_top = before.log_reading.get(CORRECTION) and corrected_alike(log.reading, before.log_reading)
    if log.already_corrected and not on_top:
        raise ProcedureError(
            "was corrected already, so that --calibration would correct it for temperature again; give the "
            "log as recorded",
            about=log.source,
        )
    return before
