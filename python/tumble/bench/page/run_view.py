"""A run that goes on: one instruction, the body in 3D, what is ticked, lamps, and sigma against the goal."""

from __future__ import annotations

import math
from functools import partial

from tumble.bench.page.context import PageContext
from tumble.bench.parts.body import Body
from tumble.bench.parts.checks import Checks
from tumble.bench.parts.elements import Label, block, button, set_class
from tumble.bench.parts.figures import FigureParts
from tumble.bench.parts.goals import GoalBars
from tumble.bench.parts.units import UnitLamps
from tumble.foundation.message import message
from tumble.tools.guided.view import RunAction, RunView

STATES = {
    "running": message("Wait for the first samples."),
    "paused": message("Paused."),
    "calibrating": message("Calibrating."),
    "error": message("The run ended with an error."),
}
"""Instruction where no view gives one."""
SHOWN_WARNINGS = 4


class RunPanel:
    """See the module; it draws the newest view and misses no warning."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._seen: tuple[object, ...] = ()
        self._actions: tuple[RunAction, ...] | None = None
        with block("run"):
            with block("now"):
                self._instruction = Label("", "instruction", "h1")
                self._detail = Label("", "detail")
                self._left = Label("", "left")
            with block("run-middle") as self._middle:
                with block("stand") as self._stand:
                    self._body = Body().classes("body")
                    self._off = Label("", "off")
                with block("run-side"):
                    self._checks = Checks(page)
                    self._figures = FigureParts(page)
            with block("run-foot"):
                self._lamps = UnitLamps(page)
                self._goals = GoalBars(page)
            self._warnings = block("warnings", role="log", aria_label=page.words("Warnings"))
            self._buttons = block("run-buttons")
        # A picture is of no use to those who listen; the words beside it are.
        self._body._props["role"] = "img"
        self._body._props["aria-label"] = page.words(
            "Reference in 3D: as it stands, and in outline as it should"
        )

    def update(self) -> None:
        """Draws the newest view where there is a newer one."""
        engine = self._page.bench.engine
        bench = self._page.bench
        seen = (engine.state, bench.paused_motion, self._page.operates, engine.views, len(engine.notes))
        if seen == self._seen:
            return
        state_is_new = self._seen[:3] != seen[:3]
        self._seen = seen
        if state_is_new:
            # A key that was pressed in the state before it means nothing in this one.
            self._page.primary = self._go
        if engine.view is not None:
            self._draw(engine.view)
        self._instruct(engine.view)
        if state_is_new or self._actions is None or (engine.view and engine.view.actions != self._actions):
            self._fill_buttons(engine.view)
        self._list_warnings()

    def _instruct(self, view: RunView | None) -> None:
        page, engine = self._page, self._page.bench.engine
        if view is not None and engine.state == "running":
            self._instruction.show(page.text(view.instruction))
            self._detail.show(page.text(view.detail))
            left = view.remaining
            self._left.show("" if math.isnan(left) else f"{math.ceil(left)} s")
        else:
            self._instruction.show(page.text(STATES.get(engine.state, message(""))))
            self._detail.show(page.text(engine.trouble))
            self._left.show("")

    def _draw(self, view: RunView) -> None:
        page = self._page
        body = view.bodies[0] if view.bodies else None
        set_class(self._stand, "hidden", body is None)
        set_class(self._middle, "without-body", body is None)
        if body is not None:
            self._body.show(body)
            far = "" if math.isnan(body.off) else page.words("{angle}° off", angle=f"{body.off:.0f}")
            self._off.show(far)
        self._checks.show(view.checks)
        self._figures.show(view.figures)
        self._lamps.show(view.lamps)
        self._goals.show(view.goals)

    def _list_warnings(self) -> None:
        page = self._page
        told = [note for note in page.bench.engine.notes if note.kind in ("warning", "ended early")]
        self._warnings.clear()
        with self._warnings:
            for note in told[-SHOWN_WARNINGS:]:
                with block("warning"):
                    Label("▲", "warning-sign")._props["aria-hidden"] = "true"
                    Label(page.text(note.text))

    def _fill_buttons(self, view: RunView | None) -> None:
        page, engine = self._page, self._page.bench.engine
        self._actions = view.actions if view is not None else ()
        self._buttons.clear()
        with self._buttons:
            if engine.state == "running":
                button(page.words("Pause"), page.guarded(engine.pause), "large")
                button(page.words("Finish now"), page.guarded(engine.finish), "quiet large")
                for action in self._actions:
                    self._offer(action)
            elif engine.state in ("paused", "error"):
                motion = page.bench.paused_motion
                if motion is not None:
                    again = page.guarded(partial(page.bench.resume, armed=motion))
                    button(page.words("Arm the table and go on"), again, "arm-button large")
                    Label(page.words("Table: {address}", address=motion.table.address), "help")
                else:
                    button(page.words("Go on"), page.guarded(page.bench.resume), "primary large")
                if engine.state == "paused":
                    button(page.words("Calibrate what there is"), page.guarded(engine.finish), "large")
                button(page.words("Leave the run"), page.guarded(engine.leave), "quiet large")

    def _offer(self, action: RunAction) -> None:
        page, engine = self._page, self._page.bench.engine
        label = page.text(action.label)
        if not action.subjects:
            button(label, page.guarded(partial(engine.act, action.name)), "large")
            return
        with block("redo", "details"):
            Label(label, tag="summary")
            with block("redo-list"):
                for subject in action.subjects:
                    button(subject, page.guarded(partial(engine.act, action.name, subject)), "small")

    def _go(self) -> None:
        """Pauses a run that goes on, and goes on with one that is paused; no key arms a table."""
        bench = self._page.bench
        if bench.engine.state == "running":
            bench.engine.pause()
        elif bench.engine.state in ("paused", "error") and bench.paused_motion is None:
            bench.resume()
