"""Magnetometers as autopilots hold them: a symmetric matrix, a rotation by number, an offset.

`u = C (y - b)` with `C = M^-1 = Q S`, S symmetric and Q a rotation, by the polar decomposition. S is what
autopilots hold exactly. In place of Q they hold the nearest of their rotations; the rest is lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tumble.calibration.document import Calibration, MagnetometerCalibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.firmware.magnetometers import StoredMagnetometer
from tumble.foundation.firmware.rotations import rotation
from tumble.foundation.magnetic import LoadUnit
from tumble.foundation.recording import FloatArray
from tumble.tools.exchange.calibration_parts import TYPICAL, Loss, section_of
from tumble.tools.exchange.target import Content

_SHARED = (*range(38), 39, 40)
"""Rotations that both autopilots know by these numbers."""


@dataclass(frozen=True, slots=True)
class HeldMagnetometer:
    """A magnetometer as `u = N S (y - b - c p)`."""

    number: int
    """Rotation N by number; 0 is none."""
    turn: FloatArray
    """(3, 3) N."""
    matrix: FloatArray
    """(3, 3) S, in the axes of the sensor."""
    bias: FloatArray
    """(3,) b, uT."""
    current: FloatArray | None
    """(3,) c, uT per unit of p."""
    loss: Loss
    """Rest of the mounting; of size zero where N is all of it."""


def held(
    calibration: Calibration, section: MagnetometerCalibration, program: str, *, custom: int | None = None
) -> HeldMagnetometer:
    """Takes a magnetometer apart; raises `ProcedureError` where its axes are left-handed.

    `custom` is the number of a rotation that the program lets its user define: it holds all of the mounting.
    """
    left, stretch, right = np.linalg.svd(np.linalg.inv(section.M))
    mounting = left @ right
    if np.linalg.det(mounting) < 0.0:
        raise ProcedureError(
            f"{calibration.name}: the axes of the magnetometer are left-handed, and {program} turns "
            "right-handed ones; change the sign of an axis in the log and calibrate again"
        )
    if custom is None:
        number = max(_SHARED, key=lambda each: float(np.trace(rotation(each).T @ mounting)))
        turn = rotation(number)
    else:
        number, turn = custom, np.asarray(mounting, np.float64)
    size = TYPICAL["magnetometer"] * float(np.linalg.norm(turn @ mounting.T - np.eye(3), 2))
    return HeldMagnetometer(
        number=number,
        turn=turn,
        matrix=right.T @ np.diag(stretch) @ right,
        bias=section.b,
        current=section.current,
        loss=Loss(calibration.name, "magnetometer", "mounting in the case", size, "in 50 uT"),
    )


def upper(matrix: FloatArray) -> FloatArray:
    """Returns xy, xz and yz of a symmetric (3, 3) matrix."""
    values: FloatArray = matrix[np.triu_indices(3, 1)]
    return values


def load_unit(calibrations: Sequence[Calibration], program: str) -> LoadUnit | None:
    """Returns the unit of what disturbs the magnetometers; None where nothing is known to.

    Raises `ProcedureError` where they are of different units, as an autopilot has one for all.
    """
    units = {
        each.magnetometer.current_unit
        for each in calibrations
        if each.magnetometer is not None and each.magnetometer.current is not None
    }
    if len(units) > 1:
        raise ProcedureError(
            f"one calibration has the effect of current, another that of throttle, and {program} has one "
            "of them for all magnetometers; leave one out"
        )
    return units.pop() if units else None


def section_of_stored(stored: StoredMagnetometer) -> Content:
    """Returns the section of a calibration file; raises `CalibrationFileError` where it has no inverse."""
    section = section_of("magnetometer", stored.correction, stored.bias)
    if stored.current is None:
        return section
    return section | {"current": stored.current, "current_unit": stored.current_unit}
