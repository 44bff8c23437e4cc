"""Issues certificates: a number, the XML, its signature, the PDF, and the record of all."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tumble.foundation.file_names import file_stem
from tumble.foundation.files import FileKind, replacing
from tumble.laboratory.certificate.dcc import dcc_of
from tumble.laboratory.certificate.logo import Logo
from tumble.laboratory.certificate.model import Certificate
from tumble.laboratory.certificate.numbering import Pattern
from tumble.laboratory.certificate.pdf import font_families, pdf_of
from tumble.laboratory.certificate.record import Rendered, holding, issue

if TYPE_CHECKING:
    from tumble.laboratory.certificate.signing_key import SigningKey
    from tumble.laboratory.registry import Registry

PDF_KIND = FileKind("a PDF", re.compile(rb"\A%PDF-"), re.compile(rb"<pdf:Keywords>Tumble</pdf:Keywords>"))
XML_KIND = FileKind(
    "a Digital Calibration Certificate",
    re.compile(rb"digitalCalibrationCertificate"),
    re.compile(rb"<dcc:content>tumble<"),
)


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
    """Write PDF and XML of a certificate into a folder, by its number; raises `OutputError`."""
    stem = file_stem(found.number)
    paths = folder / f"{stem}.pdf", folder / f"{stem}.xml"
    for path, kind, content in zip(paths, (PDF_KIND, XML_KIND), (found.pdf, found.xml), strict=True):
        with replacing(path, kind) as file:
            file.write(content)
    return paths
