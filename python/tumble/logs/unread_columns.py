"""Columns of a table that no name explains: which of them may be a triad, and the option that reads it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from tumble.foundation.units import TRIADS, Triad, channels_of

_AXES = "xyz"
_MOST_LISTED = 24


def triple_in(names: Sequence[str]) -> tuple[str, str, str] | None:
    """Returns the first three names that differ by x, y and z alone, or are 1, 2 and 3; None without any."""
    known = {name.lower(): name for name in names}
    for name in names:
        for found in re.finditer("x", name.lower()):
            before, behind = name.lower()[: found.start()], name.lower()[found.end() :]
            three = [known.get(f"{before}{axis}{behind}") for axis in _AXES]
            if three[1] is not None and three[2] is not None:
                return name, three[1], three[2]
    return ("1", "2", "3") if list(names[:3]) == ["1", "2", "3"] else None


def option_for(triad: Triad, columns: Sequence[str]) -> str:
    """Returns the option that reads three columns as a triad."""
    return columns_option(zip(channels_of(triad), columns, strict=True))


def columns_option(named: Iterable[tuple[str, str]]) -> str:
    """Returns the option that reads columns as channels; in quotes where a name needs them for a shell."""
    text = ",".join(f"{channel}={name}" for channel, name in named)
    return f"--columns {text}" if re.fullmatch(r"[\w=,./:-]+", text) else f'--columns "{text}"'


def listed(names: Sequence[str]) -> str:
    """Returns names for a message, the first of them where there are many."""
    shown = ", ".join(names[:_MOST_LISTED])
    return f"{shown}, and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else shown


def on_missing(missing: Triad, unread: Sequence[str]) -> str:
    """Returns a sentence on a triad that was not found in a table with columns that no name explains."""
    three = triple_in(unread)
    if three is None:
        return f"no {missing} is known by name among the columns; not read: {listed(unread)}"
    return (
        f"no {missing} is known by name, but {listed(three)} are not read: if they are it, give "
        f"{option_for(missing, three)} and --{missing}-unit"
    )


def on_unread(unread: Sequence[str], triads: Sequence[Triad]) -> Iterator[str]:
    """Yields sentences on columns that are not read."""
    missing = [triad for triad in TRIADS if triad not in triads]
    if unread and len(missing) == 1:
        yield on_missing(missing[0], unread)
    elif unread:
        yield f"columns that are not read: {listed(unread)}"
