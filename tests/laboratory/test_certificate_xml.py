"""Certificates as XML: valid for PTB's schemas and rules, and read back to the same certificate."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings

from dcc_schemas import rule_errors, schema_errors
from made_up_certificates import HOSTILE, certificate, certificates
from repetitions import repetitions
from tumble.calibration.reference_certificate import read_reference_certificate
from tumble.foundation.errors import CalibrationFileError
from tumble.laboratory.certificate.dcc import dcc_of
from tumble.laboratory.certificate.dcc_reader import read_dcc
from tumble.laboratory.certificate.pdf import pdf_of
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


@pytest.mark.parametrize("ending", ["xml", "pdf"])
def test_a_reference_reads_back_the_same_numbers(tmp_path, ending):
    found = certificate(("en",))
    random = np.random.default_rng(5)
    root = 1e-4 * random.normal(size=(12, 12))
    changed = {"M": np.eye(3) + 0.01 * random.normal(size=(3, 3)), "covariance": root @ root.T}
    model = found.calibrated[0].models[0].model_copy(update=changed)
    whole = found.calibrated[0].model_copy(update={"models": (model,)})
    issued = found.model_copy(update={"calibrated": (whole,)})
    xml = dcc_of(issued)
    path = tmp_path / f"reference.{ending}"
    path.write_bytes(xml if ending == "xml" else pdf_of(issued, xml))
    values = read_reference_certificate(path).certificate
    assert (values.number, values.date, values.reference.serial) == ("IMU-2026-0007", "2026-11-26", "plain")
    assert (values.temperature.low, values.temperature.high) == (24.5, 25.5)
    triad = values.accelerometer
    assert np.abs(triad.matrix - model.M).max() < 1e-14
    assert np.array_equal(triad.bias.value, model.b)
    assert np.array_equal(triad.covariance, model.covariance)


def test_a_reference_without_covariance_is_refused(tmp_path):
    path = tmp_path / "reference.xml"
    path.write_bytes(dcc_of(certificate()))
    with pytest.raises(CalibrationFileError, match="holds no M and b with their whole covariance"):
        read_reference_certificate(path)


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


@pytest.mark.parametrize("crowd", [' a{0:x}="" ', ' xmlns:n{0:x}="urn:u" ', None])
def test_a_crowd_of_attributes_is_refused_before_it_is_sorted(crowd):
    written = dcc_of(certificate())
    assert read_dcc(written) == certificate()
    place = written.index(b">", written.index(b"<dcc:digitalCalibrationCertificate"))
    more = "".join(map((crowd or "").format, range(1 << 16))).encode()
    crowded = written[:place] + more + written[place:]
    if crowd is None:
        nested = b"".join(b'<dcc:a xmlns:n%x="urn:u">' % number for number in range(250))
        crowded = written.replace(b"<dcc:administrativeData", 2 * nested + b"<dcc:administrativeData", 1)
    with pytest.raises(CalibrationFileError, match="has more attributes than any certificate"):
        read_dcc(crowded)


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
