"""Certificates of references: what is read, what is refused, and the calibration that follows."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml

import certified_references as certified
from tumble.calibration.reference_certificate import (
    CertifiedTriad,
    read_reference_certificate,
    refuse_unfit_certificate,
    years_between,
)
from tumble.foundation.error_decomposition import factor_sigma, factors, mounting_angles, non_orthogonality
from tumble.foundation.errors import CalibrationFileError

SCHEMA = json.loads((Path(__file__).parents[2] / "docs/schema/reference-certificate.schema.json").read_text())


def section(**changes):
    return {**certified.content()["accelerometer"], **changes}


def test_calibration_holds_the_values_and_u_over_k():
    values = {
        "bias": {"value": [0.01, -0.02, 0.03], "U": [2e-3, 4e-3, 6e-3]},
        "scale": {"value": [1.01, 0.99, 1.02], "U": 4e-4},
        "non-orthogonality": {"value": [0.3, -0.2, 0.1], "U": 0.02},
        "mounting": {"value": [1.0, -2.0, 0.5], "U": 0.03},
    }
    found = certified.certificate(accelerometer=section(**values), k=2.0).calibration().accelerometer
    assert np.allclose(found.b, values["bias"]["value"])
    assert np.allclose(np.diag(found.K), values["scale"]["value"])
    assert np.allclose(np.degrees(non_orthogonality(found.M)), values["non-orthogonality"]["value"])
    assert np.allclose(mounting_angles(factors(found.M)[2]), values["mounting"]["value"])
    sigma = factor_sigma(found.M, found.covariance[:9, :9])
    assert np.allclose(sigma[:3], 2e-4)
    assert np.allclose(np.degrees(sigma[3:6]), 0.01)
    assert np.allclose(np.degrees(sigma[6:]), 0.015)
    assert np.allclose(np.sqrt(np.diag(found.covariance)[9:]), [1e-3, 2e-3, 3e-3])


def test_a_model_with_its_covariance_reads_as_its_parts_state_it():
    stated = certified.certificate(accelerometer=section(mounting={"value": [1.0, 2.0, 3.0], "U": 0.03}))
    before = stated.calibration().accelerometer
    triad = CertifiedTriad.of_model(before.M, before.b, before.covariance)
    assert np.allclose(triad.matrix, before.M, atol=1e-12)
    for group in certified.GROUPS:
        one, other = (getattr(each, group.replace("-", "_")) for each in (triad, stated.accelerometer))
        assert np.allclose(one.value, other.value)
        assert np.allclose(one.U, other.U)
    again = stated.model_copy(update={"accelerometer": triad}).calibration().accelerometer
    assert np.array_equal(again.covariance, before.covariance)


def test_drift_grows_with_the_age_of_the_certificate():
    stated = certified.certificate(date=certified.day(-365))
    half, whole = (
        stated.influences("gyroscope", day, None)[1] for day in (certified.day(-182), certified.day())
    )
    ratio = years_between(stated.date, certified.day()) / years_between(stated.date, certified.day(-182))
    assert np.allclose(whole.covariance, ratio**2 * half.covariance)
    largest = 0.5 * certified.U["gyroscope"]["bias"] * 365 / 365.25
    assert np.allclose(np.sqrt(np.diag(whole.covariance)[9:]), largest / np.sqrt(3.0))


def test_temperature_counts_from_where_the_values_hold():
    found = certified.certificate().influences("accelerometer", certified.day(), (25.0, 26.0, 27.0))
    assert found[2].source == "reference: temperature within 4 K"
    largest = 4.0 * 0.1 * certified.U["accelerometer"]["bias"]
    assert np.allclose(np.sqrt(np.diag(found[2].covariance)[9:]), largest / np.sqrt(3.0))


def test_without_a_thermometer_the_range_of_the_certificate_counts():
    assert certified.certificate().distance(None) == 1.0


def test_a_file_reads_as_its_schema_says(tmp_path):
    path = certified.written(tmp_path / "reference.yaml")
    jsonschema.validate(yaml.safe_load(path.read_text()), SCHEMA)
    found = read_reference_certificate(path).certificate
    assert found.calibration() == certified.certificate().calibration()


MISTAKES = {
    "laboratory": ({"laboratory": ""}, "laboratory"),
    "date": ({"date": "March 2026"}, "give one such as 2026-03-31"),
    "due": ({"due": "2001-01-01"}, "before its date"),
    "k": ({"k": 0.0}, "k"),
    "no uncertainty": ({"accelerometer": section(scale={"value": [1, 1, 1], "U": 0.0})}, "give U above 0"),
    "scale": (
        {"accelerometer": section(scale={"value": [0, 1, 1], "U": 1e-3})},
        "give the ratio of reading to truth",
    ),
    "drift": ({"accelerometer": section(drift={"bias": -1.0})}, "at least 0"),
    "key": ({"gyroscop": {}}, "did you mean 'gyroscope'"),
}


@pytest.mark.parametrize(("changes", "said"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_one_line_with_file_and_remedy(tmp_path, changes, said):
    path = certified.written(tmp_path / "reference.yaml", **changes)
    with pytest.raises(CalibrationFileError) as caught:
        read_reference_certificate(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: line ")
    assert said in message
    assert "\n" not in message


def test_a_group_left_out_is_asked_for(tmp_path):
    content = certified.content()
    del content["gyroscope"]["mounting"]
    path = tmp_path / "reference.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(CalibrationFileError, match=r"gyroscope\.mounting is missing"):
        read_reference_certificate(path)


def test_a_file_of_another_kind_is_named(tmp_path):
    path = tmp_path / "certificate.pdf"
    path.write_bytes(b"%PDF-1.7")
    with pytest.raises(CalibrationFileError, match="is no PDF with a certificate"):
        read_reference_certificate(path)


@pytest.mark.parametrize(
    ("day", "serial", "said"),
    [
        (certified.day(183), "", "is out of date since"),
        (certified.day(-184), "", "before it"),
        (certified.day(), "R-2", "is of serial R-1, and the reference is R-2"),
    ],
    ids=["too old", "too new", "another serial"],
)
def test_a_certificate_that_does_not_hold_is_refused(day, serial, said):
    stated = certified.certificate(reference={"model": "R-9", "serial": "R-1"})
    with pytest.raises(CalibrationFileError) as caught:
        refuse_unfit_certificate(stated, "reference.yaml", day, serial)
    assert said in str(caught.value).replace("'", "").replace('"', "")


def test_a_certificate_holds_on_its_first_and_its_last_day():
    stated = certified.certificate()
    for day in (stated.date, stated.due):
        refuse_unfit_certificate(stated, "reference.yaml", day, "")
