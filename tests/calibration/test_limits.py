"""Limits files as a user writes them, and what passes them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

import made_up_batch as made_up
from tumble.calibration.limits import Limits
from tumble.foundation.errors import CalibrationFileError

SCHEMA = json.loads((Path(__file__).parents[2] / "docs/schema/limits.schema.json").read_text())
WIDE = """\
schema: tumble-limits/1
accelerometer:
  bias: 1.0
  scale: 0.1
  non-orthogonality: {xy: 5, zx: 5}
  mounting: {z: 30}
  residual: 1
  noise-density: 1
  bias-instability: 1
gyroscope:
  bias: 1.0
"""


def limits(tmp_path, text):
    path = tmp_path / "limits.yaml"
    path.write_text(text)
    return Limits.load(path)


def with_parameter(name, value, **changes):
    """A target whose accelerometer has that value for one parameter."""
    triad = made_up.triad()
    edited = tuple(
        replace(parameter, value=value, **changes) if parameter.name == name else parameter
        for parameter in triad.parameters
    )
    assert edited != triad.parameters
    return made_up.target(accelerometer=replace(triad, parameters=edited))


def only(**accelerometer):
    return Limits.model_validate({"accelerometer": accelerometer})


def test_every_limit_of_the_file_is_checked_once(tmp_path):
    checks = limits(tmp_path, WIDE).check(made_up.target())
    names = [check.parameter for check in checks]
    assert len(set(names)) == len(names) == 3 + 3 + 2 + 1 + 3 + 3 + 3 + 3
    assert "accelerometer non-orthogonality yz" not in names
    assert all(check.passed and not check.remark for check in checks)


def test_names_are_those_of_the_parameters(tmp_path):
    names = {f"accelerometer {parameter.name}" for parameter in made_up.triad().parameters}
    everything = only(bias=1, scale=1, mounting=9, **{"non-orthogonality": 9})
    assert {check.parameter for check in everything.check(made_up.target())} == names


@given(value=st.floats(-2.0, 2.0), limit=st.floats(0.0, 1.0))
def test_parameter_passes_exactly_when_its_magnitude_is_within_limit(value, limit):
    check = only(bias={"y": limit}).check(with_parameter("bias y", value))[0]
    assert check.passed == (abs(value) <= limit)
    assert (check.value, check.limit, check.unit) == (value, limit, "m/s^2")


def test_scale_is_limited_by_its_distance_from_one():
    target = with_parameter("scale x", 0.97)
    assert not only(scale={"x": 0.02}).check(target)[0].passed
    assert only(scale={"x": 0.04}).check(target)[0].passed


def test_a_parameter_that_was_not_shown_fails_and_says_why():
    target = made_up.target(gyroscope=made_up.triad("gyroscope", bias_only=True))
    checks = Limits.model_validate({"gyroscope": {"bias": 9, "scale": 9}}).check(target)
    bias, scale = checks[:3], checks[3:]
    assert all(check.passed for check in bias)
    assert not any(check.passed for check in scale)
    assert all(np.isnan(check.value) for check in scale), "a number was given for what is not known"
    assert {check.remark for check in scale} == {"not shown to be within its limit: no rotation was recorded"}


def test_a_triad_that_was_not_calibrated_fails_its_limits():
    checks = Limits.model_validate({"gyroscope": {"bias": 9}}).check(made_up.target(gyroscope=None))
    assert [check.passed for check in checks] == [False, False, False]
    assert "the gyroscope was not calibrated" in checks[0].remark


def test_not_a_number_never_passes():
    assert not only(bias={"x": 1e300}).check(with_parameter("bias x", float("nan")))[0].passed


def test_residuals_are_limited_by_their_root_mean_square():
    triad = replace(made_up.triad(), residuals=np.array([[3.0, 0.0, 0.0], [4.0, 0.0, 0.0]]))
    check = only(residual={"x": 3.6}).check(made_up.target(accelerometer=triad))[0]
    assert check.value == pytest.approx(np.sqrt(12.5))
    assert check.passed


def test_a_target_without_calibration_has_no_checks():
    assert only(bias=1).check(made_up.target(failure="it moved")) == ()


def test_the_file_obeys_the_published_schema():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.validate(yaml.safe_load(WIDE), SCHEMA)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"accelerometer": {"bias": -1}}, SCHEMA)


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        (
            "  scale: 0.1",
            "  scale: -0.1",
            "line 4: accelerometer.scale.x needs to be greater than or equal",
        ),
        ("  scale: 0.1", "  scale: .nan", "accelerometer.scale.x needs to be a finite number"),
        (
            "  scale: 0.1",
            "  scale: small",
            "accelerometer.scale needs a number or a number for each of x",
        ),
        ("  scale: 0.1", "  scales: 0.1", "accelerometer.scales is not a known key, did you mean 'scale'?"),
        ("{z: 30}", "{zx: 30}", "accelerometer.mounting.zx is not a known key"),
        ("gyroscope:", "gyro:", "line 10: gyro is not a known key"),
    ],
)
def test_a_mistake_is_named(tmp_path, old, new, part):
    assert old in WIDE
    with pytest.raises(CalibrationFileError) as caught:
        limits(tmp_path, WIDE.replace(old, new, 1))
    assert part in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["schema: tumble-limits/1\n", "gyroscope: {}\n", "gyroscope: {bias: {}}\n"])
def test_a_file_that_limits_nothing_is_refused(tmp_path, text):
    with pytest.raises(CalibrationFileError, match="limits nothing"):
        limits(tmp_path, text)
