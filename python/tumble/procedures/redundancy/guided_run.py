"""A watched set on a page: state of each unit, deviations against thresholds, the source, and events."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Final

from tumble.calibration.document import Calibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.file_names import EVENTS, REDUNDANCY_PAGE, STORE
from tumble.foundation.files import PAGE, check_output, prepare_folder, refuse_linked_folder
from tumble.foundation.message import message
from tumble.live import open_set
from tumble.logs.session import SessionClock, SessionProcedure
from tumble.procedures.redundancy.board import SetBoard
from tumble.procedures.redundancy.command_files import EVENTS_KIND
from tumble.procedures.redundancy.guided_outcome import outcome_of
from tumble.procedures.redundancy.guided_view import NEWEST, is_shown_at_once, view_of
from tumble.procedures.redundancy.live import LiveRedundancy
from tumble.procedures.redundancy.monitor import COMMANDS, MOST_SECONDARIES, Command, RedundancyMonitor
from tumble.procedures.redundancy.settings import RedundancySettings
from tumble.tools.guided.answers import Answers
from tumble.tools.guided.field import RunField, UnitRole
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.outcome import RunOutcome
from tumble.tools.guided.run import RunKind
from tumble.tools.guided.view import RunView
from tumble.tools.record.session_folders import next_session_folder
from tumble.tools.record.writer import RecordedUnit, SessionWriter

PRIMARY, SECONDARY = "primary", "secondary"
FIELDS = (
    RunField(
        name="duration",
        label=message("Duration"),
        kind="number",
        unit="min",
        least=0.1,
        most=100_000.0,
        help=message("Until it is stopped if it is not given."),
    ),
    RunField(name="settings", label=message("Settings of the monitor"), kind="file"),
    RunField(
        name="changes",
        label=message("Changes of settings"),
        kind="text",
        help=message("NAME=VALUE with semicolons between, such as evaluate_every=60"),
        advanced=True,
    ),
    RunField(
        name="as_published",
        label=message("Begin from the settings of the literature"),
        kind="flag",
        default=False,
        advanced=True,
    ),
    RunField(name="calibration", label=message("Calibration of the primary"), kind="file", advanced=True),
    RunField(
        name="stored",
        label=message("Go on from the errors stored by earlier runs"),
        kind="flag",
        default=False,
        help=message("They are kept beside the folders of the runs."),
        advanced=True,
    ),
)


class GuidedRedundancy:
    """One watch of a set; see `GuidedRun`. Its actions are the commands of the monitor.

    Raises `TumbleError`, in one line, where the order cannot be carried out.
    """

    def __init__(self, order: RunOrder) -> None:
        answers = Answers(FIELDS, order.options)
        primary, secondaries = _primary_of(order), order.named(SECONDARY)
        minutes = answers.number("duration")
        self._order = order
        self._reading = order.read_options()
        self._seconds = None if minutes is None else 60.0 * minutes
        self._as_published = answers.flag("as_published")
        self._units = open_set(
            [f"{name}={order.sources[name]}" for name in (primary, *secondaries)],
            self._reading,
            sender=order.sender,
            keep_going=True,
        )
        self._serials = {
            name: self._reading[name].serial or getattr(source, "serial", "")
            for name, source in self._units.sources.items()
        }
        calibration = answers.file("calibration")
        store = order.folder.parent / STORE
        refuse_linked_folder(store)
        self._monitor = RedundancyMonitor(
            primary,
            secondaries,
            settings=_settings(answers),
            calibration=None if calibration is None else Calibration.load(calibration),
            store=store if answers.flag("stored") else None,
            serials=self._serials,
            as_published=self._as_published,
        )
        prepare_folder(order.folder)
        check_output(order.folder / EVENTS, EVENTS_KIND)
        check_output(order.folder / REDUNDANCY_PAGE, PAGE)
        self._session = next_session_folder(order.folder)
        self._live: LiveRedundancy | None = None
        self._commands: deque[Command] = deque()
        self._stops = False

    def views(self) -> Iterator[RunView]:
        """See `GuidedRun`."""
        board = SetBoard(self._monitor.units, NEWEST)
        with ExitStack() as opened:
            writer = opened.enter_context(self._writer())
            live = self._live = LiveRedundancy(self._units, self._monitor, session=writer)
            writer.describe(self._procedure())
            yield view_of(board, "listening", self._monitor.start)
            for step in live.steps(self._seconds):
                board.take(step)
                if is_shown_at_once(step):
                    yield view_of(board, step, self._monitor.start)
                while self._commands:
                    self._monitor.command(self._commands.popleft())
                if self._stops:
                    live.stop()
        yield view_of(board, "ended early" if self._stops else "done", self._monitor.start)

    def stop(self) -> None:
        """See `GuidedRun`."""
        self._stops = True

    def act(self, action: str, subject: str = "") -> None:
        """See `GuidedRun`."""
        self._commands.extend(command for command in COMMANDS if command == action)

    def outcome(self) -> RunOutcome:
        """See `GuidedRun`."""
        if self._live is None:
            raise ProcedureError("nothing was watched yet; begin again")
        result = self._live.result("as published" if self._as_published else "")
        lost = [str(loss) for loss in self._units.losses if loss.is_heavy]
        files: dict[str, Path] = result.save(self._order.folder)
        return outcome_of(result, files, lost)

    def _writer(self) -> SessionWriter:
        described = {
            name: RecordedUnit(source, self._order.sources[name], self._serials[name])
            for name, source in self._units.sources.items()
        }
        clock: SessionClock = "log" if self._units.is_replay else "host"
        return SessionWriter(self._session, described, clock, clock_rate=self._units.clock_rate)

    def _procedure(self) -> SessionProcedure:
        return SessionProcedure(
            name="redundancy",
            operator=self._order.operator,
            station=self._order.station,
            options={"primary": self._monitor.units[0]},
        )


def _primary_of(order: RunOrder) -> str:
    """Returns the name of the primary; raises `ProcedureError` where there is not exactly one."""
    named: Sequence[str] = order.named(PRIMARY)
    if len(named) != 1:
        found = ", ".join(named) or "none"
        raise ProcedureError(f"a set needs one primary, found {found}; choose one unit")
    return named[0]


def _settings(answers: Answers) -> RedundancySettings:
    path, changes = answers.file("settings"), answers.text("changes")
    settings = RedundancySettings() if path is None else RedundancySettings.load(path)
    return settings.changed([each.strip() for each in changes.split(";") if each.strip()])


RUN_KIND: Final = RunKind(
    word="redundancy",
    title=message("Set"),
    summary=message(
        "Watches a redundant set: which unit is the source, what is wrong with the others, and why."
    ),
    roles=(
        UnitRole(name=PRIMARY, label=message("Primary")),
        UnitRole(name=SECONDARY, label=message("Secondary"), most=MOST_SECONDARIES),
    ),
    fields=FIELDS,
    has_screen=True,
    resumes=False,
    begin=GuidedRedundancy,
)
