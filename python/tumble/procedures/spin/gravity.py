"""Share of an uncertain gravity in the accelerometer bias of a spin (docs/theory/uncertainty.md)."""

from __future__ import annotations

from tumble.calibration.document import Calibration
from tumble.foundation.gravity import LocalGravity, shares_gravity


def bias_sigma(place: LocalGravity, applied: Calibration | None) -> float:
    """1-sigma, m/s^2, of the bias along the vertical; 0 where nobody states that of gravity.

    Scale that was found with the same gravity errs by as much the other way.
    """
    if applied is not None and shares_gravity(applied.content(), place.value, place.source):
        return 0.0
    return place.sigma or 0.0
