"""Contribution of a noise measurement to a calibration: its terms, beside the earlier contents."""

from __future__ import annotations

import numpy as np

from tumble.calibration.contributions import NOISE, NOISE_FOR_FILTERS, added
from tumble.calibration.document import Calibration
from tumble.foundation.noise_terms import BIAS_INSTABILITY, RANDOM_WALK, WHITE
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import Triad
from tumble.procedures.noise.keys import filter_density, filter_random_walk
from tumble.procedures.noise.result import NoiseResult

_TERMS = dict(zip(NOISE, (WHITE, BIAS_INSTABILITY, RANDOM_WALK), strict=True))


def _for_filters(result: NoiseResult, triad: Triad) -> dict[str, FloatArray]:
    channels = [channel for channel in result.channels if channel.triad == triad]
    values = np.array([[filter_density(channel), filter_random_walk(channel)] for channel in channels])
    return dict(zip(NOISE_FOR_FILTERS, np.where(np.isfinite(values), values, np.nan).T, strict=True))


def calibration_of(result: NoiseResult) -> Calibration:
    """Creates the calibration file of a unit whose noise was measured, on top of what it was started from.

    A triad that has no calibration yet is left as measured.
    """
    found = {
        triad: {key: result.term(triad, word) for key, word in _TERMS.items()} | _for_filters(result, triad)
        for triad in result.triads
    }
    return Calibration.model_validate(added(result, result.verdict, "noise", "noise", found))
