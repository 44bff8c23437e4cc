"""Units in which logs hold readings, with their values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.units import FIELD_UNITS, CalibratedTriad

UNIT_VALUES: Final[Mapping[CalibratedTriad, Mapping[str, float]]] = {
    "accelerometer": {"m/s^2": 1.0, "g": STANDARD_GRAVITY, "mg": 1e-3 * STANDARD_GRAVITY, "cm/s^2": 0.01},
    "gyroscope": {
        "rad/s": 1.0,
        "deg/s": math.pi / 180.0,
        "mrad/s": 1e-3,
        "mdeg/s": 1e-3 * math.pi / 180.0,
        "rpm": 2.0 * math.pi / 60.0,
    },
    "magnetometer": FIELD_UNITS,
}
"""SI value of one unit; microtesla for a magnetometer. Scales without a unit are of the first."""
