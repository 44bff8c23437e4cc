"""A text for people, in English, with its figures apart, so that it can be shown in their language."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias, Union

from tumble.foundation.template import filled

MessageValue: TypeAlias = Union[str, int, float, "Message"]
"""A name or a number, put as it is, or a message of its own."""


@dataclass(frozen=True, slots=True)
class Message:
    """A text with places, such as `Go to {pose}`, and what stands in them; `str` gives its English."""

    text: str
    """English text, by which catalogues know it."""
    values: Mapping[str, MessageValue] = field(default_factory=dict)
    """Value of each place by its name."""

    def __str__(self) -> str:
        """Returns the English text with its values."""
        return filled(self.text, self.values)

    def __bool__(self) -> bool:
        """Returns whether there is anything to show."""
        return bool(self.text)


def message(text: str, /, **values: MessageValue) -> Message:
    """Makes a message; catalogues collect the texts that are given here.

    >>> str(message("Go to {pose}.", pose="+x up"))
    'Go to +x up.'
    """
    return Message(text, values)


NOTHING = Message("")
"""No text."""
