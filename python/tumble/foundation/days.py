"""Days and moments as text: in one form alone, in which they compare as they follow one another."""

from __future__ import annotations

from datetime import date, datetime, timedelta, timezone

from tumble.foundation import clock

_MOMENT = "%Y-%m-%dT%H:%M:%SZ"
_FIRST = "1970"
"""Year before which no result of Tumble was made."""
_AHEAD = timedelta(days=1)
"""Largest difference between the clocks of two computers."""


def day_of(text: str) -> date | None:
    """Returns a day written YYYY-MM-DD; None of all else, as of 20260331 and 2026-W14-2 in ISO 8601."""
    try:
        found = date.fromisoformat(text)
    except ValueError:
        return None
    return found if found.isoformat() == text else None


def moment_text(seconds: float) -> str:
    """Returns a moment, s since 1970 in UTC, as in `2026-11-22T06:20:00Z`."""
    return datetime.fromtimestamp(seconds, timezone.utc).strftime(_MOMENT)


def moment_of(text: str) -> datetime | None:
    """Returns the moment of that text; None of all else."""
    try:
        found = datetime.strptime(text, _MOMENT).replace(tzinfo=timezone.utc)
    except ValueError:
        return None
    return found if found.strftime(_MOMENT) == text else None


def mistake_in_date(text: str) -> str:
    """Returns the mistake in the date of something that happened, a day or a moment in UTC; empty for none.

    The clock of another computer may be ahead of ours by a day.
    """
    day, mark, _ = text.partition("T")
    if day_of(day) is None or day < _FIRST or (mark and moment_of(text) is None):
        return "is no date; give one such as 2026-11-22 or 2026-11-22T06:20:00Z"
    if text > moment_text(clock.utc() + _AHEAD.total_seconds()):
        return "is in the future; correct it, or the clock of the computer"
    return ""
