"""What a noise measurement adds to a calibration: its terms, beside all that the calibration had before."""

from __future__ import annotations

from typing import Any

import numpy as np

from tumble.noise.result import BIAS_INSTABILITY, RANDOM_WALK, WHITE, NoiseResult
from tumble.units import UNITS

_PLACES = {"noise_density": WHITE, "bias_instability": BIAS_INSTABILITY, "random_walk": RANDOM_WALK}


def noise_content(result: NoiseResult) -> dict[str, Any]:
    """Content of the calibration file: that it was started from, with the noise that was found.

    A triad without a section is given one that leaves its readings as they are.
    """
    content: dict[str, Any] = dict(result.start) or {
        "name": result.name,
        "serial": result.serial,
        "software": result.software,
        "method": {"procedure": "noise", "options": result.options},
    }
    for triad in result.triads:
        nothing = {"unit": UNITS[triad], "M": np.eye(3), "b": np.zeros(3), "estimated": ()}
        section = dict(content.get(triad, nothing))
        content[triad] = section | {key: result.term(triad, word) for key, word in _PLACES.items()}
    return content
