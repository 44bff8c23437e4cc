"""Identity of a result, on the first screen of its page and at the foot of every printed one.

It names the procedure, unit, serial, date and operator of the result.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from tumble.foundation.provenance import Provenance
from tumble.foundation.translation import translated

NOT_STATED = "not stated"
_COUNTERS = {"{page}": Markup("counter(page)"), "{pages}": Markup("counter(pages)")}
"""Counters of CSS for the numbers of a sheet."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Identity of one result."""

    procedure: str
    """`Turntable`, `Multi-pose`."""
    name: str
    """Name of the unit, or of the set."""
    serial: str
    """Empty where none is stated; of several units each with its name."""
    provenance: Provenance
    software: str
    started: str = ""
    """Date at which the recording began, as `LogTime.date` has it; empty where its stamps are no dates."""

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """Returns what stands on the first screen, by what it is."""
        made = self.provenance
        station = (("station", made.station),) if made.station else ()
        return (
            ("date", printed_date(made.date) or NOT_STATED),
            ("serial", self.serial or NOT_STATED),
            ("operator", made.operator or NOT_STATED),
            *station,
            *((("start", self.started),) if self.started else ()),
            ("software", self.software or NOT_STATED),
        )

    @property
    def names(self) -> frozenset[str]:
        """Returns what no language translates: names, serials and dates."""
        stated = {value for _, value in self.lines} - {NOT_STATED}
        return frozenset({self.name, self.serial, *stated})

    @property
    def footer(self) -> Markup:
        """Returns what stands at the foot of printed pages, as a string of CSS."""
        found = {name: value if value in self.names else translated(value) for name, value in self.lines}
        parts = (
            translated(self.procedure),
            self.name,
            f"{translated('serial')} {found['serial']}",
            found["date"],
            f"{translated('operator')} {found['operator']}",
        )
        return css_string(" · ".join(parts))

    @property
    def sheet(self) -> Markup:
        """Returns what numbers the sheets of printed pages, in CSS."""
        text = translated("page {page} of {pages}", page="{page}", pages="{pages}")
        parts = filter(None, re.split(r"(\{pages?\})", text))
        return Markup(" ").join(_COUNTERS[part] if part in _COUNTERS else css_string(part) for part in parts)


def serials(known: Mapping[str, str] | Sequence[tuple[str, str]]) -> str:
    """Prints the serials of several units, as far as they are known: `drive 123, spare 456`."""
    pairs = known.items() if isinstance(known, Mapping) else known
    return ", ".join(f"{name} {serial}" for name, serial in pairs if serial)


def printed_date(date: str) -> str:
    """Prints a date of ISO 8601 for people: `2026-11-22 06:20 UTC`; empty for none."""
    return f"{date[:10]} {date[11:16]} UTC" if date else ""


def css_string(text: str) -> Markup:
    """Quotes text of others for a style sheet: nothing in it ends the string, or the sheet."""
    quoted = "".join(
        letter if letter.isalnum() or letter in " .,:-·" else f"\\{ord(letter):x} " for letter in text
    )
    return Markup(f'"{quoted}"')
