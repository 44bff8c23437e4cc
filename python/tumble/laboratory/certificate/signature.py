"""Signatures of both renderings by the laboratory's key: XML Signature, and PAdES for the PDF.

Both standards leave some bytes unsigned: comments and the layout of XML, and the frame of a signature. A file
is therefore a function of what was signed, the value of the signature and the signer. Verification writes it
again and compares the bytes, so that no edit passes; readers are given what was verified, and never the file.
"""

from __future__ import annotations

import base64
import io
import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from cryptography import x509
from cryptography.hazmat.primitives import serialization
from lxml import etree

from tumble.foundation.bounded_time import bounded_time
from tumble.foundation.errors import TumbleError
from tumble.laboratory.certificate.dcc import NAMESPACES, XmlElement, serialized
from tumble.laboratory.certificate.dcc_reader import parse_xml
from tumble.laboratory.certificate.signing_key import SigningKey, name_of

READ_WITHIN = 10.0
"""s within which a PDF is read: fifty times of what one takes that a laboratory writes."""
NOT_SIGNED = "is not signed"
"""Fault of a file without a signature."""
DS = "http://www.w3.org/2000/09/xmldsig#"
_EXCLUSIVE = "http://www.w3.org/2001/10/xml-exc-c14n#"
_DIGEST, _METHOD = "sha256", "ecdsa-sha256"
_FIELD = "Laboratory"
_PDF = b"%PDF-"
_LARGEST_ANSWER = 200

# Without a handler of their own, libraries would print remarks on damaged files.
for _library in ("pyhanko", "pyhanko_certvalidator"):
    logging.getLogger(_library).addHandler(logging.NullHandler())


@dataclass(frozen=True, slots=True)
class Signed:
    """Outcome of the verification of a file."""

    signer: str
    """Name in the certificate of whoever signed; empty where nobody did, or it cannot be read."""
    fault: str
    """Reason why the file is not what that signer signed; empty where it is."""
    xml: bytes = b""
    """XML of the certificate as it was signed: the only bytes to read; empty where there is a fault."""

    @property
    def sentence(self) -> str:
        """Describe the outcome."""
        return self.fault or f"unchanged since {self.signer} signed it"


def sign(content: bytes, key: SigningKey) -> bytes:
    """Return a certificate, PDF or XML, with a signature; one that is signed comes back as it is."""
    return _sign_pdf(content, key) if content.startswith(_PDF) else _sign_xml(content, key)


def verify(content: bytes, signers: Sequence[x509.Certificate] | None) -> Signed:
    """Return who of `signers` signed a certificate, PDF or XML, and whether it is unchanged since.

    Without `signers` the one counts that the file names: it is then as somebody signed it, in whatever name.
    """
    try:
        if content.startswith(_PDF):
            signer, xml = _verify_pdf(content, signers), attached_xml(content)
        else:
            signer, xml = _verify_xml(content, signers)
        return Signed(name_of(signer), "", xml)
    except _NotIntactError as error:
        return Signed("", str(error))
    except TumbleError as error:
        return Signed("", error.why)
    except Exception as error:  # of a changed file any part of three libraries may stumble
        return Signed("", f"cannot be read as signed: {' '.join(str(error).split())[:_LARGEST_ANSWER]}")


def attached_xml(pdf: bytes) -> bytes:
    """Return the XML that a PDF certificate carries; raises `TumbleError` where there is none."""
    from pyhanko.pdf_utils.reader import PdfFileReader

    try:
        with bounded_time(READ_WITHIN):
            reader = PdfFileReader(io.BytesIO(pdf))
            names = reader.root["/Names"]["/EmbeddedFiles"]
            for specification in _leaves(names):
                found: bytes = specification["/EF"]["/F"].data
                return found
    except Exception as error:  # of a damaged file any part of the library may stumble
        raise TumbleError(f"is no PDF with a certificate: {' '.join(str(error).split())}") from error
    raise TumbleError("is a PDF without the XML of a certificate")


class _NotIntactError(Exception):
    """Reason why a file is not as it was signed."""


# XML

_SIGNATURE = (
    f'<ds:Signature xmlns:ds="{DS}"><ds:SignedInfo>'
    f'<ds:CanonicalizationMethod Algorithm="{_EXCLUSIVE}"/>'
    '<ds:SignatureMethod Algorithm="http://www.w3.org/2001/04/xmldsig-more#ecdsa-sha256"/>'
    f'<ds:Reference URI=""><ds:Transforms><ds:Transform Algorithm="{DS}enveloped-signature"/>'
    f'<ds:Transform Algorithm="{_EXCLUSIVE}"/></ds:Transforms>'
    '<ds:DigestMethod Algorithm="http://www.w3.org/2001/04/xmlenc#sha256"/>'
    "<ds:DigestValue/></ds:Reference></ds:SignedInfo><ds:SignatureValue/>"
    "<ds:KeyInfo><ds:X509Data><ds:X509Certificate/></ds:X509Data></ds:KeyInfo></ds:Signature>"
)
"""Signature as it is written; `_VALUES` stand in it."""
_VALUES = ("DigestValue", "SignatureValue", "X509Certificate")


def _sign_xml(content: bytes, key: SigningKey) -> bytes:
    from signxml.algorithms import SignatureConstructionMethod
    from signxml.signer import XMLSigner

    root = parse_xml(content, "certificate")
    if root.find(f"{{{DS}}}Signature") is not None:
        return content
    signer = XMLSigner(
        method=SignatureConstructionMethod.enveloped,
        signature_algorithm=_METHOD,
        digest_algorithm=_DIGEST,
        c14n_algorithm=_EXCLUSIVE,
    )
    signed = signer.sign(root, key=key.private, cert=[key.certificate])
    return _written(content, [_bytes_in(signed, name) for name in _VALUES])


def _verify_xml(content: bytes, signers: Sequence[x509.Certificate] | None) -> tuple[x509.Certificate, bytes]:
    """Return who of `signers` signed an XML, and what was signed."""
    from signxml.exceptions import InvalidCertificate, InvalidInput, InvalidSignature
    from signxml.verifier import SignatureConfiguration, XMLVerifier

    root = parse_xml(content, "certificate")
    if root.find(f".//{{{DS}}}Signature") is None:
        raise _NotIntactError(NOT_SIGNED)
    try:
        values = [_bytes_in(root, name) for name in _VALUES]
    except ValueError:
        raise _NotIntactError("was changed: its signature is not as a laboratory writes it") from None
    signer = _one_of(x509.load_der_x509_certificate(values[-1]), signers)
    try:
        found: Any = XMLVerifier().verify(
            content, x509_cert=signer, expect_config=SignatureConfiguration(require_x509=False, location="./")
        )
    except InvalidCertificate as error:
        dates = (signer.not_valid_before_utc, signer.not_valid_after_utc)
        first, last = (f"{date:%Y-%m-%d}" for date in dates)
        raise _NotIntactError(
            f"names {name_of(signer)} as signer, whose certificate holds from {first} to {last} only; verify "
            "the PDF, which states when it was signed"
        ) from error
    except (InvalidSignature, InvalidInput) as error:
        raise _NotIntactError("was changed since it was signed") from error
    signed: bytes = found.signed_data
    if _written(signed, values) != content:
        raise _NotIntactError("was changed: its layout is not that of a certificate")
    return signer, signed


def _written(certificate: bytes, values: Sequence[bytes]) -> bytes:
    """Return the file of a signed certificate: what was signed, and the values of `_VALUES`."""
    root = parse_xml(certificate, "certificate")
    etree.cleanup_namespaces(root, top_nsmap=NAMESPACES, keep_ns_prefixes=[*NAMESPACES])
    signature = etree.fromstring(_SIGNATURE)
    for name, value in zip(_VALUES, values, strict=True):
        _part(signature, name).text = base64.b64encode(value).decode()
    root.append(signature)
    return serialized(root)


def _bytes_in(root: XmlElement, name: str) -> bytes:
    """Return a value of the signature in a certificate; raises `ValueError` unless there is one of them."""
    return base64.b64decode("".join((_part(root, name).text or "").split()), validate=True)


def _part(root: XmlElement, name: str) -> XmlElement:
    (found,) = root.iter(f"{{{DS}}}{name}")
    return found


# PDF


def _sign_pdf(content: bytes, key: SigningKey) -> bytes:
    from asn1crypto import keys
    from asn1crypto import x509 as asn1_x509
    from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
    from pyhanko.pdf_utils.reader import PdfFileReader
    from pyhanko.sign import fields, signers
    from pyhanko_certvalidator.registry import SimpleCertificateStore

    if PdfFileReader(io.BytesIO(content)).embedded_signatures:
        return content
    store: Any = SimpleCertificateStore
    private = key.private.private_bytes(
        serialization.Encoding.DER, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    signer = signers.SimpleSigner(
        signing_cert=asn1_x509.Certificate.load(_der(key.certificate)),
        signing_key=keys.PrivateKeyInfo.load(private),
        cert_registry=store(),
    )
    signed = signers.sign_pdf(
        IncrementalPdfFileWriter(io.BytesIO(content)),
        signers.PdfSignatureMetadata(
            field_name=_FIELD, md_algorithm=_DIGEST, subfilter=fields.SigSeedSubFilter.PADES
        ),
        signer=signer,
    )
    found: bytes = signed.getvalue()
    return found


def _verify_pdf(content: bytes, signers: Sequence[x509.Certificate] | None) -> x509.Certificate:
    from asn1crypto import x509 as asn1_x509
    from pyhanko.pdf_utils.reader import PdfFileReader
    from pyhanko.sign.validation import validate_pdf_signature
    from pyhanko.sign.validation.status import SignatureCoverageLevel
    from pyhanko_certvalidator import ValidationContext

    with bounded_time(READ_WITHIN):
        signatures = PdfFileReader(io.BytesIO(content)).embedded_signatures
        if not signatures:
            raise _NotIntactError(NOT_SIGNED)
        if len(signatures) != 1:
            raise _NotIntactError("bears several signatures, and a certificate bears one")
        _check_contents(content, signatures[0])
        signer = _one_of(x509.load_der_x509_certificate(signatures[0].signer_cert.dump()), signers)
        roots = [asn1_x509.Certificate.load(_der(signer))]
        moment = signatures[0].self_reported_timestamp
        status = validate_pdf_signature(
            signatures[0],
            ValidationContext(trust_roots=roots, allow_fetching=False, moment=moment),
        )
    if not (status.intact and status.valid and status.coverage == SignatureCoverageLevel.ENTIRE_FILE):
        raise _NotIntactError("was changed since it was signed")
    return signer


def _check_contents(content: bytes, signature: Any) -> None:  # noqa: ANN401 - pyHanko is imported late
    """Raise where the signature of a PDF, whose bytes are unsigned, is not as signing writes it."""
    start, first, second, last = (int(each) for each in signature.byte_range)
    found = content[start + first : second]
    written = re.fullmatch(rb"<([0-9A-F]+)>", found)
    if start != 0 or second + last != len(content) or written is None:
        raise _NotIntactError("was changed: its signature does not cover the whole file")
    whole = signature.signed_data
    kept = bytes.fromhex(written[1].decode())
    framed = _framed(signature)
    if not kept.startswith(framed) or kept[len(framed) :].strip(b"\0"):
        raise _NotIntactError("was changed: its signature has other parts than a laboratory writes")
    if len(whole["certificates"]) != 1 or len(whole["signer_infos"]) != 1:
        raise _NotIntactError("was changed: its signature names several signers")


def _framed(signature: Any) -> bytes:  # noqa: ANN401 - pyHanko is imported late
    """Return the bytes that signing would write around the signed attributes and their proof."""
    from asn1crypto import cms

    found = signature.signer_info
    certificate = signature.signer_cert
    information = cms.SignerInfo(
        {
            "version": "v1",
            "sid": cms.SignerIdentifier(
                "issuer_and_serial_number",
                cms.IssuerAndSerialNumber(
                    {"issuer": certificate.issuer, "serial_number": certificate.serial_number}
                ),
            ),
            "digest_algorithm": {"algorithm": _DIGEST},
            "signed_attrs": found["signed_attrs"],
            "signature_algorithm": {"algorithm": "sha256_ecdsa"},
            "signature": found["signature"].native,
        }
    )
    data = cms.SignedData(
        {
            "version": "v1",
            "digest_algorithms": cms.DigestAlgorithms([{"algorithm": _DIGEST}]),
            "encap_content_info": {"content_type": "data"},
            "certificates": [certificate],
            "signer_infos": [information],
        }
    )
    return bytes(cms.ContentInfo({"content_type": "signed_data", "content": data}).dump(force=True))


def _leaves(node: Any) -> list[Any]:  # noqa: ANN401 - a dictionary of pyHanko
    """Return the specifications of files in a name tree."""
    found = list(node["/Names"])[1::2] if "/Names" in node else []
    kids = node["/Kids"] if "/Kids" in node else []  # noqa: SIM401 - pyHanko's get resolves no pointer
    for kid in kids:
        found += _leaves(kid.get_object())
    return [each.get_object() for each in found]


# Signers


def _one_of(embedded: x509.Certificate, signers: Sequence[x509.Certificate] | None) -> x509.Certificate:
    """Return the signer that a file names; raises where it is none of those that are known."""
    for each in (embedded,) if signers is None else signers:
        if _der(each) == _der(embedded):
            return each
    raise _NotIntactError(f"names {name_of(embedded)} as signer, none of those given")


def _der(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(serialization.Encoding.DER)
