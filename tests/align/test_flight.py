"""Simulated flights and drives, vibration, quantisation and drift included, aligned from end to end."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import tumble
from tumble.tools.simulate import FlightUnit

UNITS = (
    FlightUnit(grade="industrial", ageing=0.0),
    FlightUnit(lever_arm_m=(0.03, 0.0, 0.0), clock_offset_seconds=0.5, clock_skew_ppm=20.0),
    FlightUnit(
        lever_arm_m=(0.0, -0.02, 0.01),
        mounting_deg=(180.0, 0.0, 0.0),
        rate_hz=100.0,
        clock_offset_seconds=-1.2,
    ),
)


def relative_rotation(primary, secondary):
    """Orthogonal factor of what leads from one gyroscope's readings to the other's."""
    left, _, right = np.linalg.svd(secondary.gyroscope.M @ np.linalg.inv(primary.gyroscope.M))
    return left @ right


def scores(motion, seeds):
    """Errors over sigmas, by what they are of, of all secondaries of all flights."""
    found = {"rotation": [], "time offset": [], "lever arm": []}
    for seed in seeds:
        print(f"seed {seed}")
        flight = tumble.simulate_flight(motion=motion, seed=seed, units=UNITS)
        primary, *secondaries = flight.units
        result = tumble.align(primary.recording, [unit.recording for unit in secondaries])
        for unit, truth, plan in zip(result, secondaries, UNITS[1:], strict=True):
            turned = Rotation.from_matrix(unit.sensor_from_primary @ relative_rotation(primary, truth).T)
            sigma = np.sqrt(np.trace(unit.rotation_covariance) / 3.0)
            found["rotation"] += list(turned.as_rotvec() / sigma)
            shown = plan.clock_offset_seconds + 1e-6 * plan.clock_skew_ppm * unit.reference_time
            found["time offset"].append((unit.time_offset + shown) / unit.time_offset_sigma)
            arm_sigma = np.sqrt(np.diag(unit.lever_arm_covariance))
            found["lever arm"] += list((unit.lever_arm - plan.lever_arm_m) / arm_sigma)
    return found


@pytest.mark.parametrize("motion", ["quadrotor", "vehicle"])
def test_errors_are_about_as_large_as_the_sigmas_say(motion):
    for name, each in scores(motion, range(1, 9)).items():
        score = np.array(each)
        assert np.isfinite(score).all(), name
        assert np.sqrt(np.mean(score**2)) < 1.6, name
        assert np.abs(score).max() < 5.0, name


def test_drive_on_level_ground_shows_rotation_and_lever_arm():
    flight = tumble.simulate_flight(motion="vehicle", seed=3, units=UNITS)
    result = tumble.align(flight.units[0].recording, [flight.units[1].recording])
    assert all(parameter.observable for parameter in result.units[0].parameters)


def test_units_that_stand_all_the_time_are_refused():
    flight = tumble.simulate_flight(seed=4, rest_seconds=30.0)
    first, second, _ = (
        tumble.Recording.from_arrays(
            unit.name, unit.time[:5000], unit.specific_force[:5000], unit.angular_rate[:5000]
        )
        for unit in flight.units
    )
    with pytest.raises(tumble.ProcedureError, match="never turned together with primary"):
        tumble.align(first, [second])
