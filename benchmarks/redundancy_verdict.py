"""What is said of a mission."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(slots=True)
class Verdict:
    """What is to be said of a mission; plain enough for JSON."""

    seed: int
    duration: float
    units: int
    counts: dict[str, int] = field(default_factory=dict)
    adoptions: list[dict[str, Any]] = field(default_factory=list)
    failovers: list[dict[str, Any]] = field(default_factory=list)
    output: dict[str, dict[str, float]] = field(default_factory=dict)
    """Root mean squares by phase: of the output, and of the secondary without fault that errs least, as it is
    compensated and, chosen anew, without calibration."""
    faultless: dict[str, float] = field(default_factory=dict)
    """Root mean square of the error of the output, where there was no fault at all."""
    replay_rate: float = 0.0
    findings: list[str] = field(default_factory=list)
    """In words, each to be looked at."""

    def plain(self) -> dict[str, Any]:
        """Give it as plain mappings."""
        return asdict(self)
