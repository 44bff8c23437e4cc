"""Parameters that a motion does not show are reported as not observable, without a number."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import tumble
from align_motions import Motion, Sensor, drawn, errors, recordings
from tumble.foundation.errors import ProcedureError
from tumble.procedures.align.procedure import unit_settings

UPRIGHT = Motion(31, turning=(0.0, 0.0, 1.0), pushing=1.0)
WITHOUT_PUSHES = Motion(31, turning=(0.0, 0.0, 1.0), pushing=0.0)


def align_pair(motion, primary=None, secondary=None, seconds=60.0, **options):
    pair = (primary or Sensor(), secondary or drawn(motion.seed))
    first, second = recordings(motion, pair, seconds)
    return tumble.align(first, [second], **options)


def hidden(unit):
    return {parameter.name for parameter in unit.parameters if not parameter.observable}


def test_turning_about_gravity_leaves_rotation_and_lever_arm_open():
    result = align_pair(WITHOUT_PUSHES)
    unit = result.units[0]
    assert {f"{what} {axis}" for what in ("rotation", "lever arm") for axis in "xyz"} <= hidden(unit)
    assert unit.sensor_from_primary is None
    assert np.isnan(unit.rotation_vector).all()
    assert np.isnan(unit.lever_arm).all()
    assert unit.time_offset == pytest.approx(drawn(31).offset, abs=1e-4)
    assert set(unit_settings(result)["unit_1"]) == {"time_offset"}


def test_the_axis_about_which_the_rotation_is_open_is_named():
    unit = align_pair(WITHOUT_PUSHES).units[0]
    up = drawn(31).sensor_from_body.apply([0.0, 0.0, 1.0])
    assert len(unit.rotation_unseen) == 1
    assert abs(unit.rotation_unseen[0] @ up) == pytest.approx(1.0, abs=1e-3)
    reason = unit.parameter("rotation x").reason
    assert "about one axis only" in reason
    assert "turn the units about two axes or more" in reason


def test_pushes_across_the_only_axis_show_and_report_its_rotation():
    secondary = drawn(31)
    unit = align_pair(UPRIGHT).units[0]
    assert unit.rotation_from_accelerometers
    assert any("what the accelerometers show" in warning for warning in unit.warnings)
    turned = Rotation.from_matrix(unit.sensor_from_primary) * secondary.sensor_from_body.inv()
    sigma = np.sqrt(np.linalg.eigvalsh(unit.rotation_covariance).max())
    assert turned.magnitude() < 4.0 * sigma
    error, sigma = errors(unit, Sensor(), secondary, 60.0)["lever arm"]
    assert np.all(np.abs(error[:2]) < 6.0 * sigma[:2])


def test_lever_arm_is_observable_across_the_only_axis_not_along_it():
    unit = align_pair(UPRIGHT).units[0]
    assert hidden(unit) == {"lever arm z"}
    assert np.isnan(unit.lever_arm[2])
    assert np.isfinite(unit.lever_arm[:2]).all()
    assert "along which a lever arm has no effect" in unit.parameter("lever arm z").reason


def test_lever_arm_along_an_askew_only_axis_is_not_observable():
    askew = Sensor(sensor_from_body=Rotation.from_rotvec([0.7, 0.5, 0.0]))
    unit = align_pair(UPRIGHT, askew).units[0]
    assert {"lever arm x", "lever arm y", "lever arm z"} <= hidden(unit)


def test_a_lever_arm_not_observable_is_left_out_of_the_settings():
    assert set(unit_settings(align_pair(UPRIGHT))["unit_1"]) == {"sensor_from_primary", "time_offset"}


def test_gentler_turning_widens_the_sigma_of_the_lever_arm():
    sigmas = [
        np.sqrt(np.trace(align_pair(Motion(32, turning=(turning,) * 3)).units[0].lever_arm_covariance))
        for turning in (2.0, 0.5, 0.1)
    ]
    assert sigmas[0] < 0.5 * sigmas[1] < 0.25 * sigmas[2]


def test_units_that_never_turned_are_refused():
    with pytest.raises(
        ProcedureError, match=r"^unit_1: never turned together with unit_0: .* turn the units together"
    ):
        align_pair(Motion(33, turning=(0.0, 0.0, 0.0)))


def test_units_that_were_pushed_but_not_turned_are_refused_too():
    with pytest.raises(ProcedureError, match="never turned"):
        align_pair(Motion(33, turning=(0.0, 0.0, 0.0), pushing=5.0))


def test_motion_that_repeats_itself_leaves_the_offset_open():
    with pytest.raises(
        ProcedureError, match=r"s fit equally well, since the motion repeats itself; move irregularly"
    ):
        align_pair(Motion(34, period=2.0), secondary=drawn(34, offset=0.3))


def test_search_option_of_the_refusal_settles_the_offset():
    secondary = drawn(34, offset=0.3)
    unit = align_pair(Motion(34, period=2.0), secondary=secondary, search=0.9).units[0]
    assert unit.time_offset == pytest.approx(0.3, abs=1e-4)


def test_units_that_moved_apart_are_refused():
    first, _ = recordings(Motion(35), (Sensor(), Sensor()), 30.0)
    _, second = recordings(Motion(36), (Sensor(), Sensor()), 30.0)
    with pytest.raises(ProcedureError, match="does not show the motion of unit_0"):
        tumble.align(first, [second])


def test_offset_beyond_the_search_needs_a_larger_search():
    secondary = drawn(37, offset=8.0)
    with pytest.raises(ProcedureError, match=r"within 5 s; .* give a larger --search"):
        align_pair(Motion(37), secondary=secondary)
    unit = align_pair(Motion(37), secondary=secondary, search=12.0).units[0]
    assert unit.time_offset == pytest.approx(8.0, abs=1e-3)
