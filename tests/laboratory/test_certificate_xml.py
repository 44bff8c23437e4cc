"""Certificates as XML: valid for PTB's schemas and rules, and read back to the same certificate."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings

from dcc_schemas import rule_errors, schema_errors
from made_up_certificates import HOSTILE, certificate, certificates
from repetitions import repetitions
from tumble.foundation.errors import CalibrationFileError
from tumble.laboratory.certificate.dcc import dcc_of
from tumble.laboratory.certificate.dcc_reader import read_dcc, read_reference
from tumble.laboratory.certificate.si_units import D_SI, unit_of_product


@settings(max_examples=repetitions(200))
@given(certificates())
@example(certificate())
def test_xml_reads_back_to_the_same_certificate(found):
    assert read_dcc(dcc_of(found)) == found


@settings(max_examples=repetitions(100))
@given(certificates())
@example(certificate(languages=("en",)))
def test_xml_is_valid_against_the_schemas(found):
    assert schema_errors(dcc_of(found)) == []


@settings(max_examples=repetitions(40))
@given(certificates())
@example(certificate())
def test_xml_keeps_the_schematron_rules(found):
    assert rule_errors(dcc_of(found)) == []


@pytest.mark.parametrize("text", [*HOSTILE, "\x00\x1b[31m", "\ufffe\ud800"])
def test_text_from_outside_stays_text_in_xml(text):
    written = dcc_of(certificate(text=text))
    assert schema_errors(written) == []
    assert read_dcc(written) == certificate(text=text)


def test_a_reference_reads_back_bit_by_bit(tmp_path):
    found = certificate()
    covariance = np.random.default_rng(5).normal(size=(12, 12)) * 1e-7
    model = found.calibrated[0].models[0].model_copy(update={"covariance": covariance})
    whole = found.calibrated[0].model_copy(update={"models": (model,)})
    path = tmp_path / "reference.xml"
    path.write_bytes(dcc_of(found.model_copy(update={"calibrated": (whole,)})))
    values = read_reference(path)
    assert values.certificate.number == "IMU-2026-0007"
    (triad,) = values.models.values()
    assert np.array_equal(triad.M, model.M)
    assert np.array_equal(triad.b, model.b)
    assert np.array_equal(triad.covariance, covariance)


def test_a_reference_without_covariance_is_refused(tmp_path):
    path = tmp_path / "reference.xml"
    path.write_bytes(dcc_of(certificate()))
    with pytest.raises(CalibrationFileError, match="holds no M and b with their covariance"):
        read_reference(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"<a/>",
        b"no XML",
        b"\xff\xfe",
        b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>',
        b'<d:digitalCalibrationCertificate xmlns:d="https://ptb.de/dcc"/>',
    ],
)
def test_what_is_no_certificate_is_one_line(content):
    with pytest.raises(CalibrationFileError) as caught:
        read_dcc(content, about="reference.xml")
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("reference.xml: ")


@settings(max_examples=repetitions(40))
@given(certificates())
def test_a_certificate_cut_short_is_one_line(found):
    written = dcc_of(found)
    for size in range(0, len(written), max(1, len(written) // 20)):
        with pytest.raises(CalibrationFileError):
            read_dcc(written[:size])


def test_units_of_covariances_are_products():
    assert unit_of_product("1", "m/s^2") == D_SI["m/s^2"]
    assert unit_of_product("rad/s", "1") == D_SI["rad/s"]
    assert unit_of_product("m/s^2", "m/s^2") == r"\metre\tothe{2}\second\tothe{-4}"
    assert unit_of_product("1", "1") == D_SI["1"]
