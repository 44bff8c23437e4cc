"""A certificate of a reference states quantities: all that follows is finite, or one line refuses it."""

from __future__ import annotations

import copy

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

import certified_references as certified
from tumble.calibration.reference_certificate import read_reference_certificate
from tumble.foundation.days import day_of
from tumble.foundation.errors import CalibrationFileError

GROUPS = ("bias", "scale", "non-orthogonality", "mounting")
NUMBERS = [0.0, -1.0, 1e-320, 1e-9, 0.5, 44.0, -44.0, 1e3, 1e30, -1e30, 1e300, float("inf"), float("nan")]
PLACES = [
    ("k",),
    ("temperature", "low"),
    ("temperature", "high"),
    ("accelerometer", "degrees_of_freedom"),
    *[("accelerometer", group, "U") for group in GROUPS],
    *[("accelerometer", group, "value", axis) for group in GROUPS for axis in range(3)],
    *[("accelerometer", "drift", group) for group in GROUPS],
    *[("accelerometer", "temperature", group) for group in ("bias", "scale")],
]


def changed(content, place, value):
    part = content
    for key in place[:-1]:
        part = part[key]
    part[place[-1]] = value


@given(changes=st.dictionaries(st.sampled_from(PLACES), st.sampled_from(NUMBERS), min_size=1, max_size=3))
def test_any_numbers_are_computed_with_or_refused(tmp_path_factory, changes):
    stated = copy.deepcopy(certified.content(k=2.0))
    for place, value in changes.items():
        changed(stated, place, value)
    path = tmp_path_factory.mktemp("certificate") / "reference.yaml"
    path.write_text(yaml.dump(stated))
    said, found = "", None
    try:
        found = read_reference_certificate(path).certificate
    except CalibrationFileError as error:
        said = str(error)
    assert "\n" not in said
    if found is None:
        assert said.startswith(f"{path}: line ")
        return
    assert found.calibration().accelerometer is not None
    for temperature in (None, (10.0, 20.0, 30.0)):
        for influence in found.influences("accelerometer", certified.day(), temperature):
            assert np.isfinite(influence.covariance).all()
            assert np.diag(influence.covariance).min() >= 0.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"due": certified.day(90).replace("-", "")}, "is no date"),
        ({"due": "2999-W01-1"}, "is no date"),
        ({"temperature": {"low": 50.0, "high": 10.0}}, "low is 50, above high of 10"),
        ({"k": 1e300}, "k needs to be less than or equal to 1000"),
    ],
)
def test_a_certificate_that_would_count_less_is_refused(tmp_path, changes, said):
    path = certified.written(tmp_path / "reference.yaml", **changes)
    with pytest.raises(CalibrationFileError, match=said):
        read_reference_certificate(path)


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        (None, 0.0, "states that a value is exact"),
        ((3, 3), -1.0, "states that a value is exact"),
        ((0, 1), 0.9, "is not symmetric"),
        ((0, 1, 0), 2.0, "has a negative eigenvalue"),
        ((5, 5), 1e20, r"covariance is up to 1e\+20"),
    ],
)
def test_a_matrix_that_is_no_covariance_is_refused(tmp_path, place, value, said):
    matrix = np.eye(12) if place else np.zeros((12, 12))
    for row, column in zip(place or (), (place or ())[1:], strict=False):
        matrix[row, column] = value
    stated = copy.deepcopy(certified.content())
    stated["accelerometer"]["covariance"] = matrix.tolist()
    path = tmp_path / "reference.yaml"
    path.write_text(yaml.dump(stated))
    with pytest.raises(CalibrationFileError, match=said):
        read_reference_certificate(path)


@pytest.mark.parametrize(
    "written", ["20260331", "2026-W14-2", "2026-3-31", "2026-02-30", "\uff12026-03-31", ""]
)
def test_a_day_is_written_in_one_form(written):
    assert day_of(written) is None
    assert str(day_of("2026-03-31")) == "2026-03-31"
