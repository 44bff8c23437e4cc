"""Errors that calibrations inherit: shared by two, or of each by itself."""

import numpy as np
import pytest

import certified_references as certified
import tumble
from compare_units import drawn, truth
from tumble import Calibration, compare
from tumble.calibration.triad_content import sigma_content

SIGMA = 1e-3
"""1-sigma of each element of an inherited M."""


def inheriting(calibration, error, reference):
    """A calibration whose gyroscope errs by what it inherited from a reference of that hash."""
    content = calibration.content()
    section = content["gyroscope"]
    covariance = np.diag([SIGMA**2] * 9 + [0.0] * 3)
    M = np.array(section["M"]) + error
    inherited = {
        "source": "certificate",
        "sigma": sigma_content(M, covariance),
        "covariance": covariance,
    }
    whole = {key: value for key, value in section.items() if key not in ("K", "L", "Q", "angles")}
    content["gyroscope"] = {**whole, "M": M, "inherited": inherited}
    content["reference"] = {"name": "reference", "serial": "R-1", "calibration_hash": reference}
    return Calibration.model_validate(content)


@pytest.fixture
def unit():
    """Two calibrations of one unit, and errors of two references."""
    random = np.random.default_rng(41)
    print("seed 41")
    true = truth(random)
    errors = random.normal(0.0, SIGMA, (2, 3, 3))
    return drawn(random, true), drawn(random, true), errors


def test_errors_of_one_reference_are_in_no_difference(unit):
    first, second, (error, _) = unit
    found = compare([inheriting(first, error, "a"), inheriting(second, error, "a")]).pairs[0]
    assert found.verdict == "same"
    plain = compare([first, second]).pairs[0]
    sigmas = [row.sigma for row in found.differences if row.name == "gyroscope scale x"]
    assert sigmas == pytest.approx(
        [r.sigma for r in plain.differences if r.name == "gyroscope scale x"], rel=0.01
    )


def test_errors_of_two_references_are_in_the_sigma_of_a_difference(unit):
    first, second, (error, other) = unit
    found = compare([inheriting(first, error, "a"), inheriting(second, other, "b")]).pairs[0]
    assert found.verdict == "same"
    sigma = next(row.sigma for row in found.differences if row.name == "gyroscope scale x")
    assert sigma > np.sqrt(2.0) * SIGMA * 0.9
    assert any("inherited from reference or gravity are within the sigmas" in note for note in found.notes)


def test_an_error_that_only_one_inherited_counts_too(unit):
    first, second, (error, _) = unit
    found = compare([first, inheriting(second, error, "a")]).pairs[0]
    assert found.verdict == "same"


def test_two_targets_of_one_certificate_differ_without_its_error(tmp_path):
    """The whole way: two sessions of one unit and one certificate that is wrong by five times the noise."""
    from turntable_sessions import simulate

    wrong = certified.content()
    wrong["gyroscope"]["scale"]["value"] = [1.0005, 0.9995, 1.0005]
    calibrations = []
    for seed in (51, 52):
        session = simulate(seed, grades=("tactical",))
        result = tumble.turntable(
            session.reference,
            session.targets,
            reference_certificate=certified.ReferenceCertificate.model_validate(wrong),
        )
        calibrations.append(result.calibration_of(result[0]))
    own, whole = (
        np.sqrt(np.diag(each)[0])
        for each in (calibrations[0].gyroscope.covariance, calibrations[0].gyroscope.total_covariance)
    )
    assert whole > 3.0 * own
    row = next(r for r in compare(calibrations).pairs[0].differences if r.name == "gyroscope scale x")
    assert row.sigma < 0.5 * whole
