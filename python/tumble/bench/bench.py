"""The bench: sources, the chosen kind of run and its answers, the engine, and who holds it."""

from __future__ import annotations

import hashlib
import json
import math
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from tumble.bench.access import BROWSER_GONE, Access, Browser
from tumble.bench.authority import Shared, as_bench, query
from tumble.bench.beside import Beside
from tumble.bench.engine import Engine
from tumble.bench.fleet_view import FleetView
from tumble.bench.log.open_logs import OpenLogs
from tumble.bench.registry_view import RegistryView
from tumble.bench.run_folder import ACCEPTED, KIND, MARK, RunFolder, files_of, runs_in, unfinished
from tumble.bench.settings import BenchSettings
from tumble.bench.simulated import SimulatedBench
from tumble.bench.sources import BenchSource, BenchSources
from tumble.foundation import clock
from tumble.foundation.bounded_json import parse_json
from tumble.foundation.documents import LARGEST_DOCUMENT, well_typed
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_reading import read_whole
from tumble.foundation.file_status import is_file
from tumble.foundation.files import prepare_folder, write_text
from tumble.foundation.message import message
from tumble.foundation.plain import finite
from tumble.tools.guided.field import FieldValue
from tumble.tools.guided.order import RunOrder, TableOrder
from tumble.tools.guided.run import RunKind, run_kind, run_kinds
from tumble.tools.table.registry import table_documents

STATE = "bench.json"
CHOSEN_FILES = ("*.yaml", "*.yml")
"""Files of the folder that an operator may choose."""
STALLED, GRACE = 0.5, 3.0
"""s without a pulse of the server after which it is starved of its processor, and s that signs of life of a
browser, which then wait in its queue, may be late besides."""
BETWEEN_LOOKS = 0.1
"""s between two looks whether the operator's browser is there."""


MOTION_CHANGED = "what the table was armed for has changed; look at it, and arm the table again"
ABSENT = message(
    "The operator's browser was gone for {seconds} s, so the table was stopped.", seconds=f"{BROWSER_GONE:g}"
)
HANDED_OVER = message("The bench changed hands, so the table was stopped.")
NO_ANSWERS: Mapping[str, FieldValue] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class TableChoice:
    """Table that the operator chose."""

    address: str = ""
    """Empty for a table that is turned by hand."""
    limits: str = ""


@dataclass(frozen=True, slots=True)
class RunChoice:
    """Kind of run that is prepared, and the answers to its questions."""

    word: str
    options: Mapping[str, FieldValue] = field(default_factory=lambda: NO_ANSWERS)
    table: TableChoice = TableChoice()
    operator: str = ""
    station: str = ""


@dataclass(frozen=True, slots=True)
class ArmedMotion:
    """Motion that the table was armed for: any other one needs that anew."""

    word: str
    table: TableChoice
    options: tuple[tuple[str, FieldValue], ...]
    """Answers to the questions of the run, on which the way of the table depends."""
    tenure: int
    """Tenure of the holder of the bench; see `Access`."""


@dataclass(frozen=True, slots=True)
class PausedMotion:
    """Table that turns the units of a paused run once it goes on, and the tenure in which it is shown."""

    table: TableOrder
    files: str
    """Digest of the files of its order, such as a pose list; empty where one cannot be read."""
    tenure: int


class Bench(Shared):
    """All that the pages of one server share; its methods may be called from any thread.

    `simulated` serves the units of a simulated bench, and is entered already.
    """

    @as_bench
    def __init__(self, settings: BenchSettings, simulated: SimulatedBench | None = None) -> None:
        self.settings = settings
        self.simulated = simulated
        self.folder = prepare_folder(settings.folder)
        self.kinds: tuple[RunKind, ...] = tuple(run_kinds())
        self.access = Access(needs_token=not settings.is_local)
        self.engine = Engine(self._note_change)
        self.revision = 0
        """Number of changes so far, by which a page sees whether it is up to date."""
        self.choice = RunChoice(self.kinds[0].word, operator=settings.operator, station=settings.station)
        self.sources = BenchSources()
        self.logs = OpenLogs()
        self.beside = Beside()
        self.pulse = clock.now()
        """s at which the server last had time for its pages."""
        self._stalled_at = -math.inf
        self._armed: tuple[ArmedMotion, str, Mapping[str, str]] | None = None
        """Motion that the table is armed for, the digest of the files it depends on, and the documents of the
        table; never in a file."""
        self._tenure_of_run = 0
        """Tenure in which the run under way was begun: a table moves in no other."""
        self._ends = threading.Event()
        self._recall()
        self.offered = unfinished(self.folder)
        """A run that a killed server left, and that may go on; None where there is none."""
        self._watchdog = clock.thread(self._watch_operator, name="watchdog")
        self._watchdog.start()
        try:
            self.choose(self.choice.word)
            self.sources.watch(True)
        except BaseException:
            self.close()
            raise

    @property
    def kind(self) -> RunKind:
        """Kind of run that is prepared."""
        return run_kind(self.choice.word)

    def choose(self, word: str) -> None:
        """Prepares a kind of run; units take its roles."""
        if word != self.choice.word:
            options = {} if self.simulated is None else self.simulated.answers(word)
            self.choice = replace(self.choice, word=word, options=MappingProxyType(options))
            self._armed = None
        kind = self.kind
        self.sources.choose(word, tuple((role.name, role.most) for role in kind.roles))
        if kind.takes_table and self.simulated is not None and not self.choice.table.address:
            self.choice = replace(self.choice, table=TableChoice(self.simulated.table))
        self._keep()

    def answer(self, name: str, value: FieldValue) -> None:
        """Answers a question of the run that is prepared; raises `TumbleError` where it does not ask that."""
        if name not in (each.name for each in self.kind.fields):
            raise TumbleError(f"{name}: the run that is prepared does not ask for it; load the page again")
        options = MappingProxyType({**self.choice.options, name: value})
        self._change(replace(self.choice, options=options))

    def sign(self, *, operator: str | None = None, station: str | None = None) -> None:
        """States who calibrates, and where."""
        choice = self.choice
        who = choice.operator if operator is None else operator
        self._change(replace(choice, operator=who, station=choice.station if station is None else station))

    def change_table(self, *, address: str | None = None, limits: str | None = None) -> None:
        """Chooses another table, or other limits of its motion."""
        table = self.choice.table
        if address is not None:
            table = replace(table, address=address.strip())
        if limits is not None:
            table = replace(table, limits=limits.strip())
        self._change(replace(self.choice, table=table))

    def arm(self, shown: ArmedMotion) -> None:
        """Arms the table for one run, as a page has shown its `motion`.

        Raises `TumbleError` where no table is named, another motion is prepared by now, or a chosen file
        or the profile of the table cannot be read.
        """
        if not shown.table.address:
            raise TumbleError("no table is named; type its address first")
        armed = shown, self._digest(), table_documents(shown.table.address)
        if shown != self.motion:
            raise TumbleError(MOTION_CHANGED)
        self._armed = armed
        self.revision += 1

    def disarm(self) -> None:
        """Disarms the table."""
        self._armed = None
        self.revision += 1

    @property
    def is_armed(self) -> bool:
        """Returns whether the table is armed for the run as it is prepared, by whoever holds the bench."""
        return self._armed is not None and self._armed[0] == self.motion

    @property
    def motion(self) -> ArmedMotion:
        """Motion of the run that is prepared, in the tenure of now."""
        choice = self.choice
        options = tuple(sorted(choice.options.items()))
        return ArmedMotion(choice.word, choice.table, options, self.access.tenure)

    def change_source(self, name: str, changed: BenchSource) -> None:
        """Changes a source; raises `LogError` where its name or address is none, or is taken."""
        self.sources.change(name, changed)
        self._keep()

    def add_source(self, source: BenchSource) -> None:
        """Adds a source; raises `LogError` where its name or address is none, or is taken."""
        self.sources.add(source)
        self.choose(self.choice.word)

    def remove_source(self, name: str) -> None:
        """Removes a source."""
        self.sources.remove(name)
        self._keep()

    def take_serial(self, serial: str) -> str:
        """Gives a scanned serial to the next unit without one, and returns the unit's name; empty for none.

        Raises `LogError` where another unit has it.
        """
        units = [each for each in self.sources.of_kind() if each.role]
        if any(each.serial == serial for each in units):
            raise TumbleError(f"serial {serial} was scanned already; scan the next unit")
        last = self.kind.roles[-1].name
        waiting = [each for each in units if not each.serial and each.role == last]
        if not waiting:
            return ""
        self.change_source(waiting[0].name, replace(waiting[0], serial=serial))
        return waiting[0].name

    @query
    def missing(self) -> Iterator[str]:
        """Names the roles that lack a unit."""
        roles = [each.role for each in self.sources.of_kind()]
        for role in self.kind.roles:
            if roles.count(role.name) < role.fewest:
                yield role.name

    def start(self) -> None:
        """Begins the run that is prepared; raises `TumbleError` where that cannot be done."""
        if self.engine.state not in ("idle", "result", "error"):
            raise TumbleError("a run is under way; stop it first")
        tenure = self.access.tenure
        order = self._order()
        self._armed, self._tenure_of_run = None, tenure
        self.sources.watch(False)
        try:
            self.engine.begin(RunFolder.begin(self.folder, self.choice.word, order), order)
        except TumbleError:
            self.sources.watch(True)
            raise
        self.offered = None

    @as_bench
    def stop(self, browser: Browser) -> None:
        """Stops what runs, and the table: a safe state, to which whoever may operate may bring the bench."""
        if browser.rank == "operator" and self.engine.state == "running":
            self.engine.pause(message("Stopped by the operator."))

    def adopt_offer(self) -> None:
        """Takes the offered run as paused."""
        offered, self.offered = self.offered, None
        if offered is not None:
            self.sources.watch(False)
            self.engine.adopt(offered)

    @property
    def paused_motion(self) -> PausedMotion | None:
        """Motion with which the paused run goes on; None where no table turns its units."""
        table = self.engine.folder.order.table if self.engine.folder is not None else None
        if table is None:
            return None
        # It may be plugged in elsewhere by now.
        shown = replace(table, address=self.choice.table.address or table.address, armed=False)
        files = ""
        # A run whose table or file is none states that once it goes on.
        with suppress(TumbleError):
            shown = replace(shown, documents=table_documents(shown.address))
            files = self._digest_of_order()
        return PausedMotion(shown, files, self.access.tenure)

    def resume(self, *, armed: PausedMotion | None = None) -> None:
        """Goes on with the paused run; its table has to be `armed` anew, as it was shown.

        Raises `TumbleError` where that cannot be done, or another motion was shown.
        """
        folder = self.engine.folder
        if folder is None or self.engine.state not in ("paused", "error"):
            raise TumbleError("there is no run that could go on")
        if armed != self.paused_motion:
            raise TumbleError(MOTION_CHANGED)
        order = replace(
            folder.order,
            sources={name: self._address(name, before) for name, before in folder.order.sources.items()},
            resume=folder.has_recording,
            table=None if armed is None else replace(armed.table, armed=True),
        )
        self._tenure_of_run = self.access.tenure if armed is None else armed.tenure
        self.sources.watch(False)
        self.engine.begin(folder, order)

    def repeat(self) -> None:
        """Prepares the run of the outcome once more, for the same units."""
        self.engine.leave()

    def next_unit(self) -> None:
        """Prepares the next run: the same sources, and other units at the targets."""
        last = self.kind.roles[-1].name
        for each in self.sources.of_kind():
            if each.role == last:
                self.sources.change(each.name, replace(each, serial=""))
        self._keep()
        self.engine.leave()

    def accept(self) -> None:
        """Accepts the outcome: its calibrations go into the registry, where there is one; that may take long.

        Raises `TumbleError` where they cannot be entered, or another outcome is shown by then; the outcome is
        then not accepted.
        """
        outcome = self.engine.outcome
        if outcome is None:
            return
        registry = self.registry()
        if registry is not None:
            registry.enter(list(files_of(outcome)))
        if self.engine.outcome is not outcome:
            raise TumbleError("the result was left meanwhile, and is not accepted; look at it again")
        self.engine.decide(ACCEPTED)

    @query
    def registry(self) -> RegistryView | None:
        """Opens the registry; None where none is set. Raises `TumbleError` where it cannot be read."""
        return RegistryView(self.settings.registry) if self.settings.registry else None

    @query
    def fleet(self) -> FleetView:
        """Opens the jobs of fleets; raises `TumbleError` where a library is missing."""
        return FleetView(self.settings.fleet or self.folder)

    @query
    def chosen_file(self, name: str) -> Path:
        """Returns the path of a file of the folder; raises `TumbleError` for any other."""
        if name not in self.files():
            raise TumbleError(f"{name}: no such file in {self.folder}; choose one that is listed")
        return self.folder / name

    def discard_offer(self) -> None:
        """Leaves the offered run as it is."""
        self.offered = None
        self._note_change()

    @query
    def earlier(self) -> list[RunFolder]:
        """Returns the runs in the folder, the latest first."""
        return runs_in(self.folder)

    @query
    def files(self) -> list[str]:
        """Returns the names of files in the folder that an operator may choose, such as limits."""
        found = {path.name for pattern in CHOSEN_FILES for path in self.folder.glob(pattern) if is_file(path)}
        return sorted(found)

    @as_bench
    def close(self) -> None:
        """Pauses what runs, and lets go of all lines."""
        self._ends.set()
        clock.wait(self._watchdog)
        self.engine.close()
        self.sources.watch(False)
        self.logs.close()
        self.beside.close()

    def _order(self) -> RunOrder:
        kind, choice = self.kind, self.choice
        units = [each for each in self.sources.of_kind() if each.role]
        for role in kind.roles:
            if sum(each.role == role.name for each in units) < role.fewest:
                raise TumbleError(f"no unit is the {role.name}; choose one among the sources")
        files = {each.name for each in kind.fields if each.kind == "file"}
        return RunOrder(
            folder=self.folder,
            sources={each.name: each.address for each in units},
            roles={each.name: each.role for each in units},
            serials={each.name: each.serial for each in units if each.serial},
            options={
                name: str(self.chosen_file(str(value))) if name in files and value else value
                for name, value in choice.options.items()
            },
            table=self._table_order(),
            operator=choice.operator,
            station=choice.station,
        )

    def _table_order(self) -> TableOrder | None:
        """Returns the armed table; None where the units are turned by hand.

        Raises `TumbleError` where it was armed for another motion than the one that is prepared.
        """
        table = self.choice.table
        if self._armed is None or not (self.kind.takes_table and table.address):
            return None
        documents = self._armed[2]
        if self._armed != (self.motion, self._digest(), table_documents(table.address)):
            self._armed = None
            raise TumbleError(MOTION_CHANGED)
        return TableOrder(address=table.address, limits=table.limits, documents=documents, armed=True)

    def _digest(self) -> str:
        """Returns the digest of the chosen files; raises `TumbleError` where one cannot be read."""
        return _digest_of_files(self.kind, self.choice.options, self.chosen_file)

    def _digest_of_order(self) -> str:
        """Returns the digest of the files of the run under way; raises `TumbleError` as `_digest`."""
        folder = self.engine.folder
        assert folder is not None, "a paused run has a folder"
        return _digest_of_files(run_kind(folder.word), folder.order.options, Path)

    def _change(self, choice: RunChoice) -> None:
        self.choice = choice
        if not self.is_armed:
            self._armed = None
        self._keep()

    def _address(self, name: str, before: str) -> str:
        """Returns the address of a unit of a run that goes on: it may be plugged in elsewhere by now."""
        return self.sources[name].address if name in self.sources else before

    @as_bench
    def _note_change(self) -> None:
        self.revision += 1
        if self.engine.state in ("idle", "result", "error"):
            self._armed = None
            clock.thread(self._watch_again, name="watch again").start()

    @as_bench
    def _watch_again(self) -> None:
        if not self._ends.is_set() and self.engine.state in ("idle", "result", "error"):
            self.sources.watch(True)

    def _is_operator_gone(self) -> bool:
        """Returns whether the operator's browser has been gone for too long, rather than the server busy."""
        now = clock.now()
        if now - self.pulse > STALLED:
            self._stalled_at = now
        grace = GRACE if now - self._stalled_at < 1.0 else 0.0
        return self.access.silent > BROWSER_GONE + grace

    @as_bench
    def _watch_operator(self) -> None:
        """Stops a table once the tenure ends in which it was armed."""
        while not clock.wait(self._ends, BETWEEN_LOOKS):
            is_gone = self._is_operator_gone()
            if is_gone:
                self.access.note_absence()
            moves = self.engine.moves_table and not self.engine.is_ending
            if moves and self._tenure_of_run != self.access.tenure:
                self.engine.pause(ABSENT if is_gone else HANDED_OVER)
            view, folder = self.engine.view, self.engine.folder
            if self.simulated is not None and self.engine.state == "running" and view and folder:
                self.simulated.obey(folder.word, view)

    def _keep(self) -> None:
        """Stores sources and answers, so that a server that is started again knows them."""
        self.revision += 1
        choice = self.choice
        given = {"word": choice.word, "options": dict(choice.options), "table": asdict(choice.table)}
        given |= {"operator": choice.operator, "station": choice.station}
        content = MARK | {"sources": [asdict(each) for each in self.sources], "choice": given}
        write_text(self.folder / STATE, json.dumps(finite(content), indent=1), KIND, renews=True)

    def _recall(self) -> None:
        """Reads what was stored; sources of a simulation are those of now."""
        kept: dict[str, Any] = {}
        try:
            kept = parse_json(read_whole(self.folder / STATE, LARGEST_DOCUMENT))
            sources = [well_typed(BenchSource(**each)) for each in kept["sources"]]
            table = TableChoice(**kept["choice"]["table"])
            known_choice = well_typed(RunChoice(**kept["choice"] | {"table": table}))
            choice = replace(known_choice, options=MappingProxyType(dict(known_choice.options)))
        except (TumbleError, ValueError, KeyError, TypeError, AttributeError):
            # A first start, or a file of another version: nothing is lost but what can be typed again.
            sources, choice = [], self.choice
        if choice.word in (kind.word for kind in self.kinds):
            self.choice = choice
        if self.simulated is not None:
            known = {each.name: each for each in sources}
            sources = [
                replace(each, serial=known[each.name].serial, role=known[each.name].role)
                if each.name in known
                else each
                for each in self.simulated.sources
            ]
            self.choice = replace(self.choice, table=replace(self.choice.table, address=self.simulated.table))
        self.sources = BenchSources(tuple(sources), self.choice.word)


def _digest_of_files(kind: RunKind, options: Mapping[str, FieldValue], place: Callable[[str], Path]) -> str:
    """Returns the digest of the files among the answers; raises `TumbleError` where one cannot be read."""
    names = {each.name for each in kind.fields if each.kind == "file"}
    digest = hashlib.sha256()
    for name, value in sorted(options.items()):
        if name in names and value:
            digest.update(read_whole(place(str(value)), LARGEST_DOCUMENT))
    return digest.hexdigest()
