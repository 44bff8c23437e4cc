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
