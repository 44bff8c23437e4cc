"""Standing of a reference's certificate: whether the laboratory that issued it has withdrawn it since."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import select

from tumble.calibration.document import CertificateOfReference
from tumble.foundation.errors import TumbleError
from tumble.laboratory import tables
from tumble.laboratory.certificate.dcc_reader import read_dcc
from tumble.laboratory.certificate.record import certificate_row
from tumble.laboratory.certificate.verification import fault_of_state
from tumble.laboratory.registry import Registry

_DOCUMENTS = (".xml", ".pdf")
"""Endings of files that a laboratory issues; a registry holds none that users write, such as YAML."""


@dataclass(frozen=True, slots=True)
class Standing:
    """Answer of a registry about the certificate of a reference."""

    fault: str = ""
    """Reason why it does not hold, with the remedy; empty where none is known."""
    sentence: str = ""
    """Describes the answer where there is no fault."""


def standing_of(address: str | Path, certificate: CertificateOfReference) -> Standing:
    """Return whether a certificate of a reference holds by a registry, which may have no answer."""
    try:
        return standing_in(Registry(address), certificate)
    except TumbleError as error:
        return Standing(sentence=f"the registry has no answer whether it was withdrawn: {error}")


def standing_in(registry: Registry, certificate: CertificateOfReference) -> Standing:
    """Return whether a certificate of a reference holds by an open registry.

    Two certificates are one where number and laboratory, or number and serial, are the same: laboratories
    count on their own. Raises `TumbleError` where the registry cannot be read.
    """
    row = _row_of(registry, certificate)
    if row is None:
        return Standing(
            sentence="the registry holds no such certificate; ask the laboratory whether it still holds"
        )
    if fault := fault_of_state(row):
        return Standing(f"{fault}; calibrate with a certificate of the reference that holds")
    is_document = certificate.file.lower().endswith(_DOCUMENTS)
    if is_document and certificate.sha256 not in _documents_of(registry, row["number"]):
        return Standing(
            f"certificate {row['number']} is another file in the registry; give that of tumble certificate "
            f"show {row['number']} -o FOLDER"
        )
    return Standing(sentence="issued, and not withdrawn since, by the registry")


def _row_of(registry: Registry, certificate: CertificateOfReference) -> dict[str, Any] | None:
    c = tables.certificate.c
    with registry.database.reading() as connection:
        chosen = select(c.number).where(c.number == certificate.number).limit(1)
        if connection.execute(chosen).first() is None:
            return None
    row = certificate_row(registry, certificate.number)
    found = read_dcc(registry.document(row["xml"]), f"certificate {certificate.number}")
    is_same = _folded(found.laboratory.name) == _folded(certificate.laboratory) or (
        certificate.serial != "" and found.item.serial == certificate.serial
    )
    return row if is_same else None


def _documents_of(registry: Registry, number: str) -> set[str]:
    """Return the SHA-256 of all files that a certificate has had, such as those before it was signed."""
    c = tables.certificate.c
    with registry.database.reading() as connection:
        rows = connection.execute(select(c.pdf, c.xml).where(c.number == number))
        return {digest for row in rows for digest in row}


def _folded(name: str) -> str:
    return " ".join(name.casefold().split())
