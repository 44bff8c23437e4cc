"""The calibration file of a unit that was held in many orientations."""

from __future__ import annotations

from typing import Any

from tumble.calibration.contributions import built_on, log_content
from tumble.calibration.document import Calibration
from tumble.calibration.triad_content import inherited_content, triads_content
from tumble.foundation.gravity import GRAVITY, gravity_content
from tumble.foundation.plain import plain
from tumble.procedures.magnetometer.calibration import magnetometer_content
from tumble.procedures.multipose.result import MultiposeResult


def calibration_of(result: MultiposeResult) -> Calibration:
    """Creates the calibration file, on top of the one that the procedure was started from."""
    content: dict[str, Any] = {
        "name": result.name,
        "serial": result.serial,
        "software": result.software,
        **result.provenance.content(),
        "axes": result.log.axes or None,
        "reading": result.log.reading or None,
        "log": log_content(result.source, result.log),
        "verdict": result.verdict,
        "method": {"procedure": "multipose", "truth": "gravity", "options": plain(result.options)},
        "gravity": gravity_content(result),
    }
    content |= triads_content(result)
    if result.accelerometer.inherited is not None:
        content["accelerometer"]["inherited"] = inherited_content(result.accelerometer, GRAVITY)
    if result.magnetometer is not None:
        content["magnetometer"] = magnetometer_content(result.magnetometer)
    return Calibration.model_validate(built_on(result.start, content))
