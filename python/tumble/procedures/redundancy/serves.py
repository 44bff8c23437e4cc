"""Conditions on a recording of a redundant set."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tumble.foundation.services import SMALLEST_TURN, Evidence, Service, lacking_triad

_SMALLEST_CHANGE = 1.0
"""m/s^2"""


def services(evidence: Evidence) -> Iterator[Service]:
    """Judges the suitability of a recording."""
    partner = ("a second IMU logged with it by the same clock",) if evidence.alone else ()
    motion = () if _moved(evidence) else ("motion to compare the units in",)
    lacking = (*partner, *motion, *evidence.lacking_rate)
    yield lacking_triad(evidence, "redundancy") or evidence.service("redundancy", lacking)


def _moved(evidence: Evidence) -> bool:
    _, force, rate = evidence.trace
    swings = len(rate) > 0 and np.ptp(rate, axis=0).max() > SMALLEST_TURN
    pushes = len(rate) > 0 and np.ptp(force, axis=0).max() > _SMALLEST_CHANGE
    return bool(evidence.turned or swings or pushes)
