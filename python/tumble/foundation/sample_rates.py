"""Sample rates that show the motion of a body, and those that show its rests alone."""

from __future__ import annotations

SLOWEST = 5.0
"""Hz: hands and robots turn within fractions of a second."""
TOO_SLOW = (
    "{rate:.3g} Hz is too slow to follow any motion: turns, and what happens between two samples, are not "
    "shown; noise and the effect of temperature at rest are"
)


def on_slow_rate(rate: float) -> tuple[str, ...]:
    """Returns a sentence on a rate, Hz, that is too slow to follow motion; nothing for others."""
    if not rate < SLOWEST:
        return ()
    return (TOO_SLOW.format(rate=rate),)
