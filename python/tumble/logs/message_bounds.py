"""Bounds of definitions of ROS messages: a message makes about as many values as it has bytes.

Libraries parse a definition slowly, write out arrays of messages as code, and make empty messages of no
bytes, so that a few lines of a definition may stand for any number of values.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rosbags.interfaces import Nodetype

from tumble.logs.message_form import DEEPEST

MOST_LINES = 4000
"""Lines of one definition, with those of the types that it uses."""
MOST_LINES_OF_BAG = 5 * MOST_LINES
"""Lines of all definitions of one bag that are parsed."""
_MOST_BYTES = 1 << 18
"""Bytes of one definition."""
MOST_VALUES = 10_000
"""Values of one message, without the elements of its sequences; an array of numbers is one."""


class UnboundedDefinitionError(ValueError):
    """A definition that no message of a sensor has."""


@dataclass(frozen=True, slots=True)
class _Extent:
    """Extent of a message of one type, whatever its sequences hold."""

    values: int = 1
    empty: int = 0
    """Messages in it that take no bytes."""

    def __add__(self, other: _Extent) -> _Extent:
        return _Extent(self.values + other.values, self.empty + other.empty)

    def times(self, length: int) -> _Extent:
        """Returns that of an array."""
        return _Extent(self.values * length, self.empty * length)


def check_text(text: bytes) -> None:
    """Raises `UnboundedDefinitionError` where a definition is longer than any."""
    if len(text) > _MOST_BYTES or text.count(b"\n") > MOST_LINES:
        raise UnboundedDefinitionError(f"a definition of {len(text)} bytes")


def check_types(types: Mapping[str, Any]) -> None:
    """Checks types by name, as the library parses them.

    Raises `UnboundedDefinitionError` where a message holds itself, more values than `MOST_VALUES`, or a
    sequence of messages that take no bytes.
    """
    known: dict[str, _Extent] = {}
    for name in types:
        _extent(types, name, known, ())


def _extent(
    types: Mapping[str, Any], name: str, known: dict[str, _Extent], within: tuple[str, ...]
) -> _Extent:
    if name in known:
        return known[name]
    if name in within or len(within) > DEEPEST:
        raise UnboundedDefinitionError(f"{name} holds itself, or messages more than {DEEPEST} deep")
    fields = types[name][1] if name in types else []
    # The library gives an empty message a field that stands for none.
    is_empty = [field for field, _ in fields] in ([], ["structure_needs_at_least_one_member"])
    found = _Extent(empty=int(is_empty))
    for _, (kind, inner) in fields:
        found += _extent_of_field(types, kind, inner, known, (*within, name))
    if found.values > MOST_VALUES:
        raise UnboundedDefinitionError(f"{name} holds {found.values} values")
    known[name] = found
    return found


def _extent_of_field(
    types: Mapping[str, Any],
    kind: int,
    inner: Any,  # noqa: ANN401 - of the library
    known: dict[str, _Extent],
    within: tuple[str, ...],
) -> _Extent:
    if kind == Nodetype.NAME:
        return _extent(types, inner, known, within)
    if kind == Nodetype.BASE:
        return _Extent()
    element, length = inner
    if element[0] == Nodetype.BASE:
        return _Extent(length if kind == Nodetype.ARRAY and element[1][0] == "string" else 1)
    found = _extent(types, element[1], known, within)
    if kind == Nodetype.ARRAY:
        return found.times(length)
    if found.empty:
        raise UnboundedDefinitionError(f"a sequence of {element[1]}, which takes no bytes")
    return found
