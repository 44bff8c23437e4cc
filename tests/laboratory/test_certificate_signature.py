"""Signatures of certificates: verify names the signer, and finds one flipped bit anywhere."""

from __future__ import annotations

import base64
import io
import random
import stat
from contextlib import suppress

import pikepdf
import pytest
from asn1crypto import core
from cryptography.hazmat.primitives import serialization
from hypothesis import given
from lxml import etree

from hostile import corrupted, few, for_long
from made_up_certificates import certificate
from repetitions import repetitions
from tumble.bench.tls import server_context
from tumble.foundation.errors import CommandError, TumbleError
from tumble.laboratory.certificate import signature
from tumble.laboratory.certificate.dcc import dcc_of
from tumble.laboratory.certificate.dcc_reader import read_dcc
from tumble.laboratory.certificate.pdf import pdf_of
from tumble.laboratory.certificate.signature import attached_xml, sign, verify
from tumble.laboratory.certificate.signing_key import load_key, load_signer, make_key, name_of

NAME = "Inertial laboratory"


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory):
    """Key and signer of a laboratory."""
    path = tmp_path_factory.mktemp("keys") / "laboratory.pem"
    public = make_key(path, NAME)
    return load_key(path), load_signer(public)


@pytest.fixture(scope="module")
def files(laboratory):
    """A signed certificate: the XML, and the PDF with that attached."""
    found = certificate(("en",))
    xml = sign(dcc_of(found), laboratory[0])
    return xml, sign(pdf_of(found, xml), laboratory[0])


def flipped(content, place, bit):
    changed = bytearray(content)
    changed[place] ^= 1 << bit
    return bytes(changed)


def test_verify_names_the_signer_of_both_files(files, laboratory):
    for content in files:
        found = verify(content, [laboratory[1]])
        assert (found.signer, found.fault) == (NAME, "")
        assert read_dcc(found.xml) == read_dcc(files[0])
        assert sign(content, laboratory[0]) == content
    assert attached_xml(files[1]) == files[0]


def test_readers_get_the_bytes_that_were_verified(files, laboratory):
    unsigned = dcc_of(certificate(("en",))).partition(b"?>\n")[2]
    found = verify(files[0], [laboratory[1]])
    assert found.xml == etree.tostring(etree.fromstring(unsigned), method="c14n", exclusive=True)
    assert verify(files[0].replace(b"IMU-2026-0007", b"IMU-2026-0008"), [laboratory[1]]).xml == b""


def test_a_signed_pdf_stays_pdf_a(files):
    with pikepdf.open(io.BytesIO(files[1])) as document:
        (field,) = document.Root.AcroForm.Fields
        assert field.F & 4, "an annotation of PDF/A is printed"
        assert not {"/NeedAppearances", "/XFA"} & set(document.Root.AcroForm.keys())
        with document.open_metadata() as metadata:
            assert (metadata["pdfaid:part"], metadata["pdfaid:conformance"]) == ("3", "B")
        assert document.Root.AF[0].AFRelationship == "/Alternative"


def test_one_flipped_bit_in_the_xml_is_found(files, laboratory):
    xml = files[0]
    drawn = random.Random(3)
    frame = range(xml.index(b"<ds:Signature "), len(xml))
    places = [
        *range(60),
        *drawn.sample(frame, repetitions(1200)),
        *drawn.sample(range(frame[0]), repetitions(400)),
    ]
    missed = [
        (place, bit)
        for place in places
        for bit in (drawn.randrange(8), drawn.randrange(8))
        if not verify(flipped(xml, place, bit), [laboratory[1]]).fault
    ]
    assert missed == []


def test_one_flipped_bit_in_the_pdf_is_found(files, laboratory):
    pdf = files[1]
    drawn = random.Random(4)
    frame = range(pdf.rindex(b"/Contents <"), len(pdf))
    places = [*drawn.sample(frame, repetitions(120)), *drawn.sample(range(frame[0]), repetitions(80))]
    missed = [
        (place, bit)
        for place in places
        for bit in (drawn.randrange(8),)
        if not verify(flipped(pdf, place, bit), [laboratory[1]]).fault
    ]
    assert missed == []


def test_what_is_appended_or_cut_off_is_found(files, laboratory):
    for content in files:
        for changed in (content + b"\n", content[:-1], content + b"<!-- -->"):
            assert verify(changed, [laboratory[1]]).fault


def test_the_signature_of_another_laboratory_does_not_count(files, tmp_path):
    other = load_signer(make_key(tmp_path / "other.pem", NAME))
    for content in files:
        assert "none of those given" in verify(content, [other]).fault


def test_a_file_without_a_signature_is_not_signed(laboratory):
    found = certificate(("en",))
    for content in (dcc_of(found), pdf_of(found, dcc_of(found))):
        assert verify(content, [laboratory[1]]).fault == "is not signed"
    for content in (b"", b"%PDF-1.7", b"<a/>"):
        assert verify(content, [laboratory[1]]).fault


def test_only_its_owner_may_read_a_key(tmp_path):
    path = tmp_path / "laboratory.pem"
    public = make_key(path, NAME)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert b"PRIVATE" not in public.read_bytes()


def test_a_key_is_never_replaced(tmp_path):
    make_key(tmp_path / "laboratory.pem", NAME)
    before = (tmp_path / "laboratory.pem").read_bytes()
    with pytest.raises(TumbleError, match="is there already"):
        make_key(tmp_path / "laboratory.pem", NAME)
    assert (tmp_path / "laboratory.pem").read_bytes() == before


@pytest.mark.parametrize(
    "content", [b"", b"no key", b"-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n"]
)
def test_a_file_that_is_no_key_is_one_line(tmp_path, content):
    path = tmp_path / "laboratory.pem"
    path.write_bytes(content)
    for read in (load_key, load_signer):
        with pytest.raises(TumbleError, match=r"laboratory\.pem") as caught:
            read(path)
        assert "\n" not in str(caught.value)


def test_a_corrupted_certificate_of_a_signer_is_one_line(laboratory, tmp_path):
    key, signer = laboratory
    whole = signer.public_bytes(serialization.Encoding.DER)
    private = key.private.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    path = tmp_path / "corrupted.pem"

    @few
    @given(data=corrupted(whole))
    def check(data):
        path.write_bytes(private + pem_of(data))
        for load in (load_signer, load_key):
            with suppress(TumbleError):
                found = load(path)
                assert name_of(found if load is load_signer else found.certificate).isprintable()

    for_long(check, 0.2)


def pem_of(data, kind="CERTIFICATE"):
    """A certificate, or another kind, in the text of RFC 7468."""
    lines = base64.encodebytes(data).decode()
    return f"-----BEGIN {kind}-----\n{lines}-----END {kind}-----\n".encode()


def test_a_key_may_be_encrypted_by_a_password(tmp_path, monkeypatch):
    path = tmp_path / "laboratory.pem"
    key = load_key(make_key(path, NAME).with_suffix(".pem"))
    encrypted = key.private.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.BestAvailableEncryption(b"secret"),
    )
    path.write_bytes(encrypted + path.with_suffix(".crt").read_bytes())
    with pytest.raises(TumbleError, match="TUMBLE_SIGNING_PASSWORD") as caught:
        load_key(path)
    assert "\n" not in str(caught.value)
    monkeypatch.setenv("TUMBLE_SIGNING_PASSWORD", "secret")
    assert load_key(path).certificate == key.certificate
    monkeypatch.setenv("TUMBLE_SIGNING_PASSWORD", "another")
    with pytest.raises(TumbleError) as caught:
        load_key(path)
    assert "another" not in str(caught.value)


def element(tag, *parts):
    """Part of a document in DER (X.690): a sequence is 0x30."""
    content = b"".join(parts)
    size = len(content).to_bytes(4, "big")
    return bytes([tag, 0x84]) + size + content


def encryption(name, *parameters):
    """Algorithm of an encryption, with its parameters."""
    return element(0x30, core.ObjectIdentifier(name).dump(), *parameters)


def stated(*numbers):
    """Salt and numbers of a derivation of a key."""
    return element(0x30, core.OctetString(b"salt").dump(), *(core.Integer(each).dump() for each in numbers))


AES = encryption("2.16.840.1.101.3.4.1.42", core.OctetString(bytes(16)).dump())
PBKDF2, SCRYPT, PKCS12 = "1.2.840.113549.1.5.12", "1.3.6.1.4.1.11591.4.11", "1.2.840.113549.1.12.1.3"
ENDLESS = {
    "PBKDF2": (PBKDF2, 2**31 - 1),
    "scrypt": (SCRYPT, 2**30, 8, 1),
    "scrypt in parallel": (SCRYPT, 2**14, 8, 2**26),
    "scrypt that is none": (SCRYPT, 3, 8, 1),
    "PKCS 12": (PKCS12, 2**31 - 1),
    "unknown": ("1.2.3", 1),
}
"""Derivations that take hours, or are none: an object identifier and its numbers."""


@pytest.mark.parametrize("name", ENDLESS)
def test_a_key_that_takes_hours_to_try_is_one_line(tmp_path, monkeypatch, name):
    kind, *numbers = ENDLESS[name]
    how = encryption(kind, stated(*numbers))
    if kind != PKCS12:
        how = encryption("1.2.840.113549.1.5.13", element(0x30, how, AES))
    path = tmp_path / "laboratory.pem"
    data = element(0x30, how, core.OctetString(bytes(160)).dump())
    path.write_bytes(pem_of(data, "ENCRYPTED PRIVATE KEY"))
    monkeypatch.setenv("TUMBLE_SIGNING_PASSWORD", "secret")
    with pytest.raises(TumbleError, match=r"laboratory\.pem") as caught:
        load_key(path)
    assert "\n" not in str(caught.value)
    with pytest.raises(CommandError, match="is encrypted"):
        server_context(path, None)


def test_a_key_of_another_certificate_is_refused(tmp_path):
    make_key(tmp_path / "a.pem", NAME)
    make_key(tmp_path / "b.pem", NAME)
    private = (tmp_path / "a.pem").read_text().partition("-----BEGIN CERTIFICATE")[0]
    (tmp_path / "c.pem").write_text(private + (tmp_path / "b.crt").read_text())
    with pytest.raises(TumbleError, match="do not belong together"):
        load_key(tmp_path / "c.pem")


def pdf_with(*objects):
    """A PDF of these objects, the first of which is its catalogue."""
    content, places = b"%PDF-1.7\n", []
    for number, each in enumerate(objects, 1):
        places.append(len(content))
        content += b"%d 0 obj\n%b\nendobj\n" % (number, each)
    entries = b"".join(b"%010d 00000 n \n" % place for place in places)
    size = len(objects) + 1
    return content + (
        b"xref\n0 %d\n0000000000 65535 f \n%btrailer\n<</Size %d /Root 1 0 R>>\nstartxref\n%d\n%%%%EOF\n"
        % (size, entries, size, len(content))
    )


def branching(first, last):
    """Objects of which each but the last names the next one twice: 2^40 ways lead to the last."""
    return [b"<</T(a)/Kids[%d 0 R %d 0 R]>>" % (each + 1, each + 1) for each in range(first, last)]


CATALOGUE = b"<</Type/Catalog/Pages 2 0 R/Names<</EmbeddedFiles 3 0 R>>%b>>"
PAGES, NO_NAMES = b"<</Type/Pages/Kids[]/Count 0>>", b"<</Names[]>>"
ENDLESS_PDF = {
    "form": pdf_with(
        CATALOGUE % b"/AcroForm<</Fields[4 0 R]>>", PAGES, NO_NAMES, *branching(4, 44), NO_NAMES
    ),
    "names": pdf_with(CATALOGUE % b"", PAGES, *branching(3, 43), NO_NAMES),
    "entries": b"%PDF-1.7\n1 0 obj\n<</Type/XRef/Size 999999999/W[0 0 0]/Root 1 0 R/Length 0>>\nstream\n\n"
    b"endstream\nendobj\nstartxref\n9\n%%EOF\n",
}
ENDED_PDF = {
    "cycle": pdf_with(CATALOGUE % b"", PAGES, b"<</Kids[3 0 R 3 0 R]>>"),
    "itself": pdf_with(b"1 0 R", PAGES),
    "deep": pdf_with(CATALOGUE % b"", PAGES, b"[" * 20_000 + b"]" * 20_000),
    "cut": pdf_with(CATALOGUE % b"", PAGES)[:-20],
}


@pytest.mark.parametrize("name", ENDLESS_PDF | ENDED_PDF)
def test_a_pdf_that_is_read_for_ever_ends_in_one_line(laboratory, monkeypatch, name):
    if name in ENDLESS_PDF:
        monkeypatch.setattr(signature, "READ_WITHIN", 0.0)
    content = (ENDLESS_PDF | ENDED_PDF)[name]
    found = verify(content, [laboratory[1]])
    assert found.fault
    assert "\n" not in found.fault
    with pytest.raises(TumbleError) as caught:
        attached_xml(content)
    assert "\n" not in str(caught.value)
    assert "takes more than" in found.fault + str(caught.value) or name in ENDED_PDF


def test_signer_that_expired_is_named_with_its_dates(tmp_path, monkeypatch):
    """The XML of an untouched certificate "was changed", once the certificate of its signer had expired."""
    # A package that another test imported anew has another module of that name.
    monkeypatch.setitem(make_key.__globals__, "date_now", lambda: "2001-01-01T00:00:00Z")
    public = make_key(tmp_path / "old.pem", NAME)
    xml = sign(dcc_of(certificate(("en",))), load_key(tmp_path / "old.pem"))
    found = verify(xml, [load_signer(public)])
    assert "2000-12-31 to 20" in found.fault
    assert NAME in found.fault
    assert "changed" not in found.fault
    assert found.xml == b""
