"""Numbers as people read them: rounded to their uncertainty, in a unit of a sensible size.

Laws, held by tests: sigma keeps two significant digits, the value keeps as many decimals as its sigma,
rounding moves neither by more than half of the last digit shown, and what is not finite is written in words.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal, localcontext

NOT_OBSERVABLE = "not observable"
GIVEN = "given"
"""Text in place of a sigma: the value was stated, not estimated."""
MINUS = "\N{MINUS SIGN}"
THIN_SPACE = "\N{THIN SPACE}"

_DIGITS_OF_ANY_FLOAT = 800
"""Decimal places between the largest and the smallest double, and some."""

_SIGNS = {
    "m/s^2": "m/s²",
    "m/s^2/sqrt(Hz)": "m/s²/√Hz",
    "rad/s/sqrt(Hz)": "rad/s/√Hz",
    "m/s^3": "m/s³",
    "m/s^3/sqrt(Hz)": "m/s³/√Hz",
    "rad/s^2": "rad/s²",
    "rad/s^2/sqrt(Hz)": "rad/s²/√Hz",
    "rad/s per m/s^2": "(rad/s)/(m/s²)",
    "m/s^2/K": "m/s²/K",
    "m/s^2/K^2": "m/s²/K²",
    "m/s^2/K^3": "m/s²/K³",
    "rad/s/K^2": "rad/s/K²",
    "rad/s/K^3": "rad/s/K³",
    "uT": "µT",
    "uT per A": "µT/A",
    "uT/sqrt(Hz)": "µT/√Hz",
    "degC": "°C",
    "1": "",
}

_PREFIXES = ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"))

_SMALLEST_READABLE = 0.1

_SQUARED = re.compile(r"(?<=/s)\^2")
_CUBED = re.compile(r"(?<=/s)\^3")
_ROOT_HERTZ = re.compile(r"sqrt\(Hz\)")
_NEGATIVE = re.compile(r"(?<![^\s(\[,=±])-(?=\.?\d)")
"""A hyphen that begins a number; one within a name, a date or a range does not."""


@dataclass(frozen=True, slots=True)
class Scale:
    """A unit to show numbers in: `shown = factor * value`."""

    unit: str
    factor: float

    def quantity(self, text: str) -> str:
        """Returns `text` with the unit behind it, where there is one and `text` is a number."""
        if text == NOT_OBSERVABLE:
            return text
        return f"{text} {self.unit}" if self.unit else text

    def number(self, value: float, sigma: float) -> str:
        """Prints a value of the unscaled unit with its 1-sigma, to stand below or beside this unit."""
        return measurement(self.factor * value, self.factor * sigma)

    def measurement(self, value: float, sigma: float) -> str:
        """Prints the same with this unit behind it."""
        return self.quantity(self.number(value, sigma))

    def figure(self, value: float, digits: int = 3) -> str:
        """Prints a value of the unscaled unit that has no sigma, with this unit behind it."""
        return self.quantity(significant(self.factor * value, digits))


def readable_unit(unit: str) -> str:
    """Returns a unit as printed: `m/s^2` becomes `m/s²`; the unit of a ratio is empty."""
    return _SIGNS.get(unit, unit)


def readable_scale(unit: str, magnitude: float) -> Scale:
    """Chooses the largest of unit, milli, micro and nano in which `magnitude` is not below 0.1.

    A ratio (`1`) is shown in % or ppm, its change with temperature (`1/K`) in ppm/K, an angle in `deg` stays
    in degrees. A magnitude that is zero or not finite keeps the unit.
    """
    size = abs(magnitude) if math.isfinite(magnitude) else 0.0
    if unit == "1":
        return Scale("ppm", 1e6) if 0 < size < 1e-4 else Scale("%", 1e2)
    if unit == "1/K":
        return Scale("ppm/K", 1e6)
    if unit.startswith("uT") and 0 < size < _SMALLEST_READABLE:
        return Scale("n" + readable_unit(unit)[1:], 1e3)
    if unit.startswith(("deg", "uT")) or size == 0:
        return Scale(readable_unit(unit), 1.0)
    factor, prefix = next((each for each in _PREFIXES if size * each[0] >= _SMALLEST_READABLE), _PREFIXES[-1])
    printed = readable_unit(unit)
    return Scale(f"({prefix}{printed[1:]}" if printed.startswith("(") else prefix + printed, factor)


def scales_of(magnitudes: Iterable[tuple[str, float]]) -> dict[str, Scale]:
    """Chooses for each unit the one scale in which all numbers of a column are shown: that of the largest.

    `magnitudes` are pairs of an unscaled unit and a number in it.
    """
    largest: dict[str, float] = {}
    for unit, magnitude in magnitudes:
        size = abs(magnitude) if math.isfinite(magnitude) else 0.0
        largest[unit] = max(size, largest.get(unit, 0.0))
    return {unit: readable_scale(unit, size) for unit, size in largest.items()}


def headed(title: str, scales: Mapping[str, Scale]) -> tuple[str, bool]:
    """Returns the head of a column, and whether it bears the unit, so that the cells need none.

    Cells of several units, such as those of both triads, each have their own.
    """
    units = {scale.unit for scale in scales.values()}
    if len(units) != 1 or units == {""}:
        return title, False
    return f"{title}, {units.pop()}", True


def typeset(sentence: str) -> str:
    """Prints the units and negative numbers of a sentence made for a terminal as all others of a page are."""
    return _NEGATIVE.sub(MINUS, _ROOT_HERTZ.sub("√Hz", _CUBED.sub("³", _SQUARED.sub("²", sentence))))


def round_pair(value: float, sigma: float) -> tuple[str, str]:
    """Rounds value and sigma to plain decimals, sigma to two significant digits, value to the same place.

    Errors: ValueError if either is not finite or sigma is not positive.
    """
    if not (math.isfinite(value) and math.isfinite(sigma) and sigma > 0):
        raise ValueError(f"no rounding of {value} to an uncertainty of {sigma}")
    with localcontext() as context:
        context.prec = _DIGITS_OF_ANY_FLOAT
        context.rounding = ROUND_HALF_EVEN
        rounded_sigma = _to_digits(Decimal(repr(float(sigma))), 2)
        rounded_value = Decimal(repr(float(value))).quantize(rounded_sigma)
        return _plain(rounded_value), _plain(rounded_sigma)


def round_like(value: float, sigma: float) -> str:
    """Rounds the value alone, to the place of its sigma; three significant digits where sigma is zero."""
    if not math.isfinite(value) or math.isnan(sigma) or math.isinf(sigma):
        return NOT_OBSERVABLE
    if sigma <= 0:
        return significant(value)
    return round_pair(value, sigma)[0]


def measurement(value: float, sigma: float, unit: str = "") -> str:
    """Prints `0.4123 ± 0.0012 m/s²`; an exact value stands alone, no finite sigma means not observable."""
    if not math.isfinite(value) or not math.isfinite(sigma):
        return NOT_OBSERVABLE
    scale = Scale(readable_unit(unit), 1.0)
    if sigma <= 0:
        return scale.quantity(significant(value))
    shown_value, shown_sigma = round_pair(value, sigma)
    return scale.quantity(f"{shown_value} ± {shown_sigma}")


def significant(value: float, digits: int = 3) -> str:
    """Prints a number without an uncertainty, in plain decimals with that many significant digits."""
    if not math.isfinite(value):
        return NOT_OBSERVABLE
    if value == 0:
        return "0"
    with localcontext() as context:
        context.prec = _DIGITS_OF_ANY_FLOAT
        number = Decimal(repr(float(value)))
        return _plain(_to_digits(number, digits))


def exact(value: float) -> str:
    """Prints a number someone chose, such as a limit: up to six significant digits, no trailing zeros."""
    text = significant(value, 6)
    return text.rstrip("0").rstrip(".") if "." in text else text


def fixed(value: float, decimals: int) -> str:
    """Prints a number with that many decimals and a true minus sign, never a negative zero."""
    if not math.isfinite(value):
        return NOT_OBSERVABLE
    text = f"{value:.{decimals}f}"
    if not text.strip("-0."):
        text = text.lstrip("-")
    return text.replace("-", MINUS)


def _to_digits(number: Decimal, digits: int) -> Decimal:
    last = number.adjusted() - digits + 1
    rounded = number.quantize(Decimal(1).scaleb(last))
    # 0.0996 rounds up to 0.100, which has a digit too many.
    return (
        rounded if rounded.adjusted() == number.adjusted() else number.quantize(Decimal(1).scaleb(last + 1))
    )


def _plain(number: Decimal) -> str:
    text = format(number, "f")
    return text.lstrip("-") if number.is_zero() else text.replace("-", MINUS)
