"""Sources of a bench: those that were found or typed, their names, serials and roles, and their state."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias

from tumble.bench.authority import Shared, as_bench, query
from tumble.foundation.errors import LogError, TumbleError
from tumble.live.naming import parse_named_sources
from tumble.tools.doctor.devices import iio_devices, serial_ports
from tumble.tools.doctor.result import State
from tumble.tools.record.source_watch import SourceState, SourceWatch

Origin: TypeAlias = Literal["found", "typed"]
MOST_SOURCES = 64
_UNKNOWN = SourceState()


@dataclass(frozen=True, slots=True)
class BenchSource:
    """One source and the unit behind it."""

    name: str
    address: str
    serial: str = ""
    role: str = ""
    """Name of a role of the chosen kind of run; empty where it takes no part."""
    kind: str = ""
    """Word of the only procedure it is for, such as that of a simulated robot; empty for any."""
    origin: Origin = "typed"


class BenchSources(Shared):
    """The sources, in their order; they are looked at, except while a run has them."""

    @as_bench
    def __init__(self, sources: tuple[BenchSource, ...] = (), kind: str = "") -> None:
        self._sources = {each.name: each for each in sources}
        self._kind = kind
        self._watches: dict[str, SourceWatch] = {}
        self._watching = False
        self._lock = threading.RLock()

    def __iter__(self) -> Iterator[BenchSource]:
        return iter(tuple(self._sources.values()))

    def __getitem__(self, name: str) -> BenchSource:
        return self._sources[name]

    def __contains__(self, name: str) -> bool:
        return name in self._sources

    def __len__(self) -> int:
        return len(self._sources)

    @query
    def state(self, name: str) -> SourceState:
        """Returns the state of a source; an unknown one while it is not looked at."""
        watch = self._watches.get(name)
        return watch.state if watch is not None else _UNKNOWN

    def add(self, source: BenchSource) -> None:
        """Adds a source; raises `LogError` where its name or address is none, or is taken."""
        with self._lock:
            if len(self._sources) >= MOST_SOURCES:
                raise LogError(f"there are {MOST_SOURCES} sources already; remove one first")
            words = [f"{each.name}={each.address}" for each in (*self, source)]
            parse_named_sources(words)
            self._sources[source.name] = source
            self.watch(self._watching)

    def change(self, name: str, source: BenchSource) -> None:
        """Replaces a source; raises `LogError` as `add`."""
        with self._lock:
            changed = [source if each.name == name else each for each in self]
            parse_named_sources([f"{each.name}={each.address}" for each in changed])
            before = self._sources[name]
            self._sources = {each.name: each for each in changed}
            if (before.name, before.address) != (source.name, source.address):
                self._forget(name)
            self.watch(self._watching)

    def remove(self, name: str) -> None:
        """Removes a source; one that is not there is none."""
        with self._lock:
            self._sources.pop(name, None)
            self._forget(name)

    def watch(self, wanted: bool) -> None:
        """Looks at the sources of the kind from now on, or waits until all lines are free."""
        with self._lock:
            self._watching = wanted
            looked_at = {each.name: each for each in self.of_kind()} if wanted else {}
            for name in [name for name in self._watches if name not in looked_at]:
                self._forget(name)
            for each in looked_at.values():
                if each.name not in self._watches:
                    self._watch(each)

    @query
    def of_kind(self) -> list[BenchSource]:
        """Returns the sources that can take part in the chosen kind of run."""
        own = [each for each in self if each.kind == self._kind]
        return own or [each for each in self if not each.kind]

    def choose(self, kind: str, roles: tuple[tuple[str, int | None], ...]) -> None:
        """Chooses a kind of run; `roles` are the names of its roles, and for how many units there is a place.

        A source keeps its role where the kind has one of that name, and one that is named as a role has it;
        others fill the places that are left, in their order.
        """
        with self._lock:
            self._kind = kind
            known = [name for name, _ in roles]
            taken = {each.name: self._usual(each, known) for each in self.of_kind()}
            for role, most in roles:
                for name in [name for name, has in taken.items() if not has]:
                    if most is not None and list(taken.values()).count(role) >= most:
                        break
                    taken[name] = role
            for each in self:
                self._sources[each.name] = replace(each, role=taken.get(each.name, ""))
            self.watch(self._watching)

    @staticmethod
    def _usual(source: BenchSource, roles: list[str]) -> str:
        if source.role in roles:
            return source.role
        return source.name if source.name in roles else ""

    def _watch(self, source: BenchSource) -> None:
        self._watches[source.name] = SourceWatch(source.name, source.address)

    def _forget(self, name: str) -> None:
        watch = self._watches.pop(name, None)
        if watch is not None:
            watch.close()


@dataclass(frozen=True, slots=True)
class FoundLine:
    """A line on which a sensor may be."""

    address: str
    trouble: str = ""
    """Reason why it cannot be read, with the remedy; empty where it can."""


def found_lines(root: Path = Path("/")) -> list[FoundLine]:
    """Finds serial ports and sensors that Linux drives itself; `root` is where `dev` and `sys` are."""
    found = [("serial:", each) for each in serial_ports(root)]
    with suppress(OSError, TumbleError):  # a system without IIO has none
        found += [("iio:", each) for each in iio_devices(root)]
    return [
        FoundLine(f"{scheme}{each.part}", "" if each.state is State.WORKS else f"{each.what}; {each.remedy}")
        for scheme, each in found
        if each.state is not State.MISSING
    ]
