"""Magnetometers of targets beside that of the reference: against truth, disturbed, and in the file."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import tumble
from tumble.tools.simulate import SimulatedTurntable, simulate_turntable

VISITS = ("X up", "X down", "Y up", "Y down", "Z up", "Z down") * 2


def played(**changes: Any) -> SimulatedTurntable:
    return simulate_turntable(
        seed=5,
        grades=("consumer",),
        magnetometer=True,
        perfect_reference=True,
        visits=VISITS,
        heading_turn_deg=55.0,
        rest_seconds=6.0,
        rate_hz=50.0,
        bias_instability=False,
        **changes,
    )


def calibrated(session: SimulatedTurntable) -> tumble.TargetResult:
    result = tumble.turntable(session.reference, session.targets, poses=None)
    return result.targets[0]


def test_m_and_b_are_found_within_their_sigmas_and_kept() -> None:
    session = played()
    result = tumble.turntable(session.reference, session.targets, poses=None)
    (target,) = result.targets
    truth = session.target_units[0].magnetometer
    triad = target.magnetometer
    assert truth is not None
    assert triad is not None
    error = np.concatenate([(triad.M - truth.M).ravel(), triad.b - truth.b])
    assert float(error @ np.linalg.solve(triad.covariance, error)) < 33.0
    section = result.calibration.magnetometer
    assert section is not None
    assert np.allclose(section.M, triad.M)
    assert "relative to the magnetometer of the reference" in " ".join(target.warnings)
    assert target.field is not None
    mounting = session.target_units[0].accelerometer.Q
    relative = tumble.foundation.error_decomposition.factors(truth.M)[2] @ mounting.T  # type: ignore[attr-defined]
    expected = tumble.foundation.error_decomposition.mounting_angles(relative)  # type: ignore[attr-defined]
    for found, angle in zip(target.field.mounting, expected, strict=True):
        assert abs(found.value - angle) < 4.5 * found.sigma


def test_a_magnet_near_one_rest_is_named_and_left_out() -> None:
    target = calibrated(played(disturbed=7))
    assert target.field is not None
    assert [k + 1 for k, rest in enumerate(target.field.rests) if rest.disturbance] == [7]
    assert target.verdict == "calibrated"
    assert any("rest 7 not used" in warning for warning in target.warnings)


def test_a_field_that_differs_at_the_target_is_reported() -> None:
    session = played(field_difference=1.0)
    target = calibrated(session)
    truth = session.target_units[0].magnetometer
    assert target.field is not None
    assert target.field.difference is not None
    assert target.field.difference == pytest.approx([0.0, 0.0, -1.0], abs=0.15)
    assert target.magnetometer is not None
    assert truth is not None
    sigma = np.sqrt(np.diag(target.magnetometer.covariance))
    assert (np.abs(target.magnetometer.b - truth.b) < 5.0 * sigma[9:]).all()


def test_a_reference_without_magnetometer_is_reported() -> None:
    session = played()
    reference = session.reference_unit.samples
    alone = tumble.Recording.from_arrays(
        "reference", reference.time, reference.accelerometer, reference.gyroscope
    )
    (target,) = tumble.turntable(alone, session.targets, poses=None).targets
    assert target.magnetometer is None
    assert target.verdict == "calibrated"
    assert any("the log of the reference has none" in warning for warning in target.warnings)


def clipped(recording: tumble.Recording, share: float) -> tumble.Recording:
    track = recording.magnetic
    assert track is not None
    end = share * np.abs(track.field).max()
    changed = replace(track, field=np.clip(track.field, -end, end))
    return replace(recording, read_magnetic=lambda: changed)


@pytest.mark.parametrize("unit", ["target", "reference"])
def test_rests_beyond_the_range_of_a_magnetometer_are_left_out(unit: str) -> None:
    session = played()
    reference, target = session.reference, session.targets[0]
    if unit == "target":
        target = clipped(target, 0.9)
    else:
        reference = clipped(reference, 0.95)
    (found,) = tumble.turntable(reference, [target], poses=None).targets
    truth = session.target_units[0].magnetometer
    assert truth is not None
    warning = next(each for each in found.warnings if "the magnetometer's range: left out" in each)
    assert warning.startswith("reference: ") == (unit == "reference")
    assert found.magnetometer is not None
    sigma = np.sqrt(np.diag(found.magnetometer.covariance))
    assert (np.abs(found.magnetometer.b - truth.b) < 5.0 * sigma[9:]).all()
