"""A station that issues certificates, whose documents are a line each."""

from __future__ import annotations

from tumble.foundation.errors import TumbleError
from tumble.laboratory.certificate import record
from tumble.laboratory.certificate.numbering import parse_pattern
from tumble.laboratory.registry import Registry


def issue(report, address, results):
    """Issues a certificate for each result that has none, and reports each number that it takes."""

    def make(number):
        report(number)
        return record.Rendered(number, f"%PDF- {number}".encode(), f"<xml>{number}</xml>".encode())

    registry, pattern = Registry(address, patience=120.0), parse_pattern("{n}")
    for result in results:
        try:
            record.issue(registry, pattern, "2026-11-26", [result], make)
        except TumbleError as error:
            if "is on certificate" not in str(error):
                raise
