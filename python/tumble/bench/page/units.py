"""Screen of the units: the registry, searched and filtered, with history and certificates."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from nicegui import ui

from tumble.bench.page.comparison import Comparison
from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, button, file_link
from tumble.bench.parts.fields import choice_field, text_field
from tumble.bench.registry_view import ComparedResult, DueState, RegisteredUnit, RegistryView
from tumble.foundation.errors import TumbleError
from tumble.foundation.message import Message, message

STATES: dict[str, Message] = {
    "": message("all"),
    "in use": message("in use"),
    "due soon": message("due soon"),
    "due": message("due"),
    "unknown": message("no due date"),
}
_SIGNS: dict[DueState, str] = {"in use": "✓", "due soon": "▲", "due": "✕", "unknown": "○"}
MOST_SHOWN = 100
Found = TypeVar("Found")


class UnitsScreen:
    """See the module; the registry is asked beside the page, as its server may be slow, or silent."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._search, self._state = "", ""
        self._registry: RegistryView | None = None
        self._turn = asyncio.Lock()
        self._asked = 0
        """Number of questions so far: only the newest one is answered."""
        with block("screen-head"):
            Label(page.words("Units"), "title", "h1")
            self._lead = Label("", "lead")
        if not page.bench.settings.registry:
            self._lead.show(page.words("No registry is set; start the bench with --registry FILE."))
            return
        page.scan = self._find
        with block("form-row"):
            self._field = text_field(
                page.words("Search"),
                "",
                self._find,
                help_text=page.words("Serial, name, model or lot; or scan"),
            )
            states = [(key, page.text(text)) for key, text in STATES.items()]
            choice_field(page.words("State"), states, "", self._filter)
        self._comparison = Comparison(page, self._read)
        self._list = block("unit-list")
        self._detail = block("unit-detail")
        self._lead.show(page.words("Reading the registry …"))
        ui.timer(0.0, self._fill, once=True)

    def update(self) -> None:
        """Nothing changes by itself."""

    async def _find(self, text: str) -> None:
        self._search = text.strip()
        self._field.show(self._search)
        await self._fill()

    async def _filter(self, state: str) -> None:
        self._state = state
        await self._fill()

    async def _read(self, ask: Callable[[RegistryView], Found]) -> Found:
        """Returns the answer of the registry, which is opened once; raises `TumbleError`."""

        def answer() -> Found:
            if self._registry is None:
                self._registry = self._page.bench.registry()
            assert self._registry is not None, "a registry is set"
            return ask(self._registry)

        async with self._turn:
            return await self._page.bench.beside.done(answer)

    async def _newest(self, ask: Callable[[RegistryView], Found]) -> Found | None:
        """Returns an answer; None where something else was asked since, or the screen is gone.

        Raises `TumbleError`.
        """
        self._asked += 1
        asked = self._asked
        found = await self._read(lambda registry: ask(registry) if asked == self._asked else None)
        return found if asked == self._asked and not self._lead.is_deleted else None

    async def _fill(self) -> None:
        page, search, state = self._page, self._search, self._state
        self._lead.show(page.words("Reading the registry …"))
        try:
            found = await self._newest(lambda registry: registry.units(search, state))
        except TumbleError as error:
            self._lead.show(page.text(message(str(error))))
            return
        if found is None:
            return
        self._lead.show(page.words("Found: {count}", count=len(found)))
        self._list.clear()
        self._detail.clear()
        with self._list:
            for unit in found[:MOST_SHOWN]:
                self._row(unit)
        if len(found) == 1:
            await self._open(found[0])

    def _row(self, unit: RegisteredUnit) -> None:
        page = self._page
        element = button("", partial(self._open, unit), "unit-row")
        element.clear()
        with element:
            Label(_SIGNS[unit.state], f"lamp {unit.state.replace(' ', '-')}", "span")._props[
                "aria-hidden"
            ] = "true"
            Label(unit.serial or unit.name, "unit-name", "span")
            Label(" ".join(filter(None, (unit.model, unit.lot))), "unit-model", "span")
            due = page.words("due {date}", date=unit.due) if unit.due else page.text(STATES["unknown"])
            Label(due, "unit-due", "span")

    async def _open(self, unit: RegisteredUnit) -> None:
        page = self._page
        self._detail.clear()
        with self._detail, block("panel") as panel:
            Label(unit.serial or unit.name, "section", "h2")
            reading = Label(page.words("Reading the registry …"), "help")
        try:
            found = await self._newest(lambda registry: (registry.results(unit), registry.certificates(unit)))
        except TumbleError as error:
            if not reading.is_deleted:
                reading.classes("trouble").show(page.text(message(str(error))))
            return
        if found is None or reading.is_deleted:
            return
        results, certificates = found
        reading.delete()
        with panel:
            with block("file-links"):
                file_link(page.words("History"), f"/history/{unit.unit}", "file-link")
            Label(page.words("Results"), "subsection", "h3")
            for result in results:
                with block("unit-line"):
                    Label(str(result["date"])[:10])
                    Label(str(result["procedure"]))
                    Label(str(result["verdict"]))
                    identity = str(result["calibration"])
                    act = page.guarded(partial(self._issue, unit, identity))
                    button(page.words("Issue certificate"), act, "small quiet")
                    chosen = ComparedResult(identity, unit.serial or unit.name, str(result["date"])[:10])
                    compare = button(
                        page.words("Compare"), partial(self._comparison.choose, chosen), "small quiet"
                    )
                    compare._props["aria-label"] = page.words("Compare {label}", label=chosen.label)
            Label(page.words("Certificates"), "subsection", "h3")
            if not certificates:
                Label(page.words("none"), "help")
            for each in certificates:
                self._certificate(unit, str(each["number"]), str(each["state"]))

    def _certificate(self, unit: RegisteredUnit, number: str, state: str) -> None:
        page = self._page
        with block("unit-line"):
            Label(number, "mono")
            Label(page.words(state))
            file_link(page.words("PDF"), f"/certificates/{number}.pdf", "file-link")
            if state == "issued":
                reason = {"why": ""}
                text_field(
                    page.words("Reason to withdraw {number}", number=number),
                    "",
                    partial(reason.__setitem__, "why"),
                    hidden_label=True,
                )
                button(
                    page.words("Withdraw"),
                    page.guarded(lambda: self._withdraw(unit, number, reason["why"])),
                    "small quiet",
                )

    async def _issue(self, unit: RegisteredUnit, result: str) -> None:
        who = self._page.bench.choice.operator
        number = await self._read(lambda registry: registry.issue(result, who))
        self._page.notify(self._page.words("Certificate {number} is issued.", number=number), "good")
        await self._open(unit)

    async def _withdraw(self, unit: RegisteredUnit, number: str, why: str) -> None:
        who = self._page.bench.choice.operator
        await self._read(lambda registry: registry.withdraw(number, why, who))
        await self._open(unit)


def show_units(page: PageContext) -> UnitsScreen:
    """Builds the screen."""
    return UnitsScreen(page)
