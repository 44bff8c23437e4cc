"""The engine: one run at a time, in a thread of its own; whoever looks sees the newest view."""

from __future__ import annotations

import logging
import math
import threading
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from tumble.bench.authority import Shared, as_bench
from tumble.bench.run_commands import CARRIED_OUT, CommandLog
from tumble.bench.run_folder import RunFolder
from tumble.foundation import clock
from tumble.foundation.errors import TumbleError
from tumble.foundation.message import Message, message
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.outcome import RunOutcome
from tumble.tools.guided.run import GuidedRun, run_kind
from tumble.tools.guided.view import RunView, ViewKind

EngineState: TypeAlias = Literal["idle", "running", "paused", "calibrating", "result", "error"]
CLOSED_WITHIN = 10.0
"""s that a recording may take to end: a run that waits for a line for ever ends with the program."""
MOST_NOTES = 200
"""Events of a run that are kept for whoever opens the page later."""
NOTED: tuple[ViewKind, ...] = ("held", "part done", "warning", "done", "ended early")
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class RunNote:
    """One event of a run that must not be missed, whoever looked."""

    number: int
    """From 1 on, over all runs of the engine: pages show those that came after the last they know."""
    kind: ViewKind
    elapsed: float
    """s."""
    text: Message


class Engine(Shared):
    """Runs, one after another; all methods may be called from any thread."""

    @as_bench
    def __init__(self, on_change: Callable[[], None] = lambda: None) -> None:
        self.state: EngineState = "idle"
        self.folder: RunFolder | None = None
        """The run under way, or the last one."""
        self.view: RunView | None = None
        """The newest view; None before the first of a run."""
        self.outcome: RunOutcome | None = None
        self.decision = ""
        """Operator's decision on the outcome: `accepted`, or empty."""
        self.trouble: Message = message("")
        """Reason of the state `error`, or of a pause that nobody asked for."""
        self.notes: deque[RunNote] = deque(maxlen=MOST_NOTES)
        self.views = 0
        """Number of views so far, by which a page sees whether there is a newer one."""
        self._run: GuidedRun | None = None
        self._thread: threading.Thread | None = None
        self._stopping: threading.Thread | None = None
        """Thread that stops the table of a run."""
        self._lock = threading.Lock()
        self._ends: Literal["pause", "finish"] = "pause"
        self._is_to_end = False
        self._number = 0
        self._asked: set[str] = set()
        """Subjects of actions that were not carried out yet."""
        self._on_change = on_change

    @property
    def is_busy(self) -> bool:
        """Returns whether a run records or calibrates."""
        return self.state in ("running", "calibrating")

    @property
    def moves_table(self) -> bool:
        """Returns whether a run is under way that may move a table, or will once it is planned."""
        table = self.folder.order.table if self.folder is not None else None
        return self.state == "running" and table is not None and table.armed

    @property
    def is_ending(self) -> bool:
        """Returns whether the run under way was stopped."""
        return self._is_to_end

    def begin(self, folder: RunFolder, order: RunOrder) -> None:
        """Begins or resumes a run; raises `TumbleError` where another is under way.

        An order that cannot be carried out leaves the engine idle, with its `trouble`: to plan the way of a
        table takes a while, and no page waits for it.
        """
        with self._lock:
            if self.is_busy:
                raise TumbleError("a run is under way; stop it first")
            self._asked.clear()
            if not order.resume:
                self.notes.clear()
            self.folder, self._run = replace(folder, order=order), None
            self.view, self.outcome, self.decision, self.trouble = None, None, "", message("")
            self._ends, self._is_to_end, self.state = "pause", False, "running"
            if order.resume:
                self._remember("go on")
            self._thread = clock.thread(self._work, self.folder, name="run")
            self._thread.start()
        self._on_change()

    def pause(self, why: Message | None = None) -> None:
        """Stops recording and the table; the run can go on."""
        self._end("pause", why)

    def finish(self) -> None:
        """Stops recording and the table, and calibrates what there is."""
        with self._lock:
            if self.state == "paused":
                self.state = "calibrating"
                self._thread = clock.thread(self._finish_paused, name="run")
                self._thread.start()
                self._remember("finish")
                return
        self._end("finish")

    def act(self, action: str, subject: str = "") -> None:
        """Does one of the actions of the newest view."""
        if self.state == "running" and self._run is not None:
            if subject:
                self._asked.add(subject)
            self._run.act(action, subject)
            self._remember(action, subject)

    def adopt(self, folder: RunFolder) -> None:
        """Takes a run as paused that was recorded before, by a server that is gone."""
        with self._lock:
            if self.is_busy:
                raise TumbleError("a run is under way; stop it first")
            self.folder, self._run, self.view, self.outcome = folder, None, None, None
            self.trouble, self.state = message("It was interrupted; what was recorded is whole."), "paused"
        self._on_change()

    def show(self, folder: RunFolder) -> None:
        """Shows the outcome of a run that was finished before."""
        found = folder.outcome()
        with self._lock:
            if self.is_busy or found is None:
                return
            self.folder, (self.outcome, self.decision) = folder, found
            self.view, self.state = None, "result"
        self._on_change()

    def decide(self, decision: str) -> None:
        """Stores the operator's decision on the outcome; raises `OutputError`."""
        if self.state == "result" and self.folder is not None and self.outcome is not None:
            self.folder.keep_outcome(self.outcome, decision)
            self.decision = decision
            self._remember(decision)
            self._on_change()

    def leave(self) -> None:
        """Leaves an outcome, an error or a paused run, whose files stay."""
        if self.state in ("paused", "error"):
            self._remember("leave")
        with self._lock:
            if not self.is_busy:
                self.state, self.view, self.outcome = "idle", None, None
        self._on_change()

    @as_bench
    def close(self) -> None:
        """Pauses what runs, and waits until its recording is whole, but not for a line that blocks it."""
        self.pause()
        if self._stopping is not None:
            clock.wait(self._stopping, CLOSED_WITHIN)
        if self._thread is not None and not clock.wait(self._thread, CLOSED_WITHIN):
            if self.state == "running":
                _log.error("a run did not end within %g s; what it had recorded stays", CLOSED_WITHIN)
                return
            clock.wait(self._thread)

    def _end(self, how: Literal["pause", "finish"], why: Message | None = None) -> None:
        with self._lock:
            if self.state != "running":
                return
            self._ends, self._is_to_end = how, True
            self.trouble = why or self.trouble
            if self._run is not None:
                # Neither a page nor the watchdog waits for a table to answer.
                self._stopping = clock.thread(self._stop, self._run, name="stop")
                self._stopping.start()
        self._remember(how, str(why or ""))

    @as_bench
    def _stop(self, run: GuidedRun) -> None:
        """Stops a run, and its table, by a thread of its own: the one of the run may wait for a line."""
        try:
            run.stop()
        except TumbleError as error:
            self.trouble = message(str(error))
            self._on_change()

    def _remember(self, command: str, subject: str = "") -> None:
        """Stores a command with the recording; one that cannot be stored is carried out all the same."""
        folder, view = self.folder, self.view
        if folder is None:
            return
        try:
            CommandLog(folder.path).add(command, subject, math.nan if view is None else view.elapsed)
        except TumbleError as error:
            self.trouble = message(str(error))

    def _prepared(self, folder: RunFolder) -> GuidedRun | None:
        """Makes the run of an order; None where it cannot be carried out."""
        try:
            folder.refuse_links()
        except TumbleError as error:
            self._set("paused", message(str(error)))
            return None
        try:
            run = run_kind(folder.word).begin(replace(folder.order, folder=folder.path))
        except TumbleError as error:
            folder.remove_if_empty()
            self._set("idle" if not folder.has_recording else "paused", message(str(error)))
            return None
        with self._lock:
            self._run = run
            if self._is_to_end:
                run.stop()
        return run

    @as_bench
    def _finish_paused(self) -> None:
        """Calibrates what a paused run has recorded; no table is needed for that."""
        run, folder = self._run, self.folder
        assert folder is not None, "a paused run has a folder"
        if run is None:
            run = self._prepared(replace(folder, order=replace(folder.order, table=None, resume=True)))
        if run is not None:
            self._calibrate(run)

    @as_bench
    def _work(self, folder: RunFolder) -> None:
        run, is_done = self._prepared(folder), False
        if run is None:
            return
        try:
            for view in self._views(run):
                if self.view is None:
                    self._act_again(folder, run, view)
                self.view = view
                self.views += 1
                self._note(view)
                is_done = view.kind == "done"
        except TumbleError as error:
            self._fail(error)
            return
        except Exception as error:
            _log.exception("a run failed")
            self._fail(error)
            return
        if is_done or self._ends == "finish":
            self._calibrate(run)
        else:
            ended = self.view is not None and self.view.kind == "ended early"
            self._set("paused", self.view.warning if ended and self.view is not None else None)

    def _views(self, run: GuidedRun) -> Iterator[RunView]:
        """Returns the views of a run; none where it was to end before: then no table moves."""
        return iter(()) if self._is_to_end else run.views()

    def _act_again(self, folder: RunFolder, run: GuidedRun, view: RunView) -> None:
        """Does what was asked for before the server ended, and was not carried out."""
        if not folder.order.resume:
            return
        for each in CommandLog(folder.path).left(frozenset(action.name for action in view.actions)):
            self._asked.add(each.subject)
            run.act(each.command, each.subject)

    def _calibrate(self, run: GuidedRun) -> None:
        self._set("calibrating")
        folder = self.folder
        assert folder is not None, "a run has a folder"
        try:
            outcome = run.outcome()
            folder.keep_outcome(outcome)
        except Exception as error:
            if not isinstance(error, TumbleError):
                _log.exception("a calibration failed")
            self._fail(error)
            return
        self.outcome = outcome
        self._set("result")

    def _fail(self, error: Exception) -> None:
        """Shows an error in one line; what was recorded stays, and the run may go on."""
        text = (
            message(str(error))
            if isinstance(error, TumbleError)
            else message(f"{type(error).__name__}: {error}")
        )
        self._set("error", text)

    def _set(self, state: EngineState, trouble: Message | None = None) -> None:
        self.state = state
        self.trouble = trouble or self.trouble
        self._on_change()

    def _note(self, view: RunView) -> None:
        if view.kind in NOTED:
            self._number += 1
            text = view.warning or message(view.subject)
            self.notes.append(RunNote(self._number, view.kind, view.elapsed, text))
        if view.kind == "held" and view.subject in self._asked:
            self._asked.discard(view.subject)
            self._remember(CARRIED_OUT, view.subject)
