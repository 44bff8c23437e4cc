"""A magnetometer in calibrations that are built up, in limits and in the registry."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

import made_up_batch as made_up
from made_up_calibrations import made_up as made_up_calibration
from tumble.calibration.contributions import built_on, taken_over
from tumble.calibration.document import Calibration
from tumble.calibration.limits import Limits
from tumble.laboratory.results import limit_of, read_result

SIGMA = {
    "bias": [0.1, 0.2, np.nan],
    "scale": [1e-3] * 3,
    "non-orthogonality": dict.fromkeys(("xy", "yz", "zx"), 0.01),
    "mounting": [0.1] * 3,
}
SECTION = {
    "M": np.eye(3),
    "b": [20.0, -30.0, 5.0],
    "sigma": SIGMA,
    "estimated": ("bias",),
    "current": [1.0, 2.0, 3.0],
    "current_sigma": [0.1, 0.1, 0.1],
}


def with_magnetometer():
    content = made_up_calibration().content() | {"magnetometer": SECTION}
    return Calibration.model_validate(content)


def test_a_new_accelerometer_keeps_the_magnetometer_and_its_origin():
    before = with_magnetometer().content()
    found = {"accelerometer": before["accelerometer"], "method": {"procedure": "multipose"}}
    content = built_on(before, found)
    assert content["magnetometer"] == before["magnetometer"]
    (kept,) = content["contributions"]
    assert kept["gave"] == ("magnetometer bias", "magnetometer current")
    assert kept["method"]["procedure"] == "turntable"


def test_a_new_magnetometer_replaces_its_parts_only():
    before = with_magnetometer().content()
    kept = taken_over(before, ["magnetometer bias", "magnetometer matrix", "magnetometer current"])
    (own,) = kept["contributions"]
    assert own["gave"]
    assert all(part.startswith("accelerometer ") for part in own["gave"])


def test_a_magnetometer_is_limited_by_procedures_that_calibrate_it():
    limits = Limits.model_validate({"magnetometer": {"bias": 25.0}})
    assert limits.check(SimpleNamespace(failure="", gyroscope=made_up.triad())) == ()
    assert {check.remark for check in limits.check(made_up.target())} == {
        "not shown to be within its limit: the magnetometer was not calibrated"
    }

    class Unit:
        failure = ""
        magnetometer = replace(made_up.triad(), triad="magnetometer", unit="uT")

    checks = limits.check(Unit())
    assert [check.parameter for check in checks] == [f"magnetometer bias {axis}" for axis in "xyz"]
    assert {check.unit for check in checks} == {"uT"}
    assert limit_of(limits, "magnetometer bias x") == 25.0


def test_registry_keeps_what_a_magnetometer_shows(tmp_path):
    with_magnetometer().save(tmp_path / "unit.yaml")
    numbers = {each.name: each for each in read_result(tmp_path / "unit.yaml").parameters}
    bias, effect = numbers["magnetometer bias x"], numbers["magnetometer current z"]
    assert (bias.value, bias.unit, bias.u) == (20.0, "uT", 0.1)
    assert numbers["magnetometer bias z"].value is None
    assert (effect.value, effect.unit, effect.u) == (3.0, "uT per A", 0.1)
