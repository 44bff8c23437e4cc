"""The calibration file of a target of a turntable batch."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from tumble.calibration.contributions import log_content
from tumble.calibration.document import Calibration
from tumble.calibration.triad_content import inherited_content, magnetometer_content, triads_content
from tumble.foundation.errors import ProcedureError
from tumble.foundation.gravity import gravity_content
from tumble.foundation.plain import plain
from tumble.foundation.results import TriadResult
from tumble.procedures.turntable.result import SharedField, TargetResult, TurntableResult


def calibration_of(batch: TurntableResult, target: TargetResult) -> Calibration:
    """Creates the calibration file of one target.

    Raises `ProcedureError` where the target could not be calibrated.
    """
    if target.failure:
        raise ProcedureError(f"{target.name}: has no calibration to save: {target.failure}")
    return Calibration.model_validate(_content(batch, target))


def _content(batch: TurntableResult, target: TargetResult) -> dict[str, Any]:
    reference = batch.reference
    content: dict[str, Any] = {
        "name": target.name,
        "serial": target.serial,
        "software": batch.software,
        **target.provenance.content(),
        "axes": target.log.axes or None,
        "reading": target.log.reading or None,
        "log": log_content(target.source, target.log),
        "verdict": target.verdict,
        "limits": batch.limits or None,
        "decision": target.decision,
        "method": {"procedure": "turntable", "truth": batch.truth, "options": plain(batch.options)},
        "reference": {
            "name": reference.name,
            "serial": reference.serial,
            "calibration_hash": reference.calibration_hash,
            "log": log_content(reference.source, reference.log),
            "uncertainty": asdict(reference.uncertainty),
            "certificate": reference.certificate,
        },
        "gravity": gravity_content(batch),
    }
    content |= triads_content(target)
    if target.responses:
        content["gyroscope"]["constant_rates"] = [asdict(each) for each in target.responses]
    if target.magnetometer is not None and target.field is not None:
        content["magnetometer"] = _magnetometer(target.magnetometer, target.field)
    for triad in (target.accelerometer, target.gyroscope):
        if triad is not None and triad.inherited is not None:
            content[triad.triad]["inherited"] = inherited_content(triad, batch.inherited_from(triad.triad))
    for name, budgets in target.budgets.items():
        content[name]["budget"] = budgets
    return content


def _magnetometer(triad: TriadResult, field: SharedField) -> dict[str, Any]:
    content = magnetometer_content(triad, field.uncertainty)
    if field.calibrated_reference:
        content["field"] = {
            "value": field.strength,
            "sigma": field.strength_sigma,
            "source": "magnetometer of the reference",
        }
    return content
