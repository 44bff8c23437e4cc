"""The magnetometer of a unit while it is turned by hand: the field it met, the next one, and its silences."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tumble.foundation.errors import ProcedureError
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import FloatArray
from tumble.live import LiveChunk
from tumble.poses.by_hand import orientation_words
from tumble.poses.pose_list import angle_between
from tumble.procedures.magnetometer.messages import LITTLE_COVERED, live_disturbance
from tumble.procedures.magnetometer.result import MagnetometerResult
from tumble.procedures.multipose.procedure import FEW_TO_CHECK
from tumble.procedures.multipose.result import MultiposeResult
from tumble.tools.record.objections import Objection

NO_FIELD = (
    "sends no readings of a magnetometer; name its columns mx, my, mz with --columns, or leave out "
    "--magnetometer"
)
SILENT_AFTER = 2.0
"""s of the unit's clock without a reading after which its magnetometer is silent."""
FIELD_NOW = 0.3
"""s of the newest readings from which the direction of the field is shown."""
ENOUGH_TO_OBJECT = 9 + FEW_TO_CHECK
"""Orientations from which a fit shows trouble, and is not merely short of them."""


@dataclass(frozen=True, slots=True)
class FieldShown:
    """The magnetic field as the calibration so far has it."""

    directions: int
    """Directions that differ from which it was met; 0 before the magnetometer's first calibration."""
    coverage: float
    """Share of all directions that it was met from, within 30 deg; NaN before that."""
    wanted: FloatArray | None
    """(3,) unit vector, case frame: where it is to point next; None where any heading will do."""
    now: FloatArray | None
    """(3,) unit vector, case frame: where it points now; None where that is not known."""
    off: float
    """deg between these two; NaN where either is not known."""


@dataclass(slots=True)
class LiveField:
    """Follows the readings of a magnetometer while they come."""

    _newest: float = -math.inf
    """s, of the last reading."""
    _silences: int = 0
    _is_silent: bool = False

    def push(self, chunk: LiveChunk) -> None:
        """Adds samples of its unit."""
        track = chunk.magnetic
        if track is not None:
            self._newest, self._is_silent = float(track.time[-1]), False

    @property
    def is_heard(self) -> bool:
        """Returns whether the magnetometer gave a reading."""
        return self._newest > -math.inf

    def refuse_without(self, name: str) -> None:
        """Raises `ProcedureError` where no reading came yet."""
        if not self.is_heard:
            raise ProcedureError(NO_FIELD, about=name)

    def objections(self, name: str, now: float) -> Iterator[Objection]:
        """Reports each silence of the magnetometer once; `now` is the time of the newest sample, s."""
        if now - self._newest <= SILENT_AFTER or not self.is_heard:
            return
        if not self._is_silent:
            self._is_silent = True
            self._silences += 1
        yield Objection(
            name,
            f"magnetometer silent {self._silences}",
            "its magnetometer gives no readings any more; check its cable and its driver: rests without them "
            "do not count for it",
        )


def field_shown(
    found: MagnetometerResult | None, newest: MagneticTrack | None, wanted: FloatArray | None
) -> FieldShown:
    """Returns the field that was met, and the direction it has by the newest readings."""
    now = None if found is None or newest is None or not len(newest) else _direction(found, newest)
    off = math.nan if now is None or wanted is None else angle_between(now, wanted)
    if found is None:
        return FieldShown(0, math.nan, wanted, now, off)
    return FieldShown(found.directions, found.coverage, wanted, now, off)


def fields_met(found: MagnetometerResult | None) -> tuple[FloatArray, ...]:
    """Returns (3,) unit vectors, case frame: where the field pointed at each undisturbed rest."""
    points = () if found is None else found.points
    return tuple(point.field / np.linalg.norm(point.field) for point in points if not point.disturbed)


def is_covered(result: MultiposeResult) -> bool:
    """Returns whether the magnetometer was calibrated, and the field met from enough directions."""
    found = result.magnetometer
    return found is not None and found.coverage >= LITTLE_COVERED


def field_objections(result: MultiposeResult) -> Iterator[Objection]:
    """Reports trouble with the field that more orientations do not mend."""
    if result.directions < ENOUGH_TO_OBJECT:
        return
    if result.magnetometer_reason:
        text = f"its magnetometer is not calibrated: {result.magnetometer_reason}"
        yield Objection(result.name, "magnetometer", text)
    if result.magnetometer is None:
        return
    ups = {rest.start: pose.up for rest, pose in zip(result.rests, result.poses, strict=False)}
    for point in result.magnetometer.disturbed:
        text = live_disturbance(point, orientation_words(ups[point.start]))
        yield Objection(result.name, f"disturbed at {point.start:.1f} s", text)


def _direction(found: MagnetometerResult, newest: MagneticTrack) -> FloatArray:
    triad = found.magnetometer
    field = np.linalg.solve(triad.M, newest.field.mean(axis=0) - triad.b)
    return np.asarray(field / np.linalg.norm(field))
