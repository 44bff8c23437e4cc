"""Verifies files of certificates: signature, content, and whether they still hold by the registry."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from cryptography import x509

from tumble.foundation.errors import TumbleError
from tumble.foundation.file_reading import read_whole
from tumble.laboratory.certificate.dcc_reader import LARGEST, read_dcc
from tumble.laboratory.certificate.record import certificate_row
from tumble.laboratory.certificate.signature import verify
from tumble.laboratory.registry import Registry


@dataclass(frozen=True, slots=True)
class Check:
    """Outcome of the verification of one file."""

    file: str
    number: str
    """Number of the certificate; empty where the file cannot be read."""
    signer: str
    state: str
    """`issued`, `withdrawn`, `superseded by NUMBER` by the registry; empty where none was asked."""
    fault: str
    """Reason why the file does not hold; empty where it does."""

    @property
    def holds(self) -> bool:
        """Return True if the file is as it was signed, and was not withdrawn."""
        return not self.fault

    @property
    def sentence(self) -> str:
        """Describe the outcome in one line."""
        if self.fault:
            return f"{self.file}: {self.fault}"
        state = f", {self.state}" if self.state else ""
        return f"{self.file}: certificate {self.number}, unchanged since {self.signer} signed it{state}"

    def content(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self) | {"holds": self.holds}


def check(path: Path, signers: Sequence[x509.Certificate], registry: Registry | None = None) -> Check:
    """Verify a file; raises `TumbleError` only where it cannot be read at all."""
    content = read_whole(path, LARGEST, "certificate", remedy="give a certificate")
    signed = verify(content, signers)
    if signed.fault:
        return Check(str(path), "", signed.signer, "", signed.fault)
    try:
        is_pdf = content.startswith(b"%PDF-")
        number = read_dcc(signed.xml, about=str(path)).number
        if registry is None:
            return Check(str(path), number, signed.signer, "", "")
        row = certificate_row(registry, number)
    except TumbleError as error:
        return Check(str(path), "", signed.signer, "", error.why)
    return Check(str(path), number, signed.signer, row["state"], _fault_on_record(row, content, is_pdf))


def _fault_on_record(row: dict[str, Any], content: bytes, is_pdf: bool) -> str:
    """Return the reason why a file does not hold by the registry; empty where it does."""
    if fault := fault_of_state(row):
        return fault
    if hashlib.sha256(content).hexdigest() != row["pdf" if is_pdf else "xml"]:
        return f"certificate {row['number']} is another file in the registry"
    return ""


def fault_of_state(row: dict[str, Any]) -> str:
    """Return the reason why a certificate on record does not hold; empty where it does."""
    if row["state"] == "withdrawn":
        return f"certificate {row['number']} was withdrawn on {row['withdrawn'][:10]}: {row['reason']}"
    return "" if row["state"] == "issued" else f"certificate {row['number']} was {row['state']}"
