"""Form before a run: its questions, the units that take part, and the table."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeVar

from nicegui.element import Element

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, button, set_attribute
from tumble.bench.parts.fields import (
    Field,
    choice_field,
    flag_field,
    flag_text,
    number_field,
    number_text,
    text_field,
)
from tumble.foundation.errors import TumbleError
from tumble.foundation.numbers import number_of
from tumble.tools.guided.field import FieldValue, RunField

Taken = TypeVar("Taken", str, bool)


class RunForm:
    """See the module; the fields follow from the kind of run."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._revision = -1
        self._shown: list[tuple[Field, Callable[[], str]]] = []
        """Fields, each with what it has to show."""
        self._armed: Element | None = None
        self._motion, self._shows_armed = page.bench.motion, False
        """Motion that is shown, and whether the table is shown as armed for it."""
        page.primary = page.bench.start
        page.scan = self._scan
        kind = page.bench.kind
        with block("screen-head"):
            Label(page.text(kind.title), "title", "h1")
            Label(page.text(kind.summary), "lead")
        self._trouble = Label("", "trouble")
        with block("two-columns"):
            with block("side"):
                self._units = block("panel")
                if kind.takes_table:
                    with block("panel"):
                        self._table()
            with block("side"), block("panel form"):
                self._questions()
        with block("start-bar"):
            button(page.words("Start"), page.guarded(page.bench.start), "primary large")
            Label(page.words("or space, Enter, the pedal"), "help")

    def update(self) -> None:
        """Shows units, answers and table as they are now, and why the last order could not be carried out."""
        self._trouble.show(self._page.text(self._page.bench.engine.trouble))
        if self._page.bench.revision != self._revision:
            self._revision = self._page.bench.revision
            self._units.clear()
            with self._units:
                self._list_units()
            self._show_answers()
        self._show_armed()

    def _list_units(self) -> None:
        page = self._page
        Label(page.words("Units"), "section", "h2")
        labels = {role.name: page.text(role.label) for role in page.bench.kind.roles}
        for source in page.bench.sources.of_kind():
            if source.role:
                with block("unit-line"):
                    Label(source.name, "unit-name")
                    Label(labels.get(source.role, source.role), "unit-role")
                    Label(
                        source.serial or page.words("no serial; scan it"),
                        "unit-serial" if source.serial else "help",
                    )
        for missing in page.bench.missing():
            Label(page.words("No unit is the {role} yet.", role=labels[missing]), "trouble")

    def _questions(self) -> None:
        page, bench = self._page, self._page.bench
        Label(page.words("This run"), "section", "h2")
        for field in bench.kind.fields:
            if not field.advanced:
                self._question(field)
        self._text("Operator", lambda: bench.choice.operator, lambda text: bench.sign(operator=text))
        self._text("Station", lambda: bench.choice.station, lambda text: bench.sign(station=text))
        advanced = [field for field in bench.kind.fields if field.advanced]
        if advanced:
            with block("more", "details"):
                Label(page.words("More"), tag="summary")
                for field in advanced:
                    self._question(field)

    def _question(self, field: RunField) -> None:
        page, bench = self._page, self._page.bench
        label, help_text = page.text(field.label), page.text(field.help)

        def value() -> FieldValue:
            return bench.choice.options.get(field.name, field.default)

        def text() -> str:
            return str(value() or "")

        def number() -> str:
            found = value()
            return number_text(found if isinstance(found, int | float) else None)

        def take(text: str) -> None:
            bench.answer(field.name, text)

        match field.kind:
            case "flag":
                flag = flag_field(
                    label,
                    bool(value()),
                    self._taking(lambda ticked: bench.answer(field.name, ticked)),
                    help_text=help_text,
                )
                self._shown.append((flag, lambda: flag_text(bool(value()))))
            case "number":
                found = number_field(
                    label,
                    None,
                    self._taking(lambda text: bench.answer(field.name, _number(text, field))),
                    unit=field.unit,
                    least=field.least,
                    most=field.most,
                    help_text=help_text,
                )
                self._shown.append((found, number))
            case "choice":
                choices = [(key, page.text(text)) for key, text in field.choices]
                chosen = choice_field(label, choices, text(), self._taking(take), help_text=help_text)
                self._shown.append((chosen, text))
            case "file":
                none = ("", page.words("none"))
                choices = [none, *((name, name) for name in bench.files())]
                chosen = choice_field(label, choices, text(), self._taking(take), help_text=help_text)
                self._shown.append((chosen, text))
            case "text":
                typed = text_field(label, text(), self._taking(take), help_text=help_text)
                self._shown.append((typed, text))

    def _text(
        self, label: str, content: Callable[[], str], take: Callable[[str], None], help_text: str = ""
    ) -> None:
        field = text_field(self._page.words(label), content(), self._taking(take), help_text=help_text)
        self._shown.append((field, content))

    def _taking(self, take: Callable[[Taken], None]) -> Callable[[Taken], None]:
        """Returns what takes an answer: the fields then show what is shared, also where it was refused."""

        def taken(answer: Taken) -> None:
            has_seen_all = self._motion == self._page.bench.motion
            self._page.guarded(partial(take, answer))()
            self._show_answers()
            # The answer is shown to whoever typed it; what another browser changed before is not yet.
            if has_seen_all:
                self._show_armed()

        return taken

    def _show_answers(self) -> None:
        """Shows what is shared where a field shows something else, as it was refused or changed elsewhere."""
        for field, content in self._shown:
            if field.content != content():
                field.show(content())

    def _table(self) -> None:
        page, bench = self._page, self._page.bench
        Label(page.words("Rate table"), "section", "h2")
        address = page.words("Such as simulated:two-axis, or empty to turn it by hand")
        self._text(
            "Table",
            lambda: bench.choice.table.address,
            lambda text: bench.change_table(address=text),
            help_text=address,
        )
        self._text(
            "Limits of motion",
            lambda: bench.choice.table.limits,
            lambda text: bench.change_table(limits=text),
        )
        with block("arm"):
            self._armed = button(page.words("Arm the table"), page.guarded(self._arm), "arm-button")
            Label(page.words("Armed, it moves by itself once the run starts. Keep clear of it."), "help")

    def _show_armed(self) -> None:
        bench = self._page.bench
        self._motion, self._shows_armed = bench.motion, bench.is_armed
        if self._armed is not None:
            set_attribute(self._armed, "aria-pressed", "true" if self._shows_armed else "false")

    def _arm(self) -> None:
        """Arms the table for what was shown, or disarms the one that was shown as armed."""
        bench = self._page.bench
        if self._shows_armed:
            bench.disarm()
        else:
            bench.arm(self._motion)

    def _scan(self, text: str) -> None:
        page = self._page
        name = page.bench.take_serial(text)
        if name:
            page.notify(page.words("{name} has serial {serial}.", name=name, serial=text), "good")
        else:
            page.notify(page.words("Every unit has a serial already."), "warn")


def _number(text: str, field: RunField) -> float | None:
    """Returns what was typed; raises `TumbleError` where it is no number, or out of bounds."""
    if not text.strip():
        return None
    value = number_of(text)
    low = field.least if field.least is not None else float("-inf")
    high = field.most if field.most is not None else float("inf")
    if value is None or not low <= value <= high:
        raise TumbleError(f"{field.label}: {text} is not within {low:g} to {high:g} {field.unit}".strip())
    return value
