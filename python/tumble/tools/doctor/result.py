"""Diagnosis of a machine, part by part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any


class State(str, Enum):
    """State of a part."""

    WORKS = "works"
    MISSING = "missing"
    """State of a part that is not installed, or not plugged in."""
    REFUSED = "refused"
    """There, but this user may not use it."""
    BROKEN = "broken"
    """There, but it does not work."""


@dataclass(frozen=True, slots=True)
class Diagnosed:
    """One part."""

    part: str
    state: State
    what: str
    """Its version or what was seen of it; why it does not work."""
    remedy: str = ""
    """Remedy; empty where none is needed."""


@dataclass(frozen=True, slots=True)
class DiagnosisSection:
    """Parts that belong together."""

    name: str
    findings: tuple[Diagnosed, ...]
    is_needed: bool = False
    """Indicates whether nothing works without each of its parts."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """All that was found."""

    sections: tuple[DiagnosisSection, ...]

    @property
    def works(self) -> bool:
        """Returns whether all needed parts work; optional ones may be missing."""
        needed = [finding for section in self.sections if section.is_needed for finding in section.findings]
        return all(finding.state is State.WORKS for finding in needed)

    def content(self) -> Mapping[str, Any]:
        """Returns it as plain data."""
        sections = {
            section.name: [asdict(each) | {"state": each.state.value} for each in section.findings]
            for section in self.sections
        }
        return {"works": self.works, "sections": sections}
