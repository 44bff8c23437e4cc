"""Issues certificates: a number, the XML, its signature, the PDF, and the record of all."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from tumble.foundation.file_names import file_stem
from tumble.foundation.files import FileKind, check_output, replacing
from tumble.laboratory.certificate.dcc import dcc_of
from tumble.laboratory.certificate.logo import Logo
from tumble.laboratory.certificate.model import Certificate
from tumble.laboratory.certificate.numbering import Pattern
from tumble.laboratory.certificate.pdf import font_families, pdf_of
from tumble.laboratory.certificate.record import Rendered, holding, issue

if TYPE_CHECKING:
    from tumble.laboratory.certificate.signing_key import SigningKey
    from tumble.laboratory.registry import Registry


@dataclass(frozen=True, slots=True)
class Layout:
    """Appearance of certificates, and the key that signs them."""

    template: Path | None = None
    logo: Logo | None = None
    key: SigningKey | None = None


def rendered(certificate: Certificate, layout: Layout) -> Rendered:
    """Return both renderings of a certificate, signed where a key is given; raises `TumbleError`."""
    xml = signed(dcc_of(certificate), layout.key)
    pdf = signed(pdf_of(certificate, xml, layout.template, layout.logo), layout.key)
    return Rendered(certificate.number, pdf, xml)


def signed(content: bytes, key: SigningKey | None) -> bytes:
    """Return a rendering with a signature, where there is a key."""
    if key is None:
        return content
    from tumble.laboratory.certificate.signature import sign

    return sign(content, key)


def without_certificate(registry: Registry, certificates: Sequence[Certificate]) -> list[Certificate]:
    """Return those of certificates whose results are on none yet, all of them where every one is.

    So a folder of which a part was certified, as when a run was killed, is simply given again.
    """
    every = [each.result for certificate in certificates for each in certificate.calibrated]
    held = holding(registry, every)
    new = [one for one in certificates if not any(each.result in held for each in one.calibrated)]
    return new or list(certificates)


def issue_all(
    registry: Registry, certificates: Sequence[Certificate], pattern: Pattern, layout: Layout, who: str
) -> list[Rendered]:
    """Issue certificates by the registry's numbers; raises `TumbleError`, what was issued before stays."""
    for each in certificates[:1]:
        font_families(each)  # a missing font is found before a number is given
    return [_issued(registry, each, pattern, layout, who) for each in certificates]


def _issued(
    registry: Registry, certificate: Certificate, pattern: Pattern, layout: Layout, who: str
) -> Rendered:
    return issue(
        registry,
        pattern,
        certificate.issued,
        [each.result for each in certificate.calibrated],
        lambda number: rendered(numbered(certificate, number), layout),
        supersedes=certificate.supersedes,
        who=who,
    )


def numbered(certificate: Certificate, number: str) -> Certificate:
    """Return a certificate with its number."""
    return certificate.model_copy(update={"number": number})


def write(found: Rendered, folder: Path) -> tuple[Path, Path]:
    """Write PDF and XML of a certificate into a folder, by its number.

    Raises `OutputError`, also where the files there are of another number: two may have one name of a file.
    """
    stem = file_stem(found.number)
    pdf, xml = folder / f"{stem}.pdf", folder / f"{stem}.xml"
    files = ((pdf, _pdf_of(found.number), found.pdf), (xml, _xml_of(found.number), found.xml))
    for path, kind, _ in reversed(files):  # the XML is known by its number with any layout
        check_output(path, kind)
    for path, kind, content in files:
        with replacing(path, kind) as file:
            file.write(content)
    return pdf, xml


def _xml_of(number: str) -> FileKind:
    stated = f"<dcc:uniqueIdentifier>{escape(number)}</dcc:uniqueIdentifier>"
    return FileKind(
        f"the Digital Calibration Certificate {number}",
        re.compile(
            rb"\A<\?xml [^>]*>\s*<dcc:digitalCalibrationCertificate .*" + re.escape(stated.encode()),
            re.DOTALL,
        ),
        re.compile(rb"<dcc:content>tumble<"),
    )


def _pdf_of(number: str) -> FileKind:
    """Kind of a PDF whose keywords state that number, or none, as layouts of before do."""
    stated = re.escape(escape(number, {"'": "&apos;", '"': "&quot;"}).encode())
    return FileKind(
        f"the PDF of certificate {number}",
        re.compile(rb"\A%PDF-"),
        re.compile(rb"<pdf:Keywords>Tumble(?:, " + stated + rb")?</pdf:Keywords>"),
    )
