"""Screen of the units: the registry, searched and filtered, with history and certificates."""

from __future__ import annotations

from functools import partial

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


class UnitsScreen:
    """See the module."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._search, self._state = "", ""
        self._registry: RegistryView | None = None
        page.scan = self._find
        with block("screen-head"):
            Label(page.words("Units"), "title", "h1")
            self._lead = Label("", "lead")
        try:
            self._registry = page.bench.registry()
        except TumbleError as error:
            self._lead.show(page.text(message(str(error))))
            return
        if self._registry is None:
            self._lead.show(page.words("No registry is set; start the bench with --registry FILE."))
            return
        with block("form-row"):
            self._field = text_field(
                page.words("Search"),
                "",
                self._find,
                help_text=page.words("Serial, name, model or lot; or scan"),
            )
            states = [(key, page.text(text)) for key, text in STATES.items()]
            choice_field(page.words("State"), states, "", self._filter)
        self._comparison = Comparison(page, self._registry)
        self._list = block("unit-list")
        self._detail = block("unit-detail")
        self._fill()

    def update(self) -> None:
        """Nothing changes by itself."""

    def _find(self, text: str) -> None:
        self._search = text.strip()
        self._field.show(self._search)
        self._fill()

    def _filter(self, state: str) -> None:
        self._state = state
        self._fill()

    def _fill(self) -> None:
        page = self._page
        assert self._registry is not None, "the list is there only with a registry"
        found = self._registry.units(self._search, self._state)
        self._lead.show(page.words("Found: {count}", count=len(found)))
        self._list.clear()
        self._detail.clear()
        with self._list:
            for unit in found[:MOST_SHOWN]:
                self._row(unit)
        if len(found) == 1:
            self._open(found[0])

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

    def _open(self, unit: RegisteredUnit) -> None:
        page = self._page
        assert self._registry is not None, "a unit is of a registry"
        self._detail.clear()
        with self._detail, block("panel"):
            Label(unit.serial or unit.name, "section", "h2")
            try:
                results = self._registry.results(unit)
                certificates = self._registry.certificates(unit)
            except TumbleError as error:
                Label(page.text(message(str(error))), "trouble")
                return
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

    def _issue(self, unit: RegisteredUnit, result: str) -> None:
        assert self._registry is not None, "a result is of a registry"
        number = self._registry.issue(result, self._page.bench.choice.operator)
        self._page.notify(self._page.words("Certificate {number} is issued.", number=number), "good")
        self._open(unit)

    def _withdraw(self, unit: RegisteredUnit, number: str, why: str) -> None:
        assert self._registry is not None, "a certificate is of a registry"
        self._registry.withdraw(number, why, self._page.bench.choice.operator)
        self._open(unit)


def show_units(page: PageContext) -> UnitsScreen:
    """Builds the screen."""
    return UnitsScreen(page)
