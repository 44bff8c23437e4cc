"""Law of signed certificates: every edit of the bytes is reported, and no reader gets what was not signed."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from certificate_edits import PDF_EDITS, XML_EDITS, sibling_of_pdf_signature, sibling_of_signature
from made_up_certificates import certificate
from repetitions import drawn_seed, repetitions
from tumble.foundation.errors import CalibrationFileError
from tumble.laboratory.certificate.dcc import dcc_of
from tumble.laboratory.certificate.dcc_reader import read_dcc
from tumble.laboratory.certificate.pdf import pdf_of
from tumble.laboratory.certificate.signature import sign, verify
from tumble.laboratory.certificate.signing_key import load_key, make_key
from turntable_sessions import typed

ATTACKS = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "attack"
"""Seed of the edits, printed with each failure."""


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory):
    """Key of a laboratory."""
    path = tmp_path_factory.mktemp("keys") / "laboratory.pem"
    make_key(path, "Inertial laboratory")
    return load_key(path)


@pytest.fixture(scope="module")
def xml(laboratory):
    """A signed certificate."""
    return sign(dcc_of(certificate(("en",))), laboratory)


@pytest.fixture(scope="module")
def pdf(laboratory, xml):
    """The same as PDF."""
    return sign(pdf_of(certificate(("en",)), xml), laboratory)


@pytest.mark.parametrize(("kind", "count"), [("xml", 2400), ("pdf", 400)])
def test_every_edit_of_a_signed_certificate_is_reported(kind, count, request, laboratory):
    genuine, edits = request.getfixturevalue(kind), {"xml": XML_EDITS, "pdf": PDF_EDITS}[kind]
    drawn, missed = Random(drawn_seed()), []
    for n in range(repetitions(count)):
        name = list(edits)[n % len(edits)]
        edited = edits[name](genuine, drawn)
        if edited != genuine and not verify(edited, [laboratory.certificate]).fault:
            missed.append((name, n))
    assert missed == []


def test_the_other_signature_of_the_curve_signs_the_same(xml, pdf, laboratory):
    # Whoever has one signature can write the other; it is over the same bytes.
    for genuine, edit in ((xml, sibling_of_signature), (pdf, sibling_of_pdf_signature)):
        other = edit(genuine, Random(drawn_seed()))
        assert other != genuine
        assert verify(other, [laboratory.certificate]) == verify(genuine, [laboratory.certificate])


@pytest.mark.parametrize("stray", [b"<!---->", b"<?x y?>", b"0"])
def test_strays_are_refused_where_nothing_is_signed_as_well(stray):
    content = dcc_of(certificate(("en",)))
    places = [content.index(b"</dcc:value>"), content.index(b"<dcc:coreData>"), content.rindex(b"</")]
    for place in places if stray != b"0" else places[1:]:
        with pytest.raises(CalibrationFileError, match=r"^x\.xml: line \d: holds (a comment|text between)"):
            read_dcc(content[:place] + stray + content[place:], about="x.xml")
    for outside in (content + b"<!-- -->", content.replace(b"<dcc:dig", b"<!-- --><dcc:dig", 1)):
        with pytest.raises(CalibrationFileError, match="holds a comment"):
            read_dcc(outside, about="x.xml")


def test_attacks_of_the_past_are_reported(tmp_path, monkeypatch):
    if not ATTACKS.is_dir():
        pytest.skip(f"{ATTACKS} is not there")
    monkeypatch.chdir(tmp_path)
    signer = ("--signer", ATTACKS / "laboratory.crt")
    assert typed("certificate", "verify", ATTACKS / "certificate-genuine.xml", *signer).code == 0
    for name in ("certificate-U-cut-by-comments.xml", "certificate-number-cut.xml"):
        done = typed("certificate", "verify", ATTACKS / name, *signer)
        assert (done.code, done.err, done.out.count("\n")) == (3, "", 1)
        assert "line 2: holds a comment" in done.out
