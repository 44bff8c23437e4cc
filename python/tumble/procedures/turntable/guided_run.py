"""A turntable session as a guided run: poses by hand or by a table, then the calibration of all targets."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from typing import Any

from tumble.foundation.errors import ProcedureError
from tumble.foundation.file_names import SESSION_FOLDER
from tumble.foundation.goal import Goal
from tumble.foundation.message import message
from tumble.foundation.words import join
from tumble.live import LiveSet, open_set
from tumble.live.naming import parse_named_sources
from tumble.logs.session import SessionProcedure
from tumble.poses.pose_list import SIX_FACES, PoseList
from tumble.procedures.turntable.batch_session import calibrate_session
from tumble.procedures.turntable.guided_outcome import outcome_of
from tumble.procedures.turntable.guided_view import view_of
from tumble.procedures.turntable.live import POSE_SECONDS, REFERENCE, LiveTurntable, TurntableStep
from tumble.procedures.turntable.procedure import open_session
from tumble.procedures.turntable.session_poses import poses_of
from tumble.procedures.turntable.table_drive import TableDrive
from tumble.procedures.turntable.table_plan import TurnedTable, turned_table
from tumble.tools.guided.answers import Answers
from tumble.tools.guided.field import RunField, UnitRole
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.outcome import RunOutcome
from tumble.tools.guided.run import RunKind
from tumble.tools.guided.view import RunView

TARGET = "target"
FIELDS = (
    RunField(
        name="until",
        label=message("Goal"),
        kind="text",
        help=message("Largest sigmas, such as: bias 0.001, scale 0.02 %."),
    ),
    RunField(
        name="pose_seconds",
        label=message("Time at each pose"),
        kind="number",
        default=POSE_SECONDS,
        unit="s",
        least=2.0,
        most=1800.0,
    ),
    RunField(
        name="turns",
        label=message("Turns for the gyroscopes"),
        kind="flag",
        default=True,
        help=message("A turn about each axis, both ways, shows the scale of the gyroscopes."),
    ),
    RunField(name="limits", label=message("Limits"), kind="file"),
    RunField(name="poses", label=message("Pose list"), kind="file", advanced=True),
    RunField(
        name="reference_calibration",
        label=message("Calibration of the reference"),
        kind="file",
        advanced=True,
    ),
    RunField(
        name="gravity",
        label=message("Local gravity"),
        kind="number",
        unit="m/s^2",
        least=9.7,
        most=9.9,
        advanced=True,
    ),
)


class GuidedTurntable:
    """One session on a table; see `GuidedRun`."""

    def __init__(self, order: RunOrder) -> None:
        self._order = order
        self._answers = Answers(FIELDS, order.options)
        self._reference = _reference_of(order)
        goal = self._answers.text("until")
        self._goal = Goal.parse(goal) if goal else None
        self._typed = {
            name: address.text
            for name, address in parse_named_sources(
                [f"{name}={address}" for name, address in order.sources.items()]
            ).items()
        }
        self._table = self._planned()
        self._live: LiveTurntable | None = None
        self._drive: TableDrive | None = None
        self._wanted: deque[str] = deque()
        """Poses that are to be done again."""
        self._stops = False

    def views(self) -> Iterator[RunView]:
        """See `GuidedRun`."""
        with ExitStack() as stack:
            if self._table is not None:
                self._drive = drive = stack.enter_context(self._table.entered())
                if self._stops:
                    drive.halt()
            self._live = live = self._begun()
            for step in live.steps():
                yield self._view(live, step)
                if self._stops:
                    live.stop()
                while self._wanted:
                    live.redo(self._wanted.popleft())
        self._drive = None

    def stop(self) -> None:
        """See `GuidedRun`."""
        self._stops = True
        if (drive := self._drive) is not None:
            drive.halt()

    def act(self, action: str, subject: str = "") -> None:
        """See `GuidedRun`."""
        if action == "redo" and (self._live is None or self._live.is_for_hand):
            self._wanted.append(subject)

    def outcome(self) -> RunOutcome:
        """See `GuidedRun`."""
        live = self._live
        not_shown = live.not_shown if live is not None else ()
        run, files = calibrate_session(
            self._order.folder / SESSION_FOLDER,
            self._reference,
            self._order.folder,
            open_reference=partial(
                open_session,
                **self._stated(),
                limits=self._answers.file("limits"),
                operator=self._order.operator,
                station=self._order.station,
            ),
            not_shown=not_shown,
        )
        return outcome_of(run, files, complete=live is not None and live.is_complete and live.goal_is_met)

    def _view(self, live: LiveTurntable, step: TurntableStep) -> RunView:
        drive = None if live.is_for_hand else self._drive
        aimed = drive.aimed_up if drive is not None else None
        return view_of(live, step, self._reference, by_table=drive is not None, aimed=aimed)

    def _begun(self) -> LiveTurntable:
        order, table = self._order, self._table
        options = order.read_options()
        return LiveTurntable(
            self._units(),
            order.folder,
            sources=self._typed,
            serials={name: each.serial for name, each in options.items()},
            reference=self._reference,
            poses=table.poses if table is not None else self._poses() or SIX_FACES,
            pose_seconds=self._seconds,
            turns=self._answers.flag("turns") and (table is None or bool(table.by_hand)),
            goal=self._goal,
            open_reference=partial(open_session, **self._stated(), poses=None),
            driver=self._drive,
            procedure=self._procedure(),
            resume=order.resume,
        )

    def _units(self) -> LiveSet:
        words = [f"{name}={address}" for name, address in self._order.sources.items()]
        return open_set(words, self._order.read_options(), sender=self._order.sender, keep_going=True)

    def _procedure(self) -> SessionProcedure:
        order = self._order
        stated = {"goal": self._answers.text("until"), "table": order.table.address if order.table else ""}
        return SessionProcedure(
            name="turntable",
            operator=order.operator,
            station=order.station,
            options={
                "pose-seconds": self._seconds,
                **{name: value for name, value in stated.items() if value},
                **({"resumed": True} if order.resume else {}),
            },
        )

    def _planned(self) -> TurnedTable | None:
        table = self._order.table
        if table is None:
            return None
        if not table.armed:
            raise ProcedureError("the table is not armed; arm it, or turn it by hand")
        turns = self._answers.flag("turns")
        return turned_table(table.address, table.limits, self._seconds, self._poses(), turns, table.documents)

    def _poses(self) -> PoseList | None:
        if path := self._answers.file("poses"):
            return PoseList.load(path)
        # The way of a table is planned anew, and is the same; its turns end where no pose of a list is.
        is_by_hand = self._order.table is None
        return poses_of(self._order.folder / SESSION_FOLDER) if self._order.resume and is_by_hand else None

    @property
    def _seconds(self) -> float:
        return self._answers.number("pose_seconds") or POSE_SECONDS

    def _stated(self) -> Mapping[str, Any]:
        return {
            "gravity": self._answers.number("gravity"),
            "reference_calibration": self._answers.file("reference_calibration"),
        }


def _reference_of(order: RunOrder) -> str:
    """Returns the name of the reference; raises `ProcedureError` where there is not exactly one."""
    named = order.named(REFERENCE)
    if len(named) != 1:
        found = join(named) if named else "none"
        raise ProcedureError(f"a turntable session needs one reference, found {found}; choose one unit")
    if not order.named(TARGET):
        raise ProcedureError("no target was chosen; choose at least one unit besides the reference")
    return named[0]


def guided_run(order: RunOrder) -> GuidedTurntable:
    """Makes the run; raises `TumbleError` where the order cannot be carried out."""
    return GuidedTurntable(order)


RUN_KIND = RunKind(
    word="turntable",
    title=message("Turntable"),
    summary=message("Calibrate targets against a reference beside them, face by face or on a rate table."),
    roles=(
        UnitRole(name=REFERENCE, label=message("Reference")),
        UnitRole(name=TARGET, label=message("Target"), most=None),
    ),
    fields=FIELDS,
    takes_table=True,
    begin=guided_run,
)
"""Sessions on a turntable."""
