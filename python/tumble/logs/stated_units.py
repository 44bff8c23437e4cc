"""Statements of units: the text that stands where a log states a unit, known or not."""

from __future__ import annotations

import re

from tumble.logs.track import COLUMN_NAME, StatedUnit
from tumble.logs.units import Quantity, find_unit

NO_UNIT = frozenset(
    (
        *("", "-", "--", "1", "?", "none", "n/a", "na", "n.a.", "nan", "null", "unknown", "undefined"),
        *("unitless", "dimensionless", "no_units", "no unit", "no units", "cal", "uncal"),
        *("x", "y", "z", "+x", "+y", "+z", "-x", "-y", "-z", "x-axis", "y-axis", "z-axis"),
        *(
            "imu",
            "body",
            "case",
            "device",
            "sensor",
            "world",
            "enu",
            "ned",
            "nwu",
            "frd",
            "flu",
            "rfu",
            "fur",
        ),
    )
)
"""Texts, in lower case, that state no unit wherever they stand: nothing, an axis, a frame."""
NO_UNIT_OF_TIME = (
    r"(?i).*\d:\d.*|.*h{1,2}:m{2}.*|.*y{2,4}.?m{2}.*|[+-]?\d{4}|(?:unix|epoch|posix|utc|gmt|gps|tai|local|iso.?8601"
    r"|date|datetime|boot|monotonic|unix epoch)(?: ?time)?(?:[ _]?stamp)?"
)
"""Clocks, zones and forms of dates, which stand behind the names of times."""
LONG_UNITS_OF_TIME = ("min", "h", "hr", "hrs", "d")
LONGEST = 60
"""Letters of a text that may state a unit; a longer one describes something."""
DESCRIPTOR = r"x[0-9a-f]{4}"
"""Any descriptor of a MIP field."""
COUNTS = r"(?:.*[^a-z])?(?:lsbs?|counts?|raw|digits?|adc|adu|ticks?|bits?)(?:[^a-z].*)?"
"""Texts, in lower case, that state counts of a scale that is not known."""
LIKE_A_UNIT = (
    r".*[/^%°²³⁻].*|(?:[\d.]+(?:e[+-]?\d+)?[ *]*)?g|(?:.*[^a-z])?(?:[mµuμn]?gal|gon|grad|degrees?|deg[cfk]?"
    r"|radians?|m?rad|dph|dpm|rph|rpm|rps|m?dps|mdeg|arcsec|arcmin|oersted|oe|[munµμ]?tesla|[munµμk]?gauss"
    r"|[munµμ]t|[munµμ]g|milli_?g|mv|volts?|feet|ft|celsius|fahrenheit|kelvin|rankine"
    r"|[cmdk]?m[ .·*]?s\^?-\d|m[ _]?s\^?2|[munµμ]?secs?|[munµμ]?seconds?|[munµμ]s|minutes?|hours?|days?"
    r")(?:[^a-z].*)?"
)
"""Texts, in lower case, that state a unit in parentheses, where a sensor or a frame may stand as well."""


def unknown_unit(text: str, quantity: Quantity, *, is_certain: bool = True) -> str:
    """Returns a text where a unit stands that names none that is known; empty where it states no unit.

    It is `is_certain` that a unit stands in square brackets and in attributes. Anything may stand in
    parentheses.
    """
    plain = " ".join(text.split())
    lower = plain.lower()
    if len(plain) > LONGEST:
        return ""
    if find_unit(plain, quantity) is not None or lower in NO_UNIT or re.fullmatch(DESCRIPTOR, lower):
        return ""
    if quantity == "time":
        if re.fullmatch(NO_UNIT_OF_TIME, lower):
            return ""
        # Beside other quantities it is the least of several readings.
        if lower in LONG_UNITS_OF_TIME:
            return plain
    return plain if is_certain or is_counts(plain) or re.fullmatch(LIKE_A_UNIT, lower) else ""


def is_counts(text: str) -> bool:
    """Returns whether a text states counts of a scale that is not known."""
    return re.fullmatch(COUNTS, text.lower()) is not None


def unit_in(
    text: str, quantity: Quantity, column: str, reason: str = COLUMN_NAME, *, is_certain: bool = True
) -> StatedUnit | None:
    """Returns the unit that a text beside a column states, known or not; None where it states none."""
    if name := find_unit(text, quantity):
        return StatedUnit(name, reason)
    unknown = unknown_unit(text, quantity, is_certain=is_certain)
    return StatedUnit("", reason, unknown=unknown, column=column) if unknown else None
