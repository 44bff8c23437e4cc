"""Conditions on a recording that is to show the noise of its sensor."""

from __future__ import annotations

from collections.abc import Iterator

from tumble.foundation.services import Evidence, Service


def services(evidence: Evidence) -> Iterator[Service]:
    """Judges the suitability of a recording."""
    yield evidence.service("noise", evidence.lacking_still)
