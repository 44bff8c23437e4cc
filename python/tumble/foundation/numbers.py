"""Numbers in text: decimal digits of ASCII, as devices and loggers write them."""

from __future__ import annotations


def number_of(text: str, decimal_point: str = ".") -> float | None:
    """Reads a number, with sign, fraction and exponent as `-1.5e-3` has them, or `nan` or `inf`; or None.

    Python alone would read `1_0` as ten, and the digits of every script: in a log both are a torn line.
    """
    if decimal_point != ".":
        text = text.replace(decimal_point, ".")
    if not text.isascii() or "_" in text:
        return None
    try:
        return float(text)
    except ValueError:
        return None


MOST_DIGITS = 18
"""Digits of a whole number in text: no count, size or number of ours has more."""


def whole_number(text: str) -> int | None:
    """Reads a whole number without a sign; None for all else.

    Python's own tests for digits take those of every script, raised ones too, of which `int` makes errors; so
    it does of thousands of digits.
    """
    return int(text) if len(text) <= MOST_DIGITS and text.isascii() and text.isdigit() else None
