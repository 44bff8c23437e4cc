"""A certificate of the laboratory as that of a reference: the numbers of XML, PDF and YAML are the same."""

from __future__ import annotations

import json

import numpy as np
import pytest

import certified_references
from made_up_calibrations import made_up, save
from made_up_certificates import certificate, options, with_covariance
from tumble import Calibration, Registry
from tumble.calibration.reference_certificate import ReferenceCertificate, read_reference_certificate
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.results import TriadName
from tumble.laboratory.certificate.dcc import dcc_of
from tumble.laboratory.certificate.issue import numbered
from tumble.laboratory.certificate.model import Item, SensorModel
from tumble.laboratory.certificate.numbering import Pattern
from tumble.laboratory.certificate.pdf import pdf_of
from tumble.laboratory.certificate.record import Rendered, issue, withdraw
from tumble.laboratory.certificate.signature import sign
from tumble.laboratory.certificate.signing_key import load_key, make_key
from tumble.tools.simulate import write_turntable
from turntable_sessions import one_line, simulate, typed

TRIADS: tuple[TriadName, ...] = ("accelerometer", "gyroscope")


@pytest.fixture(scope="module")
def issued():
    """A certificate with the values and the covariance of a reference that is certified in YAML."""
    stated = certified_references.certificate()
    models = tuple(
        SensorModel(
            triad=triad,
            M=stated.triads()[triad].matrix,
            b=stated.triads()[triad].bias.value,
            covariance=stated.calibration().content()[triad]["covariance"],
        )
        for triad in TRIADS
    )
    found = certificate(("en",))
    whole = found.calibrated[0].model_copy(
        update={"models": models, "begun": certified_references.day(-9), "day": certified_references.day(-9)}
    )
    item = Item(name="reference", serial="SIM-7-0", manufacturer="Acme", model="R-9")
    return found.model_copy(update={"calibrated": (whole,), "item": item})


def written(issued, folder):
    xml = dcc_of(issued)
    (folder / "reference.xml").write_bytes(xml)
    (folder / "reference.pdf").write_bytes(pdf_of(issued, xml))
    return folder / "reference.xml", folder / "reference.pdf"


def test_targets_get_the_same_numbers_from_xml_pdf_and_yaml(issued, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_turntable(simulate(7, grades=("industrial",)), tmp_path / "session")
    xml, pdf = written(issued, tmp_path)
    yaml = tmp_path / "reference.yaml"
    content = json.loads(read_reference_certificate(xml).certificate.model_dump_json(by_alias=True))
    certified_references.written(yaml, **content)
    found = {}
    for path in (xml, pdf, yaml):
        done = typed(
            "turntable", "session/reference.csv", "session/target_1.csv", "--reference-certificate", path,
            "--gravity", "9.80665", "--gravity-uncertainty", "5e-4", "-o", tmp_path / path.suffix[1:],
        )  # fmt: skip
        assert done.code in (0, 3), done.err
        found[path.suffix] = Calibration.load(tmp_path / path.suffix[1:] / "target_1.yaml")
    for triad in TRIADS:
        for number in ("M", "b"):
            for other in (".pdf", ".yaml"):
                first, second = (getattr(getattr(found[each], triad), number) for each in (".xml", other))
                assert np.abs(first - second).max() < 1e-12
        first, second = (getattr(found[each], triad).total_covariance for each in (".xml", ".yaml"))
        assert np.abs(first - second).max() < 1e-9 * np.abs(first).max()
    stated = found[".xml"].reference.certificate
    assert (stated.number, stated.laboratory, stated.serial) == ("IMU-2026-0007", "plain", "SIM-7-0")


def signed_by(issued, folder, name):
    """The certificate as XML and as PDF, and the public file of the laboratory that signed both."""
    public = make_key(folder / f"{name}.pem", name)
    key = load_key(folder / f"{name}.pem")
    xml = sign(dcc_of(issued), key)
    for ending, content in (("xml", xml), ("pdf", sign(pdf_of(issued, xml), key))):
        (folder / f"{name}.{ending}").write_bytes(content)
    return folder / f"{name}.xml", folder / f"{name}.pdf", public


def test_the_signature_of_a_reference_is_verified_and_named(issued, tmp_path):
    *files, public = signed_by(issued, tmp_path, "ours")
    *others, _ = signed_by(issued, tmp_path, "theirs")
    for path, other in zip(files, others, strict=True):
        assert read_reference_certificate(path, public).signature == "unchanged since ours signed it"
        assert "since ours signed it; no --reference-signer" in read_reference_certificate(path).signature
        with pytest.raises(CalibrationFileError, match="names theirs as signer, none of those given"):
            read_reference_certificate(other, public)
    for path in written(issued, tmp_path):
        assert read_reference_certificate(path).signature == "is not signed"
        with pytest.raises(CalibrationFileError, match="is not signed; give the file as"):
            read_reference_certificate(path, public)
    with pytest.raises(CalibrationFileError, match="is YAML, which bears no signature"):
        read_reference_certificate(certified_references.written(tmp_path / "reference.yaml"), public)


def test_a_reference_changed_since_it_was_signed_is_refused(issued, tmp_path):
    xml, pdf, public = signed_by(issued, tmp_path, "ours")
    for path, part in ((xml, b"<dcc:value>SIM-7-0"), (pdf, b"/Lang")):
        content = path.read_bytes()
        path.write_bytes(content.replace(part, part[:-1] + b"9"))
        assert path.read_bytes() != content
        for signer in (public, None):
            with pytest.raises(CalibrationFileError, match=rf"^{path}: .*; give the file as"):
                read_reference_certificate(path, signer)


def test_a_run_says_whether_a_signature_was_verified(issued, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_turntable(simulate(7, grades=("industrial",)), tmp_path / "session")
    xml, _, public = signed_by(issued, tmp_path, "ours")
    (tmp_path / "tumble.toml").write_text(f'reference_signer = "{public.name}"\n')
    words = ("turntable", "session/reference.csv", "session/target_1.csv", "--gravity", "9.80665")
    done = typed(*words, "--reference-certificate", xml, "-o", "results")
    sentence = "unchanged since ours signed it"
    assert f"certificate IMU-2026-0007 of the reference: {sentence}\n" in done.err
    assert Calibration.load("results/target_1.yaml").reference.certificate.signature == sentence
    assert sentence in (tmp_path / "results" / "target_1.html").read_text()


def test_a_certificate_of_another_unit_is_refused(issued, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_turntable(simulate(8, grades=("industrial",)), tmp_path / "session")
    xml, _ = written(issued, tmp_path)
    words = ("session/reference.csv", "session/target_1.csv", "--reference-certificate", xml)
    done = typed("turntable", *words, "-o", "results")
    assert (done.code, done.out) == (2, "")
    assert "is of serial 'SIM-7-0', and the reference is 'SIM-8-0'" in done.err


def test_the_calibration_of_a_read_reference_is_that_certified(issued, tmp_path):
    stated = certified_references.certificate().calibration()
    for path in written(issued, tmp_path):
        read = read_reference_certificate(path).certificate
        assert isinstance(read, ReferenceCertificate)
        for triad in TRIADS:
            first, second = getattr(stated, triad), getattr(read.calibration(), triad)
            assert np.abs(first.M - second.M).max() < 1e-14
            assert np.array_equal(first.b, second.b)
            assert np.array_equal(first.covariance, second.covariance)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"M": np.zeros((3, 3))}, "M has rows of 0 to 0"),
        ({"M": np.eye(3) * 1e29}, r"M has rows of 1e\+29"),
        ({"M": np.ones((3, 3))}, "almost in a plane"),
        ({"covariance": -np.eye(12)}, "states that a value is exact"),
        ({"covariance": np.eye(12) * 1e29}, r"covariance is up to 1e\+29"),
        ({"b": np.full(3, 1e29)}, "bias is beyond"),
    ],
)
def test_numbers_of_no_reference_are_refused_in_a_line(issued, tmp_path, change, said):
    whole = issued.calibrated[0]
    models = tuple(model.model_copy(update=change) for model in whole.models)
    stated = issued.model_copy(update={"calibrated": (whole.model_copy(update={"models": models}),)})
    for path in written(stated, tmp_path):
        with pytest.raises(CalibrationFileError, match=said) as caught:
            read_reference_certificate(path)
        assert str(caught.value).startswith(f"{path}: accelerometer: ")
        assert "\n" not in str(caught.value)


@pytest.fixture
def on_record(issued, tmp_path, monkeypatch):
    """A registry that issued the certificate of the reference, and a session of that reference."""
    monkeypatch.chdir(tmp_path)
    write_turntable(simulate(7, grades=("industrial",)), tmp_path / "session")
    registry = Registry.create(tmp_path / "lab.db")
    save(tmp_path / "units", with_covariance(made_up(serial="SIM-7-0", log="SIM-7-0")))
    identity = registry.add(tmp_path / "units")[0].identity

    def rendered(number):
        stated = numbered(issued, number)
        return Rendered(number, pdf_of(stated, dcc_of(stated)), dcc_of(stated))

    given = issue(registry, Pattern("REF-{n:02}"), issued.issued, [identity], rendered)
    (tmp_path / "reference.xml").write_bytes(given.xml)
    (tmp_path / "reference.pdf").write_bytes(given.pdf)
    return (
        registry,
        given,
        lambda number: issue(
            *(registry, Pattern("REF-{n:02}"), issued.issued, [identity], rendered), supersedes=number
        ),
    )


def turned_with(name, *words):
    return typed(
        *("turntable", "session/reference.csv", "session/target_1.csv", "--gravity", "9.80665"),
        *("--reference-certificate", name, *words, "-o", "results"),
    )


def test_a_reference_certificate_withdrawn_since_is_refused(on_record, tmp_path):
    registry, given, _ = on_record
    for name in ("reference.xml", "reference.pdf"):
        done = turned_with(name, "--registry", "lab.db", "--operator", "Ann")
        assert done.code == 0, done.err
        assert "issued, and not withdrawn since, by the registry\n" in done.err
    withdraw(registry, given.number, "the table was loose")
    stated = json.loads(
        read_reference_certificate("reference.xml").certificate.model_dump_json(by_alias=True)
    )
    certified_references.written(tmp_path / "reference.yaml", **stated)
    for name in ("reference.xml", "reference.pdf", "reference.yaml"):
        done = turned_with(name, "--registry", "lab.db")
        assert (done.code, done.out) == (2, "")
        line = one_line(done.err)
        assert f"{name}: certificate REF-01 was withdrawn on" in line
        assert line.endswith("the table was loose; calibrate with a certificate of the reference that holds")
    done = turned_with("reference.xml")
    assert "no registry was given, which knows whether it was withdrawn; give --registry" in done.err


def test_a_result_of_a_withdrawn_reference_is_not_certified(on_record):
    registry, given, _ = on_record
    assert turned_with("reference.xml", "--registry", "lab.db", "--operator", "Ann").code == 0
    withdraw(registry, given.number, "the table was loose")
    words = ("certificate", "results", *options(), "--registry", "lab.db")
    done = typed(*words)
    assert (done.code, done.out) == (2, "")
    assert "of its reference, certificate REF-01 was withdrawn" in one_line(done.err)


def test_a_superseded_or_edited_reference_is_refused(on_record, tmp_path):
    _, given, superseding = on_record
    edited = given.xml.replace(b"Acme", b"Acne")
    assert edited != given.xml
    (tmp_path / "edited.xml").write_bytes(edited)
    done = turned_with("edited.xml", "--registry", "lab.db")
    assert done.code == 2
    assert "certificate REF-01 is another file in the registry; give that of" in one_line(done.err)
    superseding(given.number)
    done = turned_with("reference.xml", "--registry", "lab.db")
    assert done.code == 2
    assert "certificate REF-01 was superseded by REF-02" in one_line(done.err)


def test_a_number_of_another_laboratory_is_not_on_record(on_record, tmp_path):
    registry, given, _ = on_record
    withdraw(registry, given.number, "the table was loose")
    reference = {"manufacturer": "Acme", "model": "R-9"}
    certified_references.written(tmp_path / "other.yaml", number=given.number, reference=reference)
    done = turned_with("other.yaml", "--registry", "lab.db")
    assert done.code == 0, done.err
    assert "holds no such certificate; ask the laboratory whether it still holds\n" in done.err


@pytest.mark.parametrize(
    ("unit", "other"),
    [
        (rb"\metre\second\tothe{-2}</si:unitXMLList>", rb"\metre\second\tothe{-1}</si:unitXMLList>"),
        (rb"\one \one", rb"\one \percent"),
        (rb"<si:unit>\metre\tothe{2}\second\tothe{-4}<", rb"<si:unit>\metre\tothe{2}\second\tothe{-3}<"),
        (rb"<si:unit>\degreecelsius<", rb"<si:unit>\kelvin<"),
        (rb"<si:unit>\metre\second\tothe{-2}<", rb"<si:unit>\centi\metre\second\tothe{-2}<"),
    ],
)
def test_a_reference_in_other_units_is_refused_in_a_line(issued, tmp_path, unit, other):
    content = dcc_of(issued)
    assert unit in content
    (tmp_path / "other.xml").write_bytes(content.replace(unit, other))
    with pytest.raises(CalibrationFileError) as caught:
        read_reference_certificate(tmp_path / "other.xml")
    assert "\n" not in str(caught.value)
    assert "is read" in str(caught.value) or "is no unit of a certificate" in str(caught.value)
