"""The Earth's magnetic field at a place and a date, which the scale of a magnetometer rests on.

Source: the World Magnetic Model, by the package pygeomag. Method: docs/theory/magnetometer.md, section 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date

from tumble.foundation.errors import ProcedureError
from tumble.foundation.provenance import date_now

LARGEST_UNCERTAINTY = 20.0
"""uT."""
WEAKEST, STRONGEST = 15.0, 100.0
"""uT: no place on Earth has a weaker or a stronger field, not even beside rock of iron."""
_DAYS = 365.25


@dataclass(frozen=True, slots=True)
class EarthField:
    """The field at the place of a session."""

    strength: float | None
    """uT; None where nobody states it."""
    sigma: float
    """uT."""
    source: str
    """`free`, `given`, `WMM-2025 at 48.1, 11.6 deg on 2026-11-26`."""
    dip: float | None = None
    """deg, positive where the field points down; None where nobody states it."""
    dip_sigma: float = 0.0
    """deg."""


def earth_field(
    strength: float | None = None,
    *,
    uncertainty: float | None = None,
    latitude: float | None = None,
    longitude: float | None = None,
    height: float | None = None,
    day: date | None = None,
) -> EarthField:
    """Returns the field; `strength` and its 1-sigma `uncertainty` in uT, `latitude` and `longitude` in deg.

    `height` is that above the ellipsoid in m; `day` is today if not given. Raises `ProcedureError` where it
    cannot be the field of any place on Earth, or the model does not hold on that day.
    """
    if uncertainty is not None and not 0.0 <= uncertainty <= LARGEST_UNCERTAINTY:
        raise ProcedureError(
            f"uncertainty of the field of {uncertainty:g} uT: give its 1-sigma, 0 to {LARGEST_UNCERTAINTY:g}"
        )
    if strength is not None:
        if not WEAKEST <= strength <= STRONGEST:
            raise ProcedureError(
                f"a field of {strength:g} uT is found nowhere on Earth; give it in uT, 22 to 67"
            )
        return EarthField(strength, uncertainty or 0.0, "given")
    if longitude is None:
        if uncertainty is not None:
            raise ProcedureError("--field-uncertainty needs --field or --latitude and --longitude")
        return EarthField(None, 0.0, "free")
    if latitude is None:
        raise ProcedureError("--longitude needs --latitude to work out the Earth's field; give both")
    day = day or date.fromisoformat(date_now()[:10])
    return _by_model(latitude, longitude, height or 0.0, day, uncertainty)


def _by_model(
    latitude: float, longitude: float, height: float, day: date, uncertainty: float | None
) -> EarthField:
    """Evaluates the World Magnetic Model (docs/theory/magnetometer.md, eq. 11)."""
    from pygeomag import GeoMag
    from pygeomag.wmm.wmm_2025 import WMM_2025

    if not -90.0 <= latitude <= 90.0:
        raise ProcedureError(f"latitude of {latitude:g} deg is outside -90 to 90")
    if not -180.0 <= longitude <= 360.0:
        raise ProcedureError(f"longitude of {longitude:g} deg is outside -180 to 180")
    year = day.year + (day.timetuple().tm_yday - 1) / _DAYS
    model = GeoMag(coefficients_data=WMM_2025)
    try:
        # Its field is in nT and its height in km.
        found = model.calculate(latitude, longitude, 1e-3 * height, year)
    except ValueError:
        raise ProcedureError(
            f"the World Magnetic Model holds for 2025 to 2029, not on {day}; give --date, or --field in uT"
        ) from None
    sigma = found.calculate_uncertainty()
    return EarthField(
        1e-3 * found.f,
        1e-3 * sigma.f if uncertainty is None else uncertainty,
        f"WMM-2025 at {latitude:g}, {longitude:g} deg on {day}",
        found.i,
        sigma.i,
    )
