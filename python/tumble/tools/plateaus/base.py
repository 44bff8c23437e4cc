"""Contents of the calibration file beside M, b and their change with temperature, from all sessions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from tumble.calibration.document import Calibration, GyroscopeCalibration, TriadCalibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.units import CALIBRATED_TRIADS

_SHARED = ("axes", "reading", "gravity", "reference")
"""Keys of a calibration that the file keeps where all sessions agree."""
_OF_A_TRIAD = (
    *("unit", "estimated", "unobservable", "rank", "noise_density", "bias_instability", "random_walk"),
    *("noise_density_for_filters", "random_walk_for_filters"),
    *("field", "dip", "current", "current_sigma", "current_unit"),
)
"""Keys of a triad that the file takes from the session next to the reference."""


class AtTemperature(Protocol):
    """One calibration and its temperature."""

    @property
    def calibration(self) -> Calibration:
        """The calibration."""

    @property
    def temperature(self) -> float:
        """Temperature, degC."""


def base_of(sessions: Sequence[AtTemperature], reference: float) -> dict[str, Any]:
    """Gathers what the sessions state beside M, b and their covariance.

    Raises `ProcedureError` where some fitted the response to specific force and others did not.
    """
    contents = [each.calibration.content() for each in sessions]
    nearest = min(sessions, key=lambda each: abs(each.temperature - reference)).calibration
    base: dict[str, Any] = {
        key: contents[0][key]
        for key in _SHARED
        if all(each.get(key) == contents[0].get(key) for each in contents) and key in contents[0]
    }
    if "reference" not in base and "reference" in contents[0]:
        base |= _shared_reference(contents)
    for triad in CALIBRATED_TRIADS:
        section = getattr(nearest, triad)
        if section is None:
            continue
        content = nearest.content()[triad]
        base[triad] = {key: content[key] for key in _OF_A_TRIAD if key in content}
        sections = [getattr(each.calibration, triad) for each in sessions]
        if None in sections:
            continue
        base[triad] |= _inherited(sections)
        if isinstance(section, GyroscopeCalibration):
            base[triad] |= _response(sections)
    return base


def _shared_reference(contents: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Returns the reference without its log, where all sessions name the same."""
    found = [{k: v for k, v in each.get("reference", {}).items() if k != "log"} for each in contents]
    return {"reference": found[0]} if all(each == found[0] for each in found) else {}


def _inherited(sections: Sequence[TriadCalibration | None]) -> dict[str, Any]:
    """Returns the mean of what all sessions inherit from one source."""
    found = [None if each is None else each.inherited for each in sections]
    known = [each for each in found if each is not None]
    if len(known) < len(found) or len({each.source for each in known}) > 1:
        return {}
    mean = np.mean([each.covariance for each in known], axis=0)
    return {"inherited": {"source": known[0].source, "covariance": mean}}


def _response(sections: Sequence[GyroscopeCalibration | None]) -> dict[str, Any]:
    """Returns the mean g-sensitivity, weighted by its sigmas."""
    found = [each for each in sections if each is not None]
    having = [each for each in found if each.g_sensitivity is not None]
    if not having:
        return {}
    if len(having) < len(found):
        raise ProcedureError(
            "some calibrations hold the g-sensitivity of the gyroscope and others do not, so that their "
            "biases differ; fit it in all, or in none"
        )
    values = np.array([each.g_sensitivity for each in having])
    sigmas = np.array(
        [np.nan if each.g_sensitivity_sigma is None else each.g_sensitivity_sigma for each in having]
    )
    weights = np.broadcast_to(sigmas, values.shape) ** -2.0
    if not np.isfinite(weights).all():
        return {"g_sensitivity": values.mean(axis=0)}
    total = weights.sum(axis=0)
    return {"g_sensitivity": (weights * values).sum(axis=0) / total, "g_sensitivity_sigma": total**-0.5}
