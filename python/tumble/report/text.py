"""What all pages say in the same words: counts, lists, temperatures, verdicts."""

from __future__ import annotations

from collections.abc import Sequence

from tumble.results import Verdict

VERDICT_SIGNS: dict[Verdict, str] = {
    "pass": "✓",
    "fail": "✕",
    "calibrated": "●",
    "model not met": "≠",
    "partly calibrated": "◐",
    "not calibrated": "○",
    "aligned": "●",
    "partly aligned": "◐",
}
VERDICT_TITLES = {word: word.capitalize() for word in VERDICT_SIGNS}


def count_of(thing: str, count: int) -> str:
    """Print `1 target`, `5 targets`."""
    return f"{count} {thing}{'' if count == 1 else 's'}"


def join(names: Sequence[str]) -> str:
    """Join to `a`, `a and b`, `a, b and c`."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def temperature_sentence(temperature: tuple[float, float, float] | None) -> str:
    """Say the mean temperature at rest and its range."""
    if temperature is None:
        return "not recorded"
    low, mean, high = (f"{value:.1f}" for value in temperature)
    return f"{mean} °C at rest, from {low} to {high} °C"
