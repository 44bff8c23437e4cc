"""Numbers of certificates by a laboratory's own pattern, such as `IMU-{year}-{n:04}`: unique, no gaps."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from string import Formatter

from tumble.foundation.errors import TumbleError
from tumble.foundation.words import quoted
from tumble.laboratory.certificate.model import line_of

USUAL = "{year}-{n:04}"
"""Pattern where the laboratory states none."""
_FIELDS = {"year": "", "month": "", "n": r"(0\d{1,2})?"}
"""Fields of a pattern, and the widths that each may have."""
_LONGEST = 60


@dataclass(frozen=True, slots=True)
class Pattern:
    """Pattern of a laboratory's numbers; n begins at 1 with each year or month that the pattern shows."""

    text: str

    def number(self, n: int, day: str) -> str:
        """Return the n-th number on a day such as `2026-11-26`."""
        year, month, _ = day.split("-")
        return self.text.format(year=year, month=month, n=n)


def parse_pattern(text: str) -> Pattern:
    """Read a pattern; raises `TumbleError` where it is none."""
    remedy = "give one such as IMU-{year}-{n:04}"
    try:
        parts = list(Formatter().parse(text))
    except ValueError as error:
        raise TumbleError(f"pattern {quoted(text)} of numbers: {error}; {remedy}") from error
    fields = [(field, width or "", conversion) for _, field, width, conversion in parts if field is not None]
    for field, width, conversion in fields:
        if field not in _FIELDS or conversion or not re.fullmatch(_FIELDS[field], width):
            raise TumbleError(
                f"pattern {quoted(text)} of numbers: {quoted(field)} is none of {', '.join(_FIELDS)}, or its "
                f"width is wrong; {remedy}"
            )
    if [field for field, _, _ in fields].count("n") != 1:
        raise TumbleError(f"pattern {quoted(text)} of numbers: needs {{n}} once, the count; {remedy}")
    if line_of(text) != text or len(text) > _LONGEST:
        raise TumbleError(
            f"pattern {quoted(text)} of numbers: is no line of at most {_LONGEST} letters; {remedy}"
        )
    return Pattern(text)


def first_free(pattern: Pattern, day: str, is_taken: Callable[[str], bool]) -> str:
    """Return the first number that is not taken, in a few questions where those taken have no gap."""
    low, high = 0, 1  # low is taken, or 0; high is free
    while is_taken(pattern.number(high, day)):
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        if is_taken(pattern.number(middle, day)):
            low = middle
        else:
            high = middle
    return pattern.number(high, day)
