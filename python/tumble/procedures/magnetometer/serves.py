"""Conditions on a recording whose magnetometer is to be calibrated."""

from __future__ import annotations

from collections.abc import Iterator

from tumble.foundation.services import Evidence, Service, unknown


def services(evidence: Evidence) -> Iterator[Service]:
    """Judges the suitability of a recording."""
    lacking = () if evidence.has_magnetometer else ("a magnetometer, none was recorded",)
    remarks = () if "accelerometer" in evidence.triads else (unknown("accelerometer"),)
    yield evidence.service("magnetometer", lacking, remarks)
