"""Conditions on a recording of a unit held in many orientations."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tumble import _core
from tumble.foundation.services import Evidence, Service, refused, unknown


def services(evidence: Evidence) -> Iterator[Service]:
    """Judges the suitability of a recording."""
    if "accelerometer" not in evidence.triads:
        yield refused("multipose", "accelerometer")
        return
    force = np.array([rest.specific_force for rest in evidence.rests_by_hand]).reshape(-1, 3)
    found = len(set(_core.multipose_directions(force)))
    wanted = f"rests in at least {_core.FEWEST_DIRECTIONS} orientations, held for 3 s"
    lacking = () if found >= _core.FEWEST_DIRECTIONS else (f"{wanted}, {found} found",)
    remarks = () if "gyroscope" in evidence.triads else (unknown("gyroscope"),)
    yield evidence.service("multipose", lacking, remarks)
