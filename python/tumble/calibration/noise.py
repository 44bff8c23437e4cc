"""What a noise measurement adds to a calibration: its terms, beside all that the calibration had before."""

from __future__ import annotations

from typing import Any

import numpy as np

from tumble.calibration.contributions import NOISE, NOISE_FOR_FILTERS, added
from tumble.noise.keys import filter_density, filter_random_walk
from tumble.noise.result import BIAS_INSTABILITY, RANDOM_WALK, WHITE, NoiseResult
from tumble.recording import FloatArray
from tumble.units import Triad

_TERMS = dict(zip(NOISE, (WHITE, BIAS_INSTABILITY, RANDOM_WALK), strict=True))


def _for_filters(result: NoiseResult, triad: Triad) -> dict[str, FloatArray]:
    channels = [channel for channel in result.channels if channel.triad == triad]
    values = np.array([[filter_density(channel), filter_random_walk(channel)] for channel in channels])
    return dict(zip(NOISE_FOR_FILTERS, np.where(np.isfinite(values), values, np.nan).T, strict=True))


def noise_content(result: NoiseResult) -> dict[str, Any]:
    """Content of the calibration file: that it was started from, with the noise that was found."""
    found = {
        triad: {key: result.term(triad, word) for key, word in _TERMS.items()} | _for_filters(result, triad)
        for triad in result.triads
    }
    return added(result, result.verdict, "noise", "noise", found)
