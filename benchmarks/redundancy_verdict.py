"""Verdict on a mission."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(slots=True)
class Verdict:
    """Verdict on a mission; plain enough for JSON."""

    seed: int
    duration: float
    units: int
    counts: dict[str, int] = field(default_factory=dict)
    adoptions: list[dict[str, Any]] = field(default_factory=list)
    replay_rate: float = 0.0
    findings: list[str] = field(default_factory=list)
    """In words, each to be looked at."""

    def plain(self) -> dict[str, Any]:
        """Returns it as plain mappings."""
        return asdict(self)
