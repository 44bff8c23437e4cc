"""Which driver turns which table: those that come with Tumble, and those that other packages bring."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import TypeAlias, cast
from urllib.parse import parse_qsl

from tumble.foundation.errors import TableError
from tumble.foundation.numbers import number_of
from tumble.tools.table.rate_table import RateTable

GROUP = "tumble.tables"
"""Entry points of this group, named as their driver, are drivers that other packages bring."""


@dataclass(frozen=True, slots=True)
class TableAddress:
    """`DRIVER[:PLACE][?KEY=VALUE&...]`, taken apart."""

    text: str
    """Text as typed by the user; messages name the table by it."""
    driver: str
    place: str = ""
    settings: Mapping[str, str] = field(default_factory=dict)
    documents: dict[str, str] = field(default_factory=dict)
    """Text of each file that a setting names, by the setting, as it was read first."""

    @classmethod
    def parse(cls, text: str) -> TableAddress:
        """Parses an address; raises `TableError` for an unknown driver or settings that are no pairs."""
        before, _, query = text.partition("?")
        driver, _, place = before.partition(":")
        if not driver:
            raise TableError(f"{text}: no table; expected DRIVER[:ADDRESS], such as simulated:two-axis")
        try:
            settings = dict(parse_qsl(query, keep_blank_values=True, strict_parsing=True)) if query else {}
        except ValueError:
            raise TableError(
                f"{text}: what follows the question mark is no list of KEY=VALUE&KEY=VALUE"
            ) from None
        return cls(text, driver.lower(), place, settings)

    def refuse_other_settings(self, *known: str) -> None:
        """Raises `TableError` where a setting is none of `known`: a misspelt one would be passed over."""
        for key in self.settings:
            if key not in known:
                raise TableError(
                    f"{self.text}: no setting {key!r} for {self.driver}; known: {', '.join(known) or 'none'}"
                )

    def document(self, key: str, read: Callable[[str], str]) -> str:
        """Returns the text of the file that a setting names; a driver reads such a file by this alone.

        It is read once: a table that was armed is opened with what it was armed for, and another process
        that stops it reads no file.
        """
        if key not in self.documents:
            self.documents[key] = read(self.settings[key])
        return self.documents[key]

    def number(self, key: str, default: float) -> float:
        """Returns a setting that is a number above zero; raises `TableError` where it is none."""
        text = self.settings.get(key)
        value = default if text is None else number_of(text)
        if value is None or not 0.0 < value < math.inf:
            raise TableError(f"{self.text}: {key}={text}: give a number above zero")
        return value


TableOpener: TypeAlias = Callable[[TableAddress], RateTable]
"""Makes a table of an address; the line itself is opened when the table is entered."""

OWN: Mapping[str, tuple[str, str]] = {
    "simulated": ("tumble.tools.table.simulated", "open_simulated"),
    "text": ("tumble.tools.table.text", "open_text"),
}
"""Module and function of each driver; imported only when it is asked for."""


def open_table(text: str, documents: Mapping[str, str] | None = None) -> RateTable:
    """Finds the table for an address; enter it with `with`, best within a `GuardedTable`.

    `documents` are those of `table_documents`, where they were read before.

    Raises `TableError` where no driver has that name.
    """
    address = replace(TableAddress.parse(text), documents=dict(documents or {}))
    return _opener(address)(address)


def table_documents(text: str) -> dict[str, str]:
    """Returns the text of each file on which the motion of the table at an address depends, by the setting.

    Raises as `open_table`.
    """
    address = TableAddress.parse(text)
    _opener(address)(address)
    return address.documents


def drivers() -> tuple[str, ...]:
    """Returns the drivers there are, Tumble's own first."""
    return (*OWN, *sorted(set(_installed()) - set(OWN)))


def _opener(address: TableAddress) -> TableOpener:
    if address.driver in OWN:
        module, attribute = OWN[address.driver]
        return cast("TableOpener", getattr(import_module(module), attribute))
    if address.driver in (installed := _installed()):
        return cast("TableOpener", installed[address.driver].load())
    raise TableError(f"{address.text}: no driver {address.driver!r}; known: {', '.join(drivers())}")


def _installed() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUP)}
