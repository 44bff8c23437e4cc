"""The screen Log: charts of recordings, their inspection, sections, spectra, and procedures on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import ui

from tumble.bench.log.bounds import WatchedElement, keep_newest
from tumble.bench.log.chart_options import (
    ChartPlan,
    deviation_plan,
    recording_plan,
    residual_plan,
    spectrum_plan,
)
from tumble.bench.log.inspection_panel import show_inspection
from tumble.bench.log.procedure_panel import OWN_COMPUTER, ProcedurePanel, ResultPages, Workplace
from tumble.bench.log.recording_chart import RecordingChart
from tumble.bench.log.samples_route import SamplesRoute
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_names import file_stem
from tumble.foundation.file_reading import own_text
from tumble.foundation.translation import ENGLISH, speak, translated
from tumble.tools.view.deviation import deviations
from tumble.tools.view.samples import channel_name
from tumble.tools.view.spectrum import spectra
from tumble.tools.view.viewing import ViewedUnit, Viewing
from tumble.tools.viewers.content import Form

STYLE = Path(__file__).with_name("log.css")
REFRESH = 0.3
"""s between looks for what was found meanwhile."""
KEYS = (
    ("← →", "move; with Shift farther"),
    ("↑ ↓", "zoom in and out, as + and - do"),
    ("Home", "the whole recording"),
    ("N P", "select the next rest, or the one before"),
    ("[ ]", "begin or end the selection here"),
    ("Enter", "zoom to the selection"),
    ("Esc", "select nothing"),
)


def add_style() -> None:
    """Gives the current page the style of the screen."""
    ui.add_css(own_text(STYLE))


class RecordingScreen:
    """One page that shows a viewing; several pages may show the same."""

    def __init__(
        self,
        viewing: Viewing,
        samples: SamplesRoute,
        pages: ResultPages,
        language: str = ENGLISH,
        workplace: Workplace = OWN_COMPUTER,
    ) -> None:
        self._workplace = workplace
        self._viewing = viewing
        self._language = language
        self._route = samples
        self._pages = pages
        self._version = -1
        self._unit: ViewedUnit = viewing.units[0]
        self._section: tuple[float, float] | None = None
        self._sections: list[tuple[float, float]] = []
        self._forms: tuple[Form, ...] = ("raw",)
        self._planned: tuple[Any, ...] = ()
        self._address = ""
        self._window: dict[str, Any] = {}
        self._is_analysing = self._has_ended = False

    def show(self) -> None:
        """Builds the page into the current place."""
        speak(self._language)
        with WatchedElement("div", self._let_go).classes("tumble-log"):
            with ui.element("div").classes("tumble-charts"):
                self._bar()
                self._state = ui.label().classes("tumble-state").props('role="status"')
                plan = self._plan()
                self._address = self._route.serve(self._viewing, plan.lines)
                self._chart = RecordingChart(
                    plan,
                    label=self._label(),
                    title=self._viewing.title,
                    file=file_stem(self._viewing.title),
                    source=self._address,
                ).classes("w-full")
                self._chart.on("choose", self._on_choose)
                self._chart.on("window", self._on_window)
                self._chart.on("trouble", lambda event: self._report(str(event.args)))
                self._analyses = ui.element("div")
            with ui.element("div").classes("tumble-side"):
                self._selection_card()
                self._procedures = ProcedurePanel(self._viewing, self._pages, self._report, self._workplace)
                self._facts = ui.element("div")
        self._look()
        ui.timer(REFRESH, self._look)

    def _let_go(self) -> None:
        """Lets go of the samples: the page is gone, or shows something else."""
        self._has_ended = True
        self._route.end(self._address)

    def _bar(self) -> None:
        viewing = self._viewing
        with ui.element("div").classes("tumble-bar"):
            with ui.element("h1").classes("tumble-title"):
                ui.label(viewing.title)
            with ui.element("div").classes("tumble-tools"):
                modes = {
                    "zoom": translated("Zoom"),
                    "move": translated("Move"),
                    "select": translated("Select"),
                }
                self._choices(
                    translated("Dragging"), modes, "zoom", lambda mode: self._chart.command("set_mode", mode)
                )
                if any(unit.samples.calibration is not None for unit in viewing.units):
                    forms = {
                        "both": translated("Both"),
                        "raw": translated("Raw"),
                        "calibrated": translated("Calibrated"),
                    }
                    self._forms = ("raw", "calibrated")
                    self._choices(translated("Readings"), forms, "both", self._on_form)
                self._button(
                    translated("Whole"), lambda: self._chart.command("zoom", 0.0, self._viewing.duration)
                )
                self._button("PNG", lambda: self._chart.command("picture", "png"), translated("Save as PNG"))
                self._button("SVG", lambda: self._chart.command("picture", "svg"), translated("Save as SVG"))
                self._keys()
            if len(viewing.units) > 1:
                self._unit_boxes()

    def _choices(self, name: str, options: dict[str, str], value: str, act: Callable[[str], None]) -> None:
        with ui.element("div").classes("tumble-choice").props('role="group"') as group:
            group.props["aria-label"] = name
            buttons: dict[str, ui.button] = {}

            def choose(key: str) -> None:
                for each, button in buttons.items():
                    button.props["aria-pressed"] = "true" if each == key else "false"
                    button.update()
                act(key)

            ui.label(name).classes("tumble-soft")
            for key, text in options.items():
                buttons[key] = self._button(text, partial(choose, key))
                buttons[key].props["aria-pressed"] = "true" if key == value else "false"

    def _button(self, text: str, act: Callable[[], Any], hint: str = "") -> ui.button:
        button = ui.button(text, on_click=act, color=None)
        button.props("flat dense no-caps").classes("tumble-button")
        if hint:
            button.props["aria-label"] = hint
        return button

    def _keys(self) -> None:
        with (
            self._button(translated("Keys"), lambda: None),
            ui.menu().props('aria-label="Keys"'),
            ui.element("dl").classes("tumble-keys"),
        ):
            for keys, meaning in KEYS:
                with ui.element("dt"):
                    ui.label(keys)
                with ui.element("dd"):
                    ui.label(translated(meaning))

    def _unit_boxes(self) -> None:
        self._hidden_units: set[str] = set()
        with ui.element("div").classes("tumble-units").props('role="group"') as group:
            group.props["aria-label"] = translated("Units")
            for unit in self._viewing.units:
                ui.checkbox(unit.name, value=True, on_change=self._unit_switch(unit.name)).props("dense")
            names = [unit.name for unit in self._viewing.units]
            ui.select(
                names, value=names[0], label=translated("Rests and figures of"), on_change=self._on_unit
            ).props("dense outlined options-dense").classes("tumble-unit")

    def _unit_switch(self, name: str) -> Callable[[Any], None]:
        def switch(event: Any) -> None:  # noqa: ANN401 - an event of NiceGUI
            (self._hidden_units.discard if event.value else self._hidden_units.add)(name)
            self._chart.hide([*self._hidden_units])

        return switch

    def _on_unit(self, event: Any) -> None:  # noqa: ANN401
        self._unit = next(unit for unit in self._viewing.units if unit.name == event.value)
        self._version = -1
        self._look()
        if self._window:
            self._show_figures()

    def _on_form(self, choice: str) -> None:
        self._forms = ("raw", "calibrated") if choice == "both" else (choice,)  # type: ignore[assignment]
        self._replan()

    def _plan(self) -> ChartPlan:
        return recording_plan([unit.samples for unit in self._viewing.units], self._forms, self._viewing.date)

    def _replan(self) -> None:
        plan = self._plan()
        self._route.change(self._address, plan.lines)
        self._chart.plan(plan, self._label())

    def _label(self) -> str:
        names = ", ".join(unit.name for unit in self._viewing.units)
        return translated(
            "Chart of {names} over {duration} s. Arrow keys move and zoom; the figures are in the table "
            "What is visible.",
            names=names,
            duration=f"{self._viewing.duration:.6g}",
        )

    def _selection_card(self) -> None:
        with ui.element("section").classes("tumble-card"):
            self._heading(translated("Selection"))
            with ui.element("div").classes("tumble-row"):
                self._start = ui.number(translated("from, s"), format="%.3f", on_change=self._on_typed)
                self._end = ui.number(translated("to, s"), format="%.3f", on_change=self._on_typed)
                for each in (self._start, self._end):
                    each.props("dense outlined").classes("tumble-number-field")
            with ui.element("div").classes("tumble-row"):
                self._button(translated("Zoom here"), self._zoom_to)
                self._button(translated("Spectrum"), self._show_spectrum)
                self._button(translated("Allan deviation"), self._show_deviation)
                self._button(translated("Add section"), self._add_section)
            self._chosen = ui.element("div")
            ui.label(translated("Nothing selected: the whole recording counts.")).classes(
                "tumble-soft"
            ).bind_visibility_from(self._start, "value", lambda value: value is None)
            self._heading(translated("What is visible"))
            self._visible = ui.element("div")

    @staticmethod
    def _heading(text: str) -> None:
        with ui.element("h2").classes("tumble-heading"):
            ui.label(text)

    def _on_choose(self, event: Any) -> None:  # noqa: ANN401
        section = event.args
        self._section = (float(section[0]), float(section[1])) if section else None
        self._start.value, self._end.value = self._section or (None, None)

    def _on_typed(self) -> None:
        start, end = self._start.value, self._end.value
        section = (
            (float(start), float(end)) if start is not None and end is not None and end > start else None
        )
        if section is not None and section != self._section:
            self._section = section
            self._chart.command("choose", *section, True)

    def _selected(self) -> tuple[float, float]:
        return self._section or (0.0, self._viewing.duration)

    def _zoom_to(self) -> None:
        self._chart.command("zoom", *self._selected())

    def _add_section(self) -> None:
        if self._section is None:
            self._report(translated("Select a part of the recording first."))
            return
        self._sections = sorted({*self._sections, self._section})
        self._list_sections()

    def _list_sections(self) -> None:
        self._procedures.choose(self._sections)
        self._chosen.clear()
        with self._chosen:
            for section in self._sections:
                with ui.element("div").classes("tumble-row"):
                    ui.label(f"{section[0]:.3f} to {section[1]:.3f} s")
                    self._button(
                        translated("Remove"),
                        partial(self._remove, section),
                        translated("Remove section from {start} s", start=f"{section[0]:.3f}"),
                    )

    def _remove(self, section: tuple[float, float]) -> None:
        self._sections.remove(section)
        self._list_sections()

    async def _show_spectrum(self) -> None:
        speak(self._language)
        form: Form = "raw" if "raw" in self._forms else "calibrated"
        await self._analyse(
            translated("Amplitude spectral density"),
            lambda: spectrum_plan(spectra(self._unit.samples, *self._selected(), form)),
            " Hz",
        )

    async def _show_deviation(self) -> None:
        speak(self._language)
        form: Form = "raw" if "raw" in self._forms else "calibrated"
        await self._analyse(
            translated("Allan deviation"),
            lambda: deviation_plan(deviations(self._unit.samples, *self._selected(), form)),
            " s",
        )

    async def _analyse(self, name: str, plan: Callable[[], ChartPlan], x_unit: str) -> None:
        if self._is_analysing:
            return
        start, end = self._selected()
        self._report(
            translated("{name} of {start} to {end} s …", name=name, start=f"{start:.3f}", end=f"{end:.3f}")
        )
        self._is_analysing = True
        try:
            found = await self._route.turn.computed(plan, lambda: not self._has_ended)
        except TumbleError as error:
            self._report(str(error))
            return
        finally:
            self._is_analysing = False
        if found is None or self._has_ended:
            return
        self._report("")
        with self._analyses:
            self._curves(f"{name}: {self._unit.name}", f"{start:.3f} to {end:.3f} s", found, x_unit)

    def _curves(
        self, title: str, subtitle: str, plan: ChartPlan, x_unit: str, *, closes: bool = True
    ) -> None:
        with ui.element("section").classes("tumble-card tumble-analysis") as card:
            self._heading(title)
            with ui.element("div").classes("tumble-row"):
                ui.label(subtitle).classes("tumble-soft")
                chart_buttons = ui.element("div").classes("tumble-row")
            chart = RecordingChart(plan, label=title, title=title, file=file_stem(title)).classes("w-full")
            chart.plan(plan, title, subtitle=subtitle, x_unit=x_unit)
            with chart_buttons:
                for kind in ("png", "svg"):
                    self._button(
                        kind.upper(),
                        partial(chart.command, "picture", kind),
                        translated("Save {title} as {kind}", title=title, kind=kind.upper()),
                    )
                if closes:
                    self._button(translated("Close"), card.delete, translated("Close {title}", title=title))
        keep_newest(self._analyses)

    def _on_window(self, event: Any) -> None:  # noqa: ANN401
        self._window = event.args
        self._show_figures()

    def _show_figures(self) -> None:
        """Shows the lowest and highest values of one unit in the visible range."""
        speak(self._language)
        window = self._window
        lines = {line.series: line for line in self._plan().lines}
        self._visible.clear()
        with self._visible, ui.element("table").classes("tumble-table"):
            with ui.element("caption"):
                whose = f"{self._unit.name}, " if len(self._viewing.units) > 1 else ""
                ui.label(f"{whose}{window['start']:.6g} to {window['end']:.6g} s").classes("tumble-soft")
            self._table_row("th", (translated("channel"), translated("lowest"), translated("highest")))
            for each in window["figures"]:
                line = lines.get(each["series"])
                if line is None or each["low"] is None or line.unit != self._unit.name:
                    continue
                form = f" {translated(line.form)}" if len(self._forms) > 1 else ""
                name = f"{channel_name(line.channel)}{form}"
                self._table_row("td", (name, f"{each['low']:.5g}", f"{each['high']:.5g}"))

    @staticmethod
    def _table_row(cell: str, texts: Sequence[str]) -> None:
        with ui.element("tr"):
            for place, text in enumerate(texts):
                with ui.element("th" if place == 0 else cell) as head:
                    if cell == "th" or place == 0:
                        head.props(f"scope={'col' if cell == 'th' else 'row'}")
                    ui.label(text)

    def _report(self, text: str) -> None:
        self._state.text = text

    def _look(self) -> None:
        """Shows what was found since the last look."""
        speak(self._language)
        viewing = self._viewing
        reading = any(unit.stage in ("waiting", "reading") for unit in viewing.units)
        if viewing.version == self._version and not reading:
            return
        self._version = viewing.version
        planned = tuple(unit.samples.channels for unit in viewing.units), viewing.date
        if planned != self._planned:
            self._planned = planned
            self._replan()
        self._chart.show_marks(self._unit.marks, viewing.duration)
        self._report(self._progress())
        self._facts.clear()
        with self._facts:
            self._about()
        self._procedures.offer(self._unit)

    def _progress(self) -> str:
        words = {
            "waiting": translated("waiting"),
            "reading": translated("reading"),
            "marking": translated("finding rests"),
            "inspecting": translated("inspecting"),
        }
        under_way = [
            f"{unit.name}: {words[unit.stage]}"
            + (f" {100.0 * unit.share:.0f} %" if unit.stage == "reading" and unit.share is not None else "")
            for unit in self._viewing.units
            if unit.stage in words
        ]
        return "; ".join(under_way)

    def _about(self) -> None:
        unit = self._unit
        for text in (*self._viewing.remarks, *(each.problem for each in self._viewing.units if each.problem)):
            ui.label(text).classes("tumble-remark")
        for text in unit.remarks:
            ui.label(text).classes("tumble-remark")
        if unit.result is not None:
            self._result(unit)
        if unit.inspection is not None:
            show_inspection(unit.inspection)

    def _result(self, unit: ViewedUnit) -> None:
        result = unit.result
        assert result is not None
        with ui.element("section").classes("tumble-card"):
            self._heading(translated("Result"))
            ui.label(f"{result.name}: {translated(result.verdict)}").classes("tumble-verdict")
            ui.label(result.path.name).classes("tumble-soft")
            if result.residuals:
                self._button(translated("Residuals"), lambda: self._show_residuals(unit))

    def _show_residuals(self, unit: ViewedUnit) -> None:
        assert unit.result is not None
        speak(self._language)
        title = translated("Residuals of {name}", name=unit.result.name)
        subtitle = translated("measured less modelled, with 1-sigma of what was measured")
        with self._analyses:
            self._curves(title, subtitle, residual_plan(unit.result.residuals), "")
