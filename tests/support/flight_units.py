"""Units without errors, and flights without vibration, to hold simulated flights against."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tumble import simulate_flight
from tumble.tools.simulate import FlightUnit, Grade, Vibration

CALM = Vibration(specific_force=0.0, angular_rate=0.0, tones_hz=(), band_hz=(60.0, 140.0))
GRAVITY = 9.80665


def without_errors():
    grade = Grade.named("reference")
    none = {"noise_density": 0.0, "turn_on_bias": 0.0, "temperature_coefficient": 0.0, "range": 1e9}
    return replace(
        grade,
        accelerometer=replace(grade.accelerometer, **none),
        gyroscope=replace(grade.gyroscope, **none),
    )


def ideal(**changes):
    """A unit that measures the truth of its place at an instant; its samples fall on the primary's."""
    exact = {"grade": without_errors(), "perfect": True, "ageing": 0.0, "phase": 0.0, "filtered": False}
    return FlightUnit(**exact | changes)


def fly(**changes):
    """A short calm flight of one unit without errors; the seed is printed for whoever looks at a failure."""
    scenario = {
        "units": (ideal(),),
        "vibration": CALM,
        "rest_seconds": 4.0,
        "motion_seconds": 20.0,
        "bias_instability": False,
        "quantisation": False,
    } | changes
    print(f"seed {scenario.get('seed', 1)}")
    return simulate_flight(**scenario)


def within(times, spans):
    """(n,) whether each time lies in one of the spans (k, 2)."""
    return np.any([(times >= start) & (times <= end) for start, end in spans], axis=0)
