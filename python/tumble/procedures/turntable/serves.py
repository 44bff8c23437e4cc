"""Conditions on a recording of a turntable session."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from tumble.acquisition.acquire import FEWEST_RESTS
from tumble.foundation.recording import FloatArray
from tumble.foundation.services import Evidence, Service, refused, unknown

_SMALLEST_SPREAD = 0.1


def services(evidence: Evidence) -> Iterator[Service]:
    """Judges the suitability of a recording, as that of a reference and as that of a target."""
    as_reference, as_target = "turntable, as reference", "turntable, as target"
    unseen = () if evidence.turned else ("gyroscope scale and axes stay unknown without turns between rests",)
    if "accelerometer" not in evidence.triads:
        yield refused(as_reference, "accelerometer")
        yield evidence.service(as_target, _lacking_rests(evidence), (unknown("accelerometer"), *unseen))
        return
    lacking = _lacking_directions(evidence.directions)
    if "gyroscope" not in evidence.triads:
        yield evidence.service(as_reference, lacking, ("it serves no gyroscope, as none was recorded",))
        yield evidence.service(as_target, lacking, (unknown("gyroscope"),))
        return
    yield evidence.service(as_reference, lacking)
    yield evidence.service(as_target, lacking, unseen)


def _lacking_rests(evidence: Evidence) -> tuple[str, ...]:
    found = len(evidence.rests)
    return () if found >= FEWEST_RESTS else (f"at least {FEWEST_RESTS} rests, {found} found",)


def _lacking_directions(directions: Sequence[FloatArray]) -> tuple[str, ...]:
    if len(directions) < FEWEST_RESTS:
        wanted = f"rests in at least {FEWEST_RESTS} directions more than 20 deg apart"
        return (f"{wanted}, {len(directions)} found",)
    design = np.column_stack([np.array(directions), np.ones(len(directions))])
    if np.linalg.svd(design, compute_uv=False)[-1] < _SMALLEST_SPREAD * np.sqrt(len(directions)):
        return ("a rest out of the plane in which all directions found lie",)
    return ()
