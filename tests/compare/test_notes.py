"""Conditions that limit the comparison of two calibrations are reported."""

import numpy as np
import pytest

from compare_units import drawn, truth
from tumble import Calibration, compare


@pytest.fixture
def units():
    print("seed 21")
    generator = np.random.default_rng(21)
    unit = truth(generator)
    return drawn(generator, unit), drawn(generator, unit)


def with_parts(calibration, **parts):
    return Calibration.model_validate(calibration.content() | parts)


def notes(first, second):
    result = compare([first, second])
    return " ".join((*result.pairs[0].notes, *result.notes))


def test_independence_is_reported_as_assumed(units):
    assert "taken as independent" in notes(*units)


def test_common_log_and_reference_are_reported(units):
    log = {"file": "night.csv", "sha256": "ab" * 32}
    of_one_log = [with_parts(each, log=log) for each in units]
    assert "both were found from one log" in notes(*of_one_log)
    of_one_reference = [with_parts(each, reference={"name": "navigator", "serial": "3"}) for each in units]
    assert "both were calibrated against the reference navigator" in notes(*of_one_reference)
    apart = with_parts(units[0], reference={"name": "navigator", "serial": "4"})
    assert "both were held" not in notes(apart, of_one_reference[1])


def test_a_matrix_that_was_taken_over_does_not_count(units):
    first, second = (each.content() for each in units)
    for key in ("M", "covariance"):
        second["gyroscope"][key] = first["gyroscope"][key]
    pair = compare([units[0], Calibration.model_validate(second)]).pairs[0]
    taken = [each for each in pair.differences if each.reason == "taken over: stands in both alike"]
    assert {each.group.partition(" ")[2] for each in taken} == {"scale", "non-orthogonality", "mounting"}
    assert pair.joint.degrees_of_freedom == 15


def test_parameter_missing_in_either_is_left_out_and_reported(units):
    content = units[1].content()
    covariance = np.array(content["accelerometer"]["covariance"])
    covariance[11, :] = covariance[:, 11] = np.nan
    content["accelerometer"]["covariance"] = covariance
    pair = compare([units[0], Calibration.model_validate(content)]).pairs[0]
    (hidden,) = [each for each in pair.differences if not each.compared]
    assert (hidden.name, hidden.reason) == ("accelerometer bias z", "not known in unit (2)")
    assert pair.joint.degrees_of_freedom == 23


def test_triad_missing_in_one_is_reported(units):
    content = units[1].content()
    del content["gyroscope"]
    without = Calibration.model_validate(content)
    assert "unit (2) has no calibration of the gyroscope, which is not compared" in notes(units[0], without)
    assert compare([units[0], without]).pairs[0].joint.degrees_of_freedom == 12


def test_other_temperatures_without_a_known_drift_are_reported(units):
    warm, cold = (
        with_parts(each, temperature={"low": mean, "mean": mean, "high": mean})
        for each, mean in zip(units, (45.0, 20.0), strict=True)
    )
    assert "made at 20.0 to 45.0 degC, and none knows its drift" in notes(warm, cold)
    assert "none knows its drift" not in notes(*units)


def test_sigmas_alone_will_do_where_a_file_has_no_covariance(units):
    content = units[1].content()
    full = compare(units).pairs[0]
    for triad in ("accelerometer", "gyroscope"):
        rows = {each.name: each for each in compare([units[1], units[1]]).pairs[0].differences}

        def sigmas(group, axes, rows=rows, triad=triad):
            # A calibration compared with itself has root two of its own sigma.
            return [rows[f"{triad} {group} {axis}"].sigma / np.sqrt(2.0) for axis in axes]

        del content[triad]["covariance"]
        content[triad]["sigma"] = {
            "bias": sigmas("bias", "xyz"),
            "scale": sigmas("scale", "xyz"),
            "mounting": sigmas("mounting", "xyz"),
            "non-orthogonality": dict(
                zip(("xy", "yz", "zx"), sigmas("non-orthogonality", ("xy", "yz", "zx")), strict=True)
            ),
        }
    found = compare([units[0], Calibration.model_validate(content)]).pairs[0]
    for each, other in zip(found.differences, full.differences, strict=True):
        # Sigmas of a rotation vector alone do not show how turns about the axes go together.
        rel = 0.1 if "mounting" in each.name else 1e-6
        assert each.sigma == pytest.approx(other.sigma, rel=rel)
