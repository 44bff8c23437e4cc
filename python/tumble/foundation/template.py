"""Texts with places such as `Go to {pose}`, filled by what stands in each place, and by nothing else.

`str.format` obeys what stands between the braces: a width of ten million makes a text of that length, and a
dot reads any attribute. A template may come from a file, so that here a place is a name and no more.
"""

from __future__ import annotations

import re

TYPE_CHECKING = False  # typing takes longer to import than this module
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

PLACE = re.compile(r"\{(\w+)\}")
"""A place of a template; doubled braces are no part of our texts."""


def _as_text(_name: str, value: object) -> str:
    return str(value)


def filled(
    template: str, values: Mapping[str, object], written: Callable[[str, object], str] = _as_text
) -> str:
    """Returns a template with what `written` makes of the name and the value of each place.

    A place without a value stays as it is.
    """

    def one(place: re.Match[str]) -> str:
        return written(place[1], values[place[1]]) if place[1] in values else place[0]

    return PLACE.sub(one, template)
