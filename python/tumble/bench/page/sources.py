"""Screen of the sources: what kind of run, which units, and how they do."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from nicegui.element import Element

from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, button, set_attribute
from tumble.bench.parts.fields import choice_field, text_field
from tumble.bench.parts.lamp import CONDITIONS, Lamp
from tumble.bench.sources import BenchSource, found_lines
from tumble.foundation.message import message


class SourcesScreen:
    """See the module."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._revision = -1
        self._rows: dict[str, _Row] = {}
        page.primary = lambda: page.go("/run")
        page.scan = self._scan
        with block("screen-head"):
            Label(page.words("Sources"), "title", "h1")
            Label(page.words("Choose a run, and give each unit its role and serial."), "lead")
        with block("kinds", role="group", aria_label=page.words("Kind of run")):
            self._kinds = {kind.word: self._kind(kind.word) for kind in page.bench.kinds}
        self._list = block("sources")
        with block("below-list"):
            self._empty = Label("", "lead")
            button(page.words("Continue"), page.guarded(page.primary), "primary")
        with block("panel"):
            self._add_form()
        with block("panel"):
            self._earlier_runs()

    def update(self) -> None:
        """Shows the sources and their state."""
        bench = self._page.bench
        if bench.revision != self._revision:
            self._revision = bench.revision
            self._fill()
        for row in self._rows.values():
            row.update()

    def _kind(self, word: str) -> Element:
        page = self._page
        kind = next(each for each in page.bench.kinds if each.word == word)
        element = button(page.text(kind.title), page.guarded(partial(page.bench.choose, word)), "kind")
        with element:
            Label(page.text(kind.summary), "kind-summary")
        return element

    def _fill(self) -> None:
        """Builds the list anew where units or roles changed."""
        page = self._page
        for word, element in self._kinds.items():
            set_attribute(element, "aria-pressed", "true" if word == page.bench.choice.word else "false")
        self._list.clear()
        with self._list:
            self._rows = {source.name: _Row(page, source) for source in page.bench.sources.of_kind()}
        missing = list(page.bench.missing())
        text = page.words("Still without a unit: {roles}.", roles=", ".join(missing)) if missing else ""
        self._empty.show(text)

    def _scan(self, text: str) -> None:
        page = self._page
        name = page.bench.take_serial(text)
        said = (
            page.words("{name} has serial {serial}.", name=name, serial=text)
            if name
            else page.words("Every unit has a serial already.")
        )
        page.notify(said, "good" if name else "warn")

    def _add_form(self) -> None:
        page = self._page
        typed = {"name": "", "address": ""}

        def add() -> None:
            page.bench.add_source(BenchSource(typed["name"].strip(), typed["address"].strip()))
            typed.update(name="", address="")
            name.show("")
            address.show("")

        Label(page.words("Add a source"), "section", "h2")
        with block("form-row"):
            name = text_field(page.words("Name"), "", partial(typed.__setitem__, "name"))
            address = text_field(
                page.words("Address"),
                "",
                partial(typed.__setitem__, "address"),
                help_text=page.words("Such as serial:/dev/ttyUSB0?baud=115200 or udp://:9000"),
                classes="wide",
            )
            button(page.words("Add"), page.guarded(add))
        self._found = block("found")

        def look() -> None:
            self._found.clear()
            lines = found_lines()
            with self._found:
                if not lines:
                    Label(page.words("No serial port and no IIO sensor is plugged in."), "lead")
                for line in lines:
                    with block("found-line"):
                        Label(line.address, "mono")
                        if line.trouble:
                            Label(page.text(message(line.trouble)), "help")
                        else:
                            button(page.words("Use"), partial(use, line.address), "small")

        def use(found: str) -> None:
            typed["address"] = found
            address.show(found)

        button(page.words("Look for plugged-in sensors"), look, "small quiet")

    def _earlier_runs(self) -> None:
        page = self._page
        Label(page.words("Earlier runs"), "section", "h2")
        runs = page.bench.earlier()[:8]
        if not runs:
            Label(page.words("None in {folder}.", folder=str(page.bench.folder)), "lead")
        for run in runs:
            with block("earlier"):
                Label(run.path.name, "mono")
                if run.is_finished:
                    button(
                        page.words("Show result"),
                        page.guarded(partial(page.bench.engine.show, run)),
                        "small quiet",
                    )
                elif run.has_recording:
                    Label(page.words("not finished"), "help")


class _Row:
    """One source."""

    def __init__(self, page: PageContext, source: BenchSource) -> None:
        self._page, self._source = page, source
        with block("source"):
            with block("source-state"):
                self._lamp = Lamp()
            with block("source-name"):
                Label(source.name, "unit-name")
                Label(source.address, "address mono")
            with block("source-figures"):
                self._condition = Label("", "condition")
                self._rate = Label("", "rate")
                self._remark = Label("", "help")
            roles = [("", page.words("takes no part"))]
            roles += [(role.name, page.text(role.label)) for role in page.bench.kind.roles]
            choice_field(
                page.words("Role of {name}", name=source.name),
                roles,
                source.role,
                self._take_role,
                hidden_label=True,
            )
            text_field(
                page.words("Serial of {name}", name=source.name),
                source.serial,
                self._take_serial,
                hidden_label=True,
                classes="serial",
            )
            if source.origin == "typed":
                label = page.words("Remove {name}", name=source.name)
                button("✕", page.guarded(partial(page.bench.remove_source, source.name)), "icon", label=label)
            else:
                block()

    def update(self) -> None:
        page = self._page
        state = page.bench.sources.state(self._source.name)
        self._lamp.show(state.condition)
        self._condition.show(page.text(CONDITIONS[state.condition]))
        gaps = page.words("{count} gaps", count=state.gaps) if state.gaps else ""
        rate = "" if math.isnan(state.rate) else f"{state.rate:.4g} Hz"
        self._rate.show(", ".join(filter(None, (rate, gaps))))
        remark = page.text(message(state.trouble or state.remark))
        self._remark.show(remark if state.trouble else remark.partition(";")[0])
        set_attribute(self._remark, "title", remark or None)

    def _take_role(self, role: str) -> None:
        self._change(lambda source: replace(source, role=role))

    def _take_serial(self, serial: str) -> None:
        self._change(lambda source: replace(source, serial=serial.strip()[:80]))

    def _change(self, changed: Callable[[BenchSource], BenchSource]) -> None:
        bench, name = self._page.bench, self._source.name
        self._page.guarded(lambda: bench.change_source(name, changed(bench.sources[name])))()


def show_sources(page: PageContext) -> SourcesScreen:
    """Builds the screen."""
    return SourcesScreen(page)
