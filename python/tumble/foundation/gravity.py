"""Local gravity: what accelerometers at rest are held against."""

from __future__ import annotations

import math

from tumble import _core
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import ProcedureError


def local_gravity(gravity: float | None, latitude: float | None, height: float | None) -> tuple[float, str]:
    """Returns gravity in m/s^2 and where it comes from; `latitude` in deg, `height` in m.

    Raises `ProcedureError` where it cannot be the gravity of any place on Earth.
    """
    if gravity is not None:
        if not 9.5 < gravity < 10.0:
            raise ProcedureError(f"gravity of {gravity:g} m/s^2 is found nowhere on Earth; give it in m/s^2")
        return gravity, "given"
    if latitude is None:
        return STANDARD_GRAVITY, "standard"
    if not -90.0 <= latitude <= 90.0:
        raise ProcedureError(f"latitude of {latitude:g} deg is outside -90 to 90")
    above = height or 0.0
    return _core.normal_gravity(math.radians(latitude), above), f"WGS 84 at {latitude:g} deg, {above:g} m"
