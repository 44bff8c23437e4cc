"""An order for a guided run: units, their roles, answers to its questions, and the table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from tumble.logs.options import ReadOptions
from tumble.tools.guided.field import FieldValue


@dataclass(frozen=True, slots=True, kw_only=True)
class TableOrder:
    """A rate table that turns the units."""

    address: str
    """`DRIVER[:PLACE]`, as `--table` takes it."""
    limits: str = ""
    """`[AXIS.]KEY=VALUE,...`, as `--table-limits` takes it."""
    documents: Mapping[str, str] = field(default_factory=dict)
    """Texts of the files on which its motion depends, as it was armed; see `table_documents`."""
    armed: bool = False
    """Indicates whether it may move."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOrder:
    """All that a run needs to begin."""

    folder: Path
    """Folder of the results; the recording is `folder`/session."""
    sources: Mapping[str, str]
    """Address of each unit, as typed behind NAME=, by its name."""
    roles: Mapping[str, str] = field(default_factory=dict)
    """Role of each unit, by its name: that of a `UnitRole`."""
    serials: Mapping[str, str] = field(default_factory=dict)
    """Serial numbers, by the name of the unit, as far as they are known."""
    reading: Mapping[str, ReadOptions] = field(default_factory=dict)
    """Units, scales and axes of the readings, by the name of the unit, where they differ from the default."""
    options: Mapping[str, FieldValue] = field(default_factory=dict)
    """Answers to the questions of the run, by the name of the `RunField`; a missing one has its default."""
    table: TableOrder | None = None
    sender: str | None = None
    """Only address from which datagrams are accepted."""
    resume: bool = False
    """Indicates whether the recording that is there goes on."""
    operator: str = ""
    station: str = ""

    def named(self, role: str) -> tuple[str, ...]:
        """Returns the names of the units of a role, in their order."""
        return tuple(name for name in self.sources if self.roles.get(name) == role)

    def read_options(self) -> dict[str, ReadOptions]:
        """Returns the options of reading each unit, with its serial number."""
        return {
            name: replace(options, serial=self.serials.get(name, "") or options.serial)
            for name in self.sources
            for options in [self.reading.get(name, ReadOptions())]
        }
