"""Which procedures a recording can serve, and what it lacks for the others: what all of them judge by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Rest
from tumble.foundation.units import Triad

_APART = np.deg2rad(20.0)
SMALLEST_TURN = 0.1
"""rad, beyond what the bias of a gyroscope feigns between two rests."""


@dataclass(frozen=True, slots=True)
class Service:
    """Suitability of a recording for a procedure."""

    procedure: str
    """`turntable, as reference`, `turntable, as target`, or the name of another procedure."""
    missing: tuple[str, ...]
    """Conditions of the procedure that the recording does not meet; empty if it is suitable."""
    remarks: tuple[str, ...] = ()
    """Quantities that will remain unknown although the recording is suitable."""

    @property
    def possible(self) -> bool:
        """True if nothing is missing."""
        return not self.missing


@dataclass(frozen=True)
class Evidence:
    """Evidence from a recording, by which procedures judge whether it suits them."""

    triads: Sequence[Triad]
    """Those recorded."""
    alone: bool
    """Indicates whether no other IMU was logged together with this one."""
    rests: tuple[Rest, ...]
    """Rests of a unit that lies."""
    rests_by_hand: tuple[Rest, ...]
    """Rests of a unit that is held by hand."""
    turn_angles: FloatArray
    """(k, 3) rad, between rests."""
    trace: tuple[FloatArray, FloatArray, FloatArray]
    """Times, s, specific forces, m/s^2, and angular rates, rad/s."""
    temperature: tuple[float, float] | None
    """Lowest and highest, degC."""
    has_magnetometer: bool
    """Indicates whether a magnetometer was recorded beside it."""
    faults: tuple[str, ...]
    """Faults that make the recording unsuitable for every procedure."""
    lacking_rate: tuple[str, ...] = ()
    """Reasons why the sample rate does not show motion."""

    @cached_property
    def directions(self) -> list[FloatArray]:
        """Unit vectors of the specific force at rest, those within 20 deg of an earlier one left out."""
        found: list[FloatArray] = []
        for rest in self.rests:
            length = float(np.linalg.norm(rest.specific_force))
            if length == 0.0:
                continue
            direction = rest.specific_force / length
            if all(float(np.arccos(np.clip(direction @ other, -1.0, 1.0))) > _APART for other in found):
                found.append(direction)
        return found

    @cached_property
    def turned(self) -> bool:
        """Returns whether any turn is larger than the bias of the gyroscope alone can explain."""
        spans = np.array([after.start - before.end for before, after in pairwise(self.rests)])
        if len(spans) == 0 or len(spans) != len(self.turn_angles):
            return False
        bias = np.array([rest.angular_rate for rest in self.rests[:-1]])
        beyond = np.linalg.norm(self.turn_angles - bias * spans[:, None], axis=1)
        return bool((beyond > SMALLEST_TURN).any())

    @property
    def lacking_still(self) -> tuple[str, ...]:
        """Reports that no rest of a lying unit was found."""
        return () if self.rests else ("a rest of at least 1 s, untouched",)

    def service(self, procedure: str, missing: Sequence[str] = (), remarks: Sequence[str] = ()) -> Service:
        """Judges the recording: `missing` are further conditions that it does not meet."""
        return Service(procedure, (*missing, *self.faults), tuple(remarks))


def unknown(triad: Triad) -> str:
    """Reports that a triad cannot be calibrated."""
    return f"the {triad} stays unknown, as none was recorded"


def refused(procedure: str, missing: Triad) -> Service:
    """Reports that a procedure cannot do without a triad."""
    return Service(procedure, (f"{missing} readings, none were recorded",))


def lacking_triad(evidence: Evidence, procedure: str) -> Service | None:
    """Refuses a recording for a procedure that needs both triads; None where both were recorded."""
    needed: tuple[Triad, ...] = ("accelerometer", "gyroscope")
    return next((refused(procedure, triad) for triad in needed if triad not in evidence.triads), None)
