"""Screen of a result: one verdict as large as the screen, why, and what comes next."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

from nicegui.element import Element

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, button, file_link, set_attribute, set_class
from tumble.bench.run_folder import ACCEPTED
from tumble.foundation.errors import TumbleError
from tumble.foundation.message import Message, message
from tumble.report.numbers import typeset
from tumble.tools.guided.outcome import FurthestParameter, RunOutcome, RunVerdict, UnitOutcome

WORDS: dict[RunVerdict, Message] = {
    "passed": message("Passed"),
    "warned": message("Look at it"),
    "failed": message("Failed"),
    "not observable": message("No result"),
}
SIGNS: dict[RunVerdict, str] = {"passed": "✓", "warned": "▲", "failed": "✕", "not observable": "?"}
MOST_REMARKS = 2
"""Remarks on the session that are shown."""
CLASSES: dict[RunVerdict, str] = {
    "passed": "good",
    "warned": "warn",
    "failed": "bad",
    "not observable": "bad",
}


class ResultScreen:
    """See the module."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._content = block("result-screen")
        self._seen: tuple[object, ...] = ()
        self._chosen = ""
        self._is_accepting = False

    def update(self) -> None:
        """Shows the outcome of the last run."""
        engine = self._page.bench.engine
        seen = (engine.outcome, engine.decision)
        if seen == self._seen:
            return
        self._seen = seen
        self._content.clear()
        with self._content:
            if engine.outcome is None:
                self._none()
            else:
                self._outcome(engine.outcome)

    def _none(self) -> None:
        page = self._page
        page.primary = lambda: page.go("/")
        with block("screen-head"):
            Label(page.words("No result yet"), "title", "h1")
            Label(page.words("Results of earlier runs are on the screen Sources."), "lead")

    def _outcome(self, outcome: RunOutcome) -> None:
        page = self._page
        fine = outcome.verdict in ("passed", "warned")
        worst = next((unit for unit in outcome.units if unit.verdict == outcome.verdict), None)
        page.primary = self._accept_and_go_on if fine else self._repeat
        with block(f"verdict {CLASSES[outcome.verdict]}", role="status"):
            Label(SIGNS[outcome.verdict], "verdict-sign")._props["aria-hidden"] = "true"
            with block("verdict-words"):
                Label(page.text(WORDS[outcome.verdict]), "verdict-word", "h1")
                Label(self._count(outcome), "verdict-count")
                if worst is not None and not fine and len(outcome.units) > 1:
                    words = page.words("{name}: {word}", name=worst.name, word=worst.word)
                    Label(words, "verdict-count")
        if not outcome.complete:
            Label(page.words("The session ended before all was shown."), "trouble")
        self._next(fine)
        with block("unit-tiles", role="group", aria_label=page.words("Units")):
            self._tiles = {unit.name: self._tile(unit) for unit in outcome.units}
        self._why = block("panel why")
        if worst is not None:
            self._choose(worst)
        # Remarks on the session concern no unit alone, so that they come after the reasons of a verdict.
        for reason in outcome.reasons[:MOST_REMARKS]:
            Label(typeset(page.text(reason)), "lead")
        self._files(outcome)

    def _count(self, outcome: RunOutcome) -> str:
        page, units = self._page, outcome.units
        if len(units) == 1:
            return " ".join(filter(None, (units[0].name, units[0].serial)))
        well = sum(unit.verdict in ("passed", "warned") for unit in units)
        return page.words("{count} of {all} units may be used", count=well, all=len(units))

    def _next(self, fine: bool) -> None:
        page, engine = self._page, self._page.bench.engine
        with block("next"):
            accept = self._accept_and_go_on
            if engine.decision == ACCEPTED:
                Label(page.words("✓ accepted"), "accepted")
                button(page.words("Next unit"), page.guarded(self._go_on), "primary large")
            else:
                button(
                    page.words("Accept, next unit"),
                    page.guarded(accept),
                    "large primary" if fine else "large",
                )
                button(page.words("Accept"), page.guarded(self._accept), "large quiet")
            button(page.words("Repeat"), page.guarded(self._repeat), "large" if fine else "large primary")
            Label(page.words("Space, Enter or the pedal do what is filled."), "help")

    def _tile(self, unit: UnitOutcome) -> Element:
        page = self._page
        element = button("", partial(self._choose, unit), f"unit-tile {CLASSES[unit.verdict]}")
        element.clear()
        with element:
            Label(SIGNS[unit.verdict], "tile-sign", "span")._props["aria-hidden"] = "true"
            with block("", "span"):
                Label(unit.name, "unit-name", "span")
                Label(unit.serial, "unit-serial", "span")
            Label(page.text(WORDS[unit.verdict]), "tile-word", "span")
        return element

    def _choose(self, unit: UnitOutcome) -> None:
        page = self._page
        for name, tile in self._tiles.items():
            set_attribute(tile, "aria-pressed", "true" if name == unit.name else "false")
        self._why.clear()
        with self._why:
            Label(page.words("{name}: {word}", name=unit.name, word=unit.word), "section", "h2")
            for reason in unit.reasons[:6]:
                Label(typeset(page.text(reason)), "reason")
            if unit.furthest:
                self._furthest(unit.furthest)
            with block("file-links"):
                for label, path in (
                    (page.words("Page"), unit.page),
                    (page.words("Calibration"), unit.calibration),
                ):
                    if path is not None:
                        file_link(label, self._address(path), "file-link")

    def _furthest(self, parameters: tuple[FurthestParameter, ...]) -> None:
        page = self._page
        Label(page.words("Furthest out"), "subsection", "h3")
        with block("figures-table", "table"):
            with block("", "thead"), block("", "tr"):
                for head in ("Parameter", "Value", "1-sigma", "Limit"):
                    Label(page.words(head), tag="th")._props["scope"] = "col"
            with block("", "tbody"):
                for each in parameters:
                    row = block("", "tr")
                    set_class(row, "out", not each.within)
                    with row:
                        Label(f"{'' if each.within else '✕ '}{each.name}", tag="th")._props["scope"] = "row"
                        Label(_figure(each.value, each.unit), tag="td")
                        Label(_figure(each.sigma, ""), tag="td")
                        Label("" if each.limit is None else f"{each.limit:g}", tag="td")

    def _files(self, outcome: RunOutcome) -> None:
        page = self._page
        with block("file-links"):
            for name, path in outcome.files.items():
                file_link(page.words(name.capitalize()), self._address(path), "file-link")

    def _address(self, path: Path) -> str:
        folder = self._page.bench.engine.folder
        return f"/runs/{folder.path.name if folder else ''}/{path.name}"

    async def _accept(self) -> None:
        """Accepts the outcome beside the page, as the registry may be that of a server."""
        page = self._page
        if self._is_accepting:
            raise TumbleError("the result is being accepted; wait until it is")
        self._is_accepting = True
        try:
            await page.bench.beside.done(page.bench.accept)
        finally:
            self._is_accepting = False

    async def _accept_and_go_on(self) -> None:
        if self._page.bench.engine.decision != ACCEPTED:
            await self._accept()
        self._go_on()

    def _go_on(self) -> None:
        self._page.bench.next_unit()
        self._page.go("/run")

    def _repeat(self) -> None:
        self._page.bench.repeat()
        self._page.go("/run")


def _figure(value: float, unit: str) -> str:
    return "-" if math.isnan(value) else f"{value:.4g} {unit if unit != '1' else ''}".strip()


def show_result(page: PageContext) -> ResultScreen:
    """Builds the screen."""
    return ResultScreen(page)
