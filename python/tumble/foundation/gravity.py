"""Local gravity, which accelerometers at rest are held against, and its uncertainty.

Method: docs/theory/uncertainty.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any, Final, Protocol

from tumble import _core
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import ProcedureError

GRAVITY: Final = "gravity"
"""Source of an uncertainty that results with the same gravity have in common."""
ANOMALY: Final = 3.5e-4
"""m/s^2: root mean square of free-air anomalies, 35 mGal (Kaula 1959; Heiskanen and Moritz, 1967)."""
FREE_AIR_GRADIENT: Final = 3.086e-6
"""m/s^2 per m (Heiskanen and Moritz, Physical Geodesy, 1967)."""
UNKNOWN_HEIGHT: Final = 300.0
"""m: 1-sigma of a height that nobody states; half of all people live below 194 m (Cohen and Small, 1998)."""
SPREAD: Final = 0.027
"""m/s^2: largest difference of standard gravity from normal gravity at sea level, at the equator."""
LARGEST_UNCERTAINTY: Final = 0.1


@dataclass(frozen=True, slots=True)
class LocalGravity:
    """Gravity at the place of a session."""

    value: float
    """m/s^2."""
    source: str
    """`standard`, `given`, `WGS 84 at 48.1 deg, 520 m`."""
    sigma: float | None
    """m/s^2; None for standard gravity, to which scale is relative."""


class HasGravity(Protocol):
    """Result whose accelerometer was held against gravity."""

    @property
    def gravity(self) -> float:
        """m/s^2."""

    @property
    def gravity_source(self) -> str:
        """`standard`, `given`, `WGS 84 at 48.1 deg, 520 m`."""

    @property
    def gravity_sigma(self) -> float | None:
        """m/s^2; None where nobody states it."""


def local_gravity(
    gravity: float | None, latitude: float | None, height: float | None, uncertainty: float | None = None
) -> LocalGravity:
    """Returns gravity and its uncertainty, both in m/s^2; `latitude` in deg, `height` in m.

    Raises `ProcedureError` where it cannot be the gravity of any place on Earth.
    """
    given = {"gravity": gravity, "latitude": latitude, "height": height, "gravity_uncertainty": uncertainty}
    for name, value in given.items():
        if value is not None and not isinstance(value, Real):
            raise ProcedureError(f"{name}: {value!r} is no number but {type(value).__name__}; give a number")
    if uncertainty is not None and not 0.0 <= uncertainty <= LARGEST_UNCERTAINTY:
        raise ProcedureError(
            f"uncertainty of gravity of {uncertainty:g} m/s^2: give its 1-sigma in m/s^2, 0 to "
            f"{LARGEST_UNCERTAINTY:g}"
        )
    if gravity is not None:
        if not 9.5 < gravity < 10.0:
            raise ProcedureError(f"gravity of {gravity:g} m/s^2 is found nowhere on Earth; give it in m/s^2")
        return LocalGravity(gravity, "given", uncertainty or 0.0)
    if latitude is None:
        if uncertainty is not None:
            raise ProcedureError("--gravity-uncertainty needs --gravity or --latitude; give one of them")
        return LocalGravity(STANDARD_GRAVITY, "standard", None)
    if not -90.0 <= latitude <= 90.0:
        raise ProcedureError(f"latitude of {latitude:g} deg is outside -90 to 90")
    above = height or 0.0
    of_height = FREE_AIR_GRADIENT * UNKNOWN_HEIGHT if height is None else 0.0
    return LocalGravity(
        _core.normal_gravity(math.radians(latitude), above),
        f"WGS 84 at {latitude:g} deg, {above:g} m",
        math.hypot(ANOMALY, of_height) if uncertainty is None else uncertainty,
    )


def shares_gravity(before: Mapping[str, Any], value: float, source: str) -> bool:
    """Returns whether the scale in the content of a calibration rests on the same gravity."""
    used = before.get("gravity") or {}
    same = used.get("value") == value and used.get("source") == source
    return same and "matrix" in before.get("accelerometer", {}).get("estimated", ())


def gravity_content(result: HasGravity) -> dict[str, Any]:
    """Give the gravity used as calibration files and JSON keep it."""
    return {"value": result.gravity, "source": result.gravity_source, "sigma": result.gravity_sigma}


def gravity_sentence(result: HasGravity, subject: str) -> str:
    """Report the gravity used, its source, and how uncertain it leaves `subject`."""
    used = f"{result.gravity:.5f} m/s² ({result.gravity_source})"
    if result.gravity_sigma is None:
        return (
            f"{used}; {subject} is relative to it, and gravity differs from it by up to {SPREAD:g} m/s² "
            "from place to place: state --latitude and --height, or --gravity"
        )
    if result.gravity_sigma == 0.0:
        return f"{used}, taken as exact; see --gravity-uncertainty"
    return f"{used} ± {result.gravity_sigma:.2g} m/s², within the sigmas of {subject}"
