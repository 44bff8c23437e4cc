"""Messages on faults that acquisition finds."""

from __future__ import annotations

REST_REJECTIONS = {
    "vibrating": "vibration",
    "drifting": "gravity drifts: a slow turn",
    "turning": "angular rate differs from the rests beside it: a slow turn",
}
"""Why something quiet was no rest, by the code that `Acquired.rejected_rests` gives."""
