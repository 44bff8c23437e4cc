"""The calibration file of a magnetometer, beside what is known of the unit already."""

from __future__ import annotations

from typing import Any

import numpy as np

from tumble.calibration.contributions import built_on, log_content
from tumble.calibration.document import Calibration
from tumble.calibration.triad_content import magnetometer_content as field_content
from tumble.foundation.plain import plain
from tumble.foundation.results import Parameter
from tumble.procedures.magnetometer.result import MagnetometerResult


def calibration_of(result: MagnetometerResult) -> Calibration:
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
        "method": {"procedure": "magnetometer", "truth": "Earth's field", "options": plain(result.options)},
        "magnetometer": magnetometer_content(result),
    }
    return Calibration.model_validate(built_on(result.start, content))


def magnetometer_content(result: MagnetometerResult) -> dict[str, Any]:
    """Returns the section of the magnetometer."""
    triad = result.magnetometer
    content = field_content(triad, "field")
    if result.strength_source != "free":
        content["field"] = _quantity(result.strength, result.strength_source)
    if result.aligned:
        content["dip"] = _quantity(result.dip, "found")
    if result.current:
        content |= {
            "current": np.array([each.value for each in result.current]),
            "current_sigma": np.array([each.sigma for each in result.current]),
            "current_unit": result.current_unit,
        }
    return content


def _quantity(found: Parameter, source: str) -> dict[str, Any]:
    return {"value": found.value, "sigma": found.sigma, "source": source}
