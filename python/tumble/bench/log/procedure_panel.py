"""Procedures that a recording, or sections of it, can serve: run in a thread, with verdict and page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from fastapi import APIRouter, HTTPException
from fastapi.responses import FileResponse
from nicegui import run, ui

from tumble.bench.authority import refuse_unless_allowed
from tumble.bench.log.bounds import keep_newest
from tumble.foundation.errors import OutputError, TumbleError
from tumble.foundation.file_names import file_stem
from tumble.foundation.procedures import PROCEDURES, Procedure
from tumble.foundation.translation import translated
from tumble.tools.view.viewing import ViewedUnit, Viewing

ROUTE = "/made-here"


class ResultPages:
    """Serves pages of results that were made here, by number; no other file."""

    def __init__(self) -> None:
        self.router = APIRouter()
        self._pages: list[Path] = []
        self.router.add_api_route(f"{ROUTE}/{{number}}", self._page)

    def serve(self, page: Path) -> str:
        """Serves a page; returns its address."""
        self._pages.append(page.resolve())
        return f"{ROUTE}/{len(self._pages)}"

    def _page(self, number: int) -> FileResponse:
        if not 1 <= number <= len(self._pages):
            raise HTTPException(404, "no such page")
        return FileResponse(self._pages[number - 1], media_type="text/html")


@dataclass(frozen=True, slots=True)
class Workplace:
    """Where results of procedures go, and who may run them."""

    folder: Path
    """Folder to which the folders of results are relative."""
    is_bound: bool = False
    """Indicates whether they must be within it: whoever asks may be at another computer, or only look."""

    def place(self, typed: str) -> Path:
        """Returns the folder of results that was typed.

        Raises `OutputError` where it is out of bounds, and `NotOperatorError` for those who only look.
        """
        if self.is_bound:
            refuse_unless_allowed()
        wanted = self.folder / typed
        if self.is_bound and not wanted.resolve().is_relative_to(self.folder.resolve()):
            raise OutputError(f"{typed}: is not within {self.folder}; give a folder in it")
        return wanted


OWN_COMPUTER = Workplace(Path())
"""Whoever opens the page started it, and may do what commands may."""


def procedures_of_several() -> list[Procedure]:
    """Returns the procedures that take units together."""
    return [each for each in PROCEDURES if each.roles]


def usual_first(names: Sequence[str]) -> str:
    """Returns the unit that the others are held against: that of the name of such a role, else the first."""
    roles = {each.roles[0] for each in procedures_of_several()}
    return next((name for name in names if name in roles), names[0])


def procedures_for(unit: ViewedUnit) -> list[Procedure]:
    """Returns the procedures that take one log, and that inspection finds possible."""
    if unit.inspection is None:
        return []
    possible = {service.procedure for service in unit.inspection.services if service.possible}
    return [each for each in PROCEDURES if each.takes_one_log and each.word in possible]


def run_procedure(
    procedure: Procedure,
    units: Sequence[ViewedUnit],
    sections: Sequence[tuple[float, float]],
    viewing: Viewing,
    folder: Path,
) -> tuple[str, dict[str, Path]]:
    """Runs a procedure as its command does; returns the verdict, and the path of each file by what it is.

    One that takes units together gets the first, and the others. Without sections the logs themselves are
    read, so that files are those of the command. Raises `TumbleError` in one line where it cannot be done.
    """
    with viewing.in_use():
        return _run(procedure, units, sections, viewing, folder)


def _run(
    procedure: Procedure,
    units: Sequence[ViewedUnit],
    sections: Sequence[tuple[float, float]],
    viewing: Viewing,
    folder: Path,
) -> tuple[str, dict[str, Path]]:
    act = getattr(import_module(f"{procedure.folder}.procedure"), procedure.word)
    first, *others = (unit.samples.cut(list(sections)) if sections else unit.source for unit in units)
    given = (first, others) if procedure.roles else (first,)
    result = act(*given) if sections else act(*given, read=viewing.read_options)
    return str(result.verdict), result.save(folder)


class ProcedurePanel:
    """Buttons of procedures, and their verdicts."""

    def __init__(
        self, viewing: Viewing, pages: ResultPages, report: Callable[[str], None], workplace: Workplace
    ) -> None:
        self._viewing = viewing
        self._workplace = workplace
        self._pages = pages
        self._report = report
        self._sections: list[tuple[float, float]] = []
        self._offered: tuple[str, ...] = ()
        with ui.element("section").classes("tumble-card") as self._card:
            with ui.element("h2").classes("tumble-heading"):
                ui.label(translated("Run a procedure"))
            self._on = ui.label().classes("tumble-soft")
            self._folder = (
                ui.input(translated("Folder for results")).props("dense outlined").classes("w-full")
            )
            self._buttons = ui.element("div").classes("tumble-row")
            self._set = ui.element("div")
            self._verdicts = ui.element("div").props('role="status"')
        self._card.set_visibility(False)
        self.choose([])

    def choose(self, sections: Sequence[tuple[float, float]]) -> None:
        """Runs the next procedure on these sections; on the whole log without any."""
        self._sections = list(sections)
        count = len(self._sections)
        self._on.text = (
            translated("On {count} chosen sections of the recording.", count=count)
            if count
            else translated("On the whole recording.")
        )

    def offer(self, unit: ViewedUnit) -> None:
        """Offers the procedures that a unit can serve, and those for all units together once all are read."""
        found = procedures_for(unit)
        units = self._viewing.units if self._viewing.is_done and len(self._viewing.units) > 1 else ()
        words = (unit.name, *(each.word for each in found), *(each.name for each in units))
        if words == self._offered:
            return
        self._offered = words
        self._card.set_visibility(bool(found or units))
        self._folder.value = f"{file_stem(self._viewing.title if units else unit.name)}-tumble"
        self._buttons.clear()
        with self._buttons:
            for each in found:
                self._button(each, lambda: [unit])
        self._set.clear()
        with self._set:
            if units:
                self._offer_set([each for each in units if not each.problem])

    def _offer_set(self, units: list[ViewedUnit]) -> None:
        """Offers what takes units together: the first, that others are held against, and those others."""
        known = {unit.name: unit for unit in units}
        chosen = {"first": usual_first(list(known))}
        taking_part = dict.fromkeys(known, True)

        def in_order() -> list[ViewedUnit]:
            first = chosen["first"]
            return [known[first], *(known[name] for name in known if name != first and taking_part[name])]

        with ui.element("h3").classes("tumble-subheading"):
            ui.label(translated("Units together"))
        ui.select(
            list(known),
            value=chosen["first"],
            label=translated("Reference or primary"),
            on_change=lambda event: chosen.update(first=event.value),
        ).props("dense outlined options-dense").classes("w-full")
        with ui.element("div").classes("tumble-row").props('role="group"') as group:
            group.props["aria-label"] = translated("Units that take part")
            for name in known:
                change = partial(self._take_part, taking_part, name)
                ui.checkbox(name, value=True, on_change=change).props("dense")
        with ui.element("div").classes("tumble-row"):
            for each in procedures_of_several():
                self._button(each, in_order)

    @staticmethod
    def _take_part(taking_part: dict[str, bool], name: str, event: Any) -> None:  # noqa: ANN401
        taking_part[name] = bool(event.value)

    def _button(self, procedure: Procedure, units: Callable[[], list[ViewedUnit]]) -> None:
        button = ui.button(translated(procedure.title), on_click=self._runs(procedure, units), color=None)
        button.props("flat dense no-caps").classes("tumble-button")
        button.props["title"] = translated(procedure.summary)

    def _runs(self, procedure: Procedure, units: Callable[[], list[ViewedUnit]]) -> Callable[[], Any]:
        async def act() -> None:
            taken = units()
            if procedure.roles and len(taken) == 1:
                self._report(translated("Choose at least one unit beside {name}.", name=taken[0].name))
                return
            self._report(translated("{title} …", title=translated(procedure.title)))
            try:
                typed = self._folder.value.strip() or f"{file_stem(taken[0].name)}-tumble"
                found = await run.io_bound(
                    run_procedure,
                    procedure,
                    taken,
                    tuple(self._sections),
                    self._viewing,
                    self._workplace.place(typed),
                )
            except TumbleError as error:
                self._show(procedure, translated(str(error)), None)
                return
            finally:
                self._report("")
            if found is not None:
                verdict, files = found
                self._show(procedure, translated(verdict), files.get("report"))

        return act

    def _show(self, procedure: Procedure, verdict: str, page: Path | None) -> None:
        with self._verdicts, ui.element("div").classes("tumble-row"):
            ui.label(f"{translated(procedure.title)}: {verdict}").classes("tumble-verdict")
            if page is not None:
                ui.link(translated("Page of the result"), self._pages.serve(page), new_tab=True)
        keep_newest(self._verdicts)
