"""Schemas and Schematron rules of PTB for Digital Calibration Certificates, offline."""

from __future__ import annotations

import sys
from functools import lru_cache
from pathlib import Path

import pytest
from lxml import etree

SCHEMAS = Path(__file__).parents[3] / "shared" / "dcc"


def schema_errors(xml: bytes) -> list[str]:
    """Breaches of the schemas; skips, and prints why, where they are absent."""
    if not (SCHEMAS / "dcc.xsd").exists():
        pytest.skip(f"no schemas of the DCC: {SCHEMAS} is absent")
    schema = _schema()
    schema.validate(etree.fromstring(xml))
    return [f"{entry.line}: {entry.message}" for entry in schema.error_log]


def rule_errors(xml: bytes) -> list[str]:
    """Breaches of Schematron rules that PTB counts as errors; skips, and prints why, before Python 3.11."""
    if sys.version_info < (3, 11):
        pytest.skip("dcclib, which has the Schematron rules, needs Python 3.11")
    found = _rules().validate_str(xml.decode().partition("\n")[2])
    every = [*found.failed_assertions, *found.successful_reports]
    # One rule forbids empty elements, which XML Signature has by its own standard.
    own = [each for each in every if "xmldsig" not in each.location]
    return [f"{each.location}: {each.text}" for each in own if each.role == "error"]


class _Local(etree.Resolver):
    def resolve(self, url, _public, context):
        path = SCHEMAS / url.rpartition("/")[2]
        return self.resolve_filename(str(path), context) if path.exists() else None


@lru_cache(maxsize=1)
def _schema():
    parser = etree.XMLParser(no_network=True)
    parser.resolvers.add(_Local())
    return etree.XMLSchema(etree.parse(str(SCHEMAS / "dcc.xsd"), parser))


@lru_cache(maxsize=1)
def _rules():
    from dcclib.validation.schematron import SchematronValidator

    return SchematronValidator.for_dcc()
