"""Prior knowledge of each unit of a redundant set: its place, its mounting, its ranges, its identity."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Annotated, Any, TypeAlias

import numpy as np
from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from tumble import _core
from tumble.foundation.documents import Document, Vector
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import FloatArray
from tumble.foundation.setting_table import Threshold
from tumble.foundation.units import CHANNELS, Channel
from tumble.foundation.words import short

_ORTHONORMAL = 1e-3
"""Largest departure of R R^T from the identity that is rounding by whoever typed it, not a mistake."""
_LARGEST_ANGLE = 2.0 * np.pi
"""rad; a longer rotation vector was written in degrees."""


class _OrientationField:
    """Marks a field as a rotation: a rotation vector, rad, a 3x3 matrix, or the name of a file."""

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(_orientation)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        row: JsonSchemaValue = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
        matrix = {"type": "array", "items": row, "minItems": 3, "maxItems": 3}
        return {"anyOf": [row, matrix, {"type": "string"}]}


def _orientation(value: object) -> FloatArray | str:
    if isinstance(value, str):
        return value
    wanted = "needs a rotation vector of 3 numbers in rad, a 3x3 matrix, or a file of tumble align"
    try:
        numbers = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{wanted}, found {short(value)}") from None
    if numbers.shape == (3,) and np.isfinite(numbers).all():
        if np.linalg.norm(numbers) > _LARGEST_ANGLE:
            raise ValueError(f"{wanted}; a vector of length {np.linalg.norm(numbers):.3g} looks like degrees")
        return _core.rotation_matrix(numbers)
    if numbers.shape != (3, 3) or not np.isfinite(numbers).all():
        raise ValueError(f"{wanted}, found {short(value)}")
    if np.abs(numbers @ numbers.T - np.eye(3)).max() > _ORTHONORMAL or np.linalg.det(numbers) < 0.0:
        raise ValueError(
            f"{wanted}; this matrix is no rotation: its rows have to be orthonormal, right-handed"
        )
    # Rounded rows are made orthonormal again: the nearest rotation.
    left, _, right = np.linalg.svd(numbers)
    nearest: FloatArray = left @ right
    return nearest


Orientation: TypeAlias = Annotated[Any, _OrientationField()]


class UnitSettings(Document):
    """Prior knowledge of one unit; all of it may be left out."""

    sensor_from_primary: Orientation = None
    """Nominal rotation from the primary's case frame to this unit's axes: a rotation vector (rad), a 3x3
    matrix, or a file that `tumble align` wrote; none if not given. Not for the primary."""
    lever_arm: Vector | None = None
    """Place of this unit from the primary, m, in the primary's case frame. Not for the primary."""
    time_offset: float = 0.0
    """Added to this unit's time, s."""
    axes: tuple[Channel, ...] | None = Field(default=None, min_length=1, strict=False)
    """Channels that the unit has, of ax ay az gx gy gz; those of its log if not given."""
    specific_force_range: float | None = Field(default=None, gt=0.0)
    """Largest reading of the accelerometer, m/s^2, from which on it is saturated."""
    angular_rate_range: float | None = Field(default=None, gt=0.0)
    """Largest reading of the gyroscope, rad/s, from which on it is saturated."""
    accelerometer_threshold: Threshold | None = None
    """Its own threshold of the accelerometer's deviation, m/s^2, in place of that of all secondaries,
    or of the primary."""
    gyroscope_threshold: Threshold | None = None
    """Its own threshold of the gyroscope's deviation, rad/s."""
    serial: str | None = Field(default=None, min_length=1)
    """Serial number of the unit; that of its log if not given. Stored errors of another are refused."""
    identity: int | None = Field(default=None, ge=0, lt=2**64)
    """Number by which stored errors know the unit; made from its serial if not given, or from its name."""


def with_axes(name: str, unit: UnitSettings, logged: Sequence[Channel] = CHANNELS) -> UnitSettings:
    """Fills in the channels that a unit has: those stated, or those of its log.

    Raises `ProcedureError` where one is stated that the log lacks.
    """
    for channel in unit.axes or ():
        if channel not in logged:
            raise ProcedureError(f"units: {name}: axes: its log has no {channel}; it has {' '.join(logged)}")
    return unit.model_copy(update={"axes": unit.axes or tuple(logged)})


def identity_of(name: str, unit: UnitSettings, serial: str = "", *, shared: bool = False) -> int:
    """Returns the number by which stored errors know a unit: stated, or 64 bits of a digest of its serial.

    The digest is of its name where it has none; of both where several units share the serial of their board.
    """
    if unit.identity is not None:
        return unit.identity
    known_by = f"{serial}\n{name}" if serial and shared else serial or name
    return int.from_bytes(hashlib.sha256(known_by.encode()).digest()[:8], "big")
