"""Conditions on a recording that is to show the effect of temperature."""

from __future__ import annotations

from collections.abc import Iterator

from tumble import _core
from tumble.foundation.services import Evidence, Service


def services(evidence: Evidence) -> Iterator[Service]:
    """Judges the suitability of a recording."""
    lacking = (*_lacking_temperature(evidence.temperature), *evidence.lacking_still)
    yield evidence.service("thermal", lacking)


def _lacking_temperature(temperature: tuple[float, float] | None) -> tuple[str, ...]:
    if temperature is None:
        return ("a temperature, none was recorded",)
    low, high = temperature
    if high - low >= _core.LEAST_TEMPERATURE_RANGE:
        return ()
    return (f"{_core.LEAST_TEMPERATURE_RANGE:g} K of change in temperature, {high - low:.2g} K found",)
