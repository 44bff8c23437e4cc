"""What a noise measurement adds to a calibration: its terms, beside all that the calibration had before."""

from __future__ import annotations

from typing import Any

from tumble.calibration.contributions import NOISE, added
from tumble.noise.result import BIAS_INSTABILITY, RANDOM_WALK, WHITE, NoiseResult

_TERMS = dict(zip(NOISE, (WHITE, BIAS_INSTABILITY, RANDOM_WALK), strict=True))


def noise_content(result: NoiseResult) -> dict[str, Any]:
    """Content of the calibration file: that it was started from, with the noise that was found."""
    found = {
        triad: {key: result.term(triad, word) for key, word in _TERMS.items()} for triad in result.triads
    }
    return added(result, result.verdict, "noise", "noise", found)
