"""JSON that `tumble certificate` prints."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from tumble.foundation.printed import Printed
from tumble.laboratory.certificate.command import SCHEMA


class CertificatesDocument(Printed):
    """Certificates: each command prints the keys that belong to it."""

    schema_: Literal["tumble-certificates/1"] = Field(SCHEMA, alias="schema")
    verdict: Literal["issued", "signed", "listed", "intact", "damaged"]
    certificates: list[dict[str, Any]] | None = None
    """Certificates that were issued or signed, with their files, or that are on record, with their state."""
    checks: list[dict[str, Any]] | None = None
    """Files that `verify` checked: number, signer, state by the registry, fault, and whether each holds."""
