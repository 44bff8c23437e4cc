"""What a noise measurement adds to a calibration: its terms, beside all that the calibration had before."""

from __future__ import annotations

from typing import Any

import numpy as np

from tumble.calibration.contributions import NOISE, contributed, contribution, log_content, part
from tumble.noise.result import BIAS_INSTABILITY, RANDOM_WALK, WHITE, NoiseResult
from tumble.units import UNITS

_TERMS = dict(zip(NOISE, (WHITE, BIAS_INSTABILITY, RANDOM_WALK), strict=True))


def noise_content(result: NoiseResult) -> dict[str, Any]:
    """Content of the calibration file: that it was started from, with the noise that was found.

    A triad without a section is given one that leaves its readings as they are.
    """
    run = contribution(
        "noise",
        [part(triad, "noise") for triad in result.triads],
        options=result.options,
        software=result.software,
        date=result.date,
        logs=[log_content(file, facts) for file, facts in zip(result.sources, result.logs, strict=True)],
    )
    content = contributed(result.start or {"name": result.name, "serial": result.serial}, run)
    for triad in result.triads:
        nothing = {"unit": UNITS[triad], "M": np.eye(3), "b": np.zeros(3), "estimated": ()}
        section = dict(content.get(triad, nothing))
        content[triad] = section | {key: result.term(triad, word) for key, word in _TERMS.items()}
    return content
