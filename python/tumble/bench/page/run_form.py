"""Form before a run: its questions, the units that take part, and the table."""

from __future__ import annotations

from functools import partial

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, button, set_attribute
from tumble.bench.parts.fields import choice_field, flag_field, number_field, text_field
from tumble.foundation.errors import TumbleError
from tumble.foundation.numbers import number_of
from tumble.tools.guided.field import RunField


class RunForm:
    """See the module; the fields follow from the kind of run."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._revision = -1
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
        """Shows the units as they are now, and why the last order could not be carried out."""
        self._trouble.show(self._page.text(self._page.bench.engine.trouble))
        if self._page.bench.revision != self._revision:
            self._revision = self._page.bench.revision
            self._units.clear()
            with self._units:
                self._list_units()

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
        page = self._page
        kind, choice = page.bench.kind, page.bench.choice
        Label(page.words("This run"), "section", "h2")
        for field in kind.fields:
            if not field.advanced:
                self._question(field)
        text_field(page.words("Operator"), choice.operator, partial(setattr, choice, "operator"))
        text_field(page.words("Station"), choice.station, partial(setattr, choice, "station"))
        advanced = [field for field in kind.fields if field.advanced]
        if advanced:
            with block("more", "details"):
                Label(page.words("More"), tag="summary")
                for field in advanced:
                    self._question(field)

    def _question(self, field: RunField) -> None:
        page, options = self._page, self._page.bench.choice.options
        label, help_text = page.text(field.label), page.text(field.help)
        value = options.get(field.name, field.default)

        def take(text: str) -> None:
            options[field.name] = text

        def take_number(text: str) -> None:
            options[field.name] = _number(text, field)

        match field.kind:
            case "flag":
                flag_field(label, bool(value), partial(options.__setitem__, field.name), help_text=help_text)
            case "number":
                number = value if isinstance(value, int | float) else None
                number_field(
                    label,
                    number,
                    lambda text: page.guarded(lambda: take_number(text))(),
                    unit=field.unit,
                    least=field.least,
                    most=field.most,
                    help_text=help_text,
                )
            case "choice":
                choices = [(key, page.text(text)) for key, text in field.choices]
                choice_field(label, choices, str(value or ""), take, help_text=help_text)
            case "file":
                none = ("", page.words("none"))
                choices = [none, *((name, name) for name in page.bench.files())]
                choice_field(label, choices, str(value or ""), take, help_text=help_text)
            case "text":
                text_field(label, str(value or ""), take, help_text=help_text)

    def _table(self) -> None:
        page, table = self._page, self._page.bench.choice.table
        Label(page.words("Rate table"), "section", "h2")
        address = page.words("Such as simulated:two-axis, or empty to turn it by hand")
        text_field(page.words("Table"), table.address, partial(setattr, table, "address"), help_text=address)
        text_field(page.words("Limits of motion"), table.limits, partial(setattr, table, "limits"))
        with block("arm"):
            arm = button(page.words("Arm the table"), page.guarded(lambda: self._arm()), "arm-button")
            Label(page.words("Armed, it moves by itself once the run starts. Keep clear of it."), "help")
        self._armed = arm
        self._show_armed()

    def _arm(self) -> None:
        table = self._page.bench.choice.table
        if not table.address:
            raise TumbleError("no table is named; type its address first")
        table.armed = not table.armed
        self._show_armed()

    def _show_armed(self) -> None:
        table = self._page.bench.choice.table
        set_attribute(self._armed, "aria-pressed", "true" if table.armed else "false")

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
