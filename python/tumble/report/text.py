"""Common wording of all pages: temperatures, verdicts."""

from __future__ import annotations

from tumble.foundation.results import Verdict

VERDICT_SIGNS: dict[Verdict, str] = {
    "pass": "✓",
    "conditional pass": "✓",
    "conditional fail": "✕",
    "fail": "✕",
    "calibrated": "●",
    "model not met": "≠",
    "partly calibrated": "◐",
    "not calibrated": "○",
    "aligned": "●",
    "partly aligned": "◐",
    "measured": "●",
    "partly measured": "◐",
    "same": "=",
    "differ": "≠",
    "cannot be told": "○",
}
VERDICT_TITLES = {word: word.capitalize() for word in VERDICT_SIGNS}


def temperature_sentence(temperature: tuple[float, float, float] | None) -> str:
    """Describes the mean temperature at rest and its range."""
    if temperature is None:
        return "not recorded"
    low, mean, high = (f"{value:.1f}" for value in temperature)
    return f"{mean} °C at rest, from {low} to {high} °C"
