"""Days as text: in one form alone, in which they compare as they follow one another."""

from __future__ import annotations

from datetime import date


def day_of(text: str) -> date | None:
    """Returns a day written YYYY-MM-DD; None of all else, as of 20260331 and 2026-W14-2 in ISO 8601."""
    try:
        found = date.fromisoformat(text)
    except ValueError:
        return None
    return found if found.isoformat() == text else None
