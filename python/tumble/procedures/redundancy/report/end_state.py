"""State of a redundant set at the end: which unit is in use, and what is wrong; the badge of its page."""

from __future__ import annotations

from dataclasses import dataclass

from tumble.procedures.redundancy.report.text import unit_state
from tumble.procedures.redundancy.result import RedundancyResult


@dataclass(frozen=True, slots=True)
class EndState:
    """In a few words."""

    words: str
    """`primary failed, secondary_2 in use`."""
    kind: str
    """Class of the badge: a verdict."""
    sign: str


def end_state(result: RedundancyResult) -> EndState:
    """Returns the state at the end of a replay, or of what was watched so far."""
    source = result.selected[-1].unit if result.selected else ""
    words, verdict = [], result.verdict
    if source != result.primary:
        failed = unit_state(result, result.primary)[0] == "unhealthy"
        words.append(f"{result.primary} {'failed' if failed else 'not in use'}")
    words.append(f"{source or 'no unit'} in use")
    if verdict == "not calibrated":
        words.append("not all calibrated")
    elif verdict == "fail" and source:
        words.append("output in doubt")
    if verdict == "fail" or not source:
        return EndState(", ".join(words), "fail", "✕")
    if source != result.primary:
        return EndState(", ".join(words), "fail", "≠")
    if verdict == "not calibrated":
        return EndState(", ".join(words), "not-calibrated", "○")
    return EndState(", ".join(words), "pass", "✓")
