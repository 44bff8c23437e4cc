"""Screen of the fleets: jobs, how far they are, and what their results show: drift by lot, due units."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from urllib.parse import quote, urlencode

from nicegui import ui

from tumble.bench.bench import Bench
from tumble.bench.fleet_view import FleetView, JobState, SeenJob
from tumble.bench.page.context import PageContext
from tumble.bench.parts.elements import Label, block, button, file_link, set_attribute, set_class
from tumble.bench.parts.fields import choice_field
from tumble.bench.parts.tables import show_table
from tumble.foundation.errors import TumbleError
from tumble.foundation.message import Message, message
from tumble.foundation.words import length_of_time

BETWEEN_LOOKS = 2.0
"""s between two looks at the jobs; a job writes as often how far it is."""
WORDS: dict[JobState, Message] = {
    "not begun": message("not begun"),
    "running": message("running"),
    "silent": message("silent"),
    "done": message("done"),
    "cancelled": message("cancelled"),
    "failed": message("failed"),
    "unreadable": message("cannot be read"),
}
SIGNS: dict[JobState, tuple[str, str]] = {
    "not begun": ("○", "idle"),
    "running": ("◆", "busy"),
    "silent": ("▲", "warn"),
    "done": ("✓", "good"),
    "cancelled": ("▲", "warn"),
    "failed": ("✕", "bad"),
    "unreadable": ("✕", "bad"),
}
"""Sign and class of the lamp of a job."""
REMEDIES: dict[JobState, Message] = {
    "not begun": message("Begin it with: tumble fleet run {name}"),
    "silent": message("Nothing was written for a while; go on with: tumble fleet run {name} --resume"),
    "cancelled": message("Go on with: tumble fleet run {name} --resume"),
    "failed": message("Go on with: tumble fleet run {name} --resume"),
}


class FleetScreen:
    """See the module; jobs are looked at beside the page, as their results may be far away."""

    def __init__(self, page: PageContext) -> None:
        self._page = page
        self._rows: dict[str, _JobRow] = {}
        self._detail: _JobDetail | None = None
        bench = page.bench
        with block("screen-head"):
            Label(page.words("Fleet"), "title", "h1")
            self._lead = Label("", "lead")
        try:
            self._fleet = bench.fleet()
        except TumbleError as error:
            self._lead.show(page.text(message(str(error))))
            return
        self._folder = str(bench.settings.fleet or bench.folder)
        self._list = block("unit-list")
        self._place = block("job-detail")
        ui.timer(BETWEEN_LOOKS, self._look)

    def update(self) -> None:
        """Nothing changes by itself but what the looks show."""

    async def _look(self) -> None:
        self._show(await self._page.bench.beside.done(self._fleet.jobs))

    def _show(self, jobs: list[SeenJob]) -> None:
        page = self._page
        folder = self._folder
        none = page.words("No job file in {folder}; start the bench with --fleet DIR.", folder=folder)
        self._lead.show(page.words("Jobs in {folder}.", folder=folder) if jobs else none)
        names = [each.name for each in jobs]
        if names != list(self._rows):
            self._list.clear()
            with self._list:
                self._rows = {name: _JobRow(page, name, partial(self._open, name)) for name in names}
            if self._detail is not None and self._detail.name in self._rows:
                self._rows[self._detail.name].choose(True)
        for each in jobs:
            self._rows[each.name].show(each)
            if self._detail is not None and self._detail.name == each.name:
                self._detail.show(each)
        if self._detail is None and len(jobs) == 1:
            self._open(names[0])

    def _open(self, name: str) -> None:
        for each, row in self._rows.items():
            row.choose(each == name)
        self._place.clear()
        with self._place:
            files = [each for each in self._page.bench.files() if each not in self._rows]
            self._detail = _JobDetail(self._page, self._fleet, name, files)
        self._detail.show(self._rows[name].job)


class _JobRow:
    """One job: its state and how far it is."""

    def __init__(self, page: PageContext, name: str, act: partial[None]) -> None:
        self._page = page
        self.job = SeenJob(name, "not begun")
        self._box = button("", act, "job-row")
        self._box.clear()
        with self._box:
            self._lamp = Label("", "lamp", "span")
            self._lamp._props["aria-hidden"] = "true"
            Label(name, "unit-name", "span")
            self._procedure = Label("", "unit-model", "span")
            with block("bar", "span"):
                self._bar = block("bar-fill", "span")
            self._count = Label("", "job-count", "span")
            self._state = Label("", "job-state", "span")

    def show(self, job: SeenJob) -> None:
        """Shows it as it is now."""
        if job == self.job and self._state._text:
            return
        self.job = job
        page, status = self._page, job.status
        sign, kind = SIGNS[job.state]
        self._lamp.show(sign)
        for each in {kind for _, kind in SIGNS.values()}:
            set_class(self._lamp, each, each == kind)
        self._procedure.show(job.procedure)
        self._state.show(page.text(WORDS[job.state]))
        self._bar._style["width"] = f"{100.0 * job.share:.0f}%"
        self._bar.update()
        self._count.show("" if status is None else f"{status.done} / {status.inputs}")

    def choose(self, is_chosen: bool) -> None:
        """Marks it as the one whose detail is shown."""
        set_attribute(self._box, "aria-pressed", "true" if is_chosen else "false")


class _JobDetail:
    """Progress of one job in words, and the summary of its results."""

    def __init__(self, page: PageContext, fleet: FleetView, name: str, files: Sequence[str]) -> None:
        self.name = name
        self._page, self._fleet = page, fleet
        self._limits = ""
        self._has_summary = False
        with block("panel"):
            Label(name, "section", "h2")
            self._place = Label("", "mono")
            self._progress = Label("", "reason")
            self._trouble = Label("", "trouble")
            self._remedy = Label("", "help")
            with block("form-row"):
                choice_field(
                    page.words("Limits"),
                    [("", page.words("none")), *((each, each) for each in files)],
                    "",
                    self._take_limits,
                    help_text=page.words("For due dates and the capability of lots."),
                )
                button(page.words("Sum up"), self._sum_up)
                self._cancel = button(page.words("Cancel the job"), page.guarded(self._cancel_job), "quiet")
            self._doing = Label("", "help")
            self._doing._props["role"] = "status"
            self._tables = block("job-tables")

    def show(self, job: SeenJob) -> None:
        """Shows how far the job is; results are summed up once there are any."""
        page = self._page
        self._place.show(job.results)
        self._trouble.show(page.text(message(job.trouble)) if job.trouble else "")
        remedy = REMEDIES.get(job.state)
        self._remedy.show(page.words(remedy.text, name=job.name) if remedy is not None else "")
        self._progress.show(self._in_words(job))
        set_class(self._cancel, "hidden", job.state not in ("running", "silent"))
        if not self._has_summary and job.status is not None and job.status.done:
            self._has_summary = True
            ui.timer(0.0, self._sum_up, once=True)

    def _in_words(self, job: SeenJob) -> str:
        page, status = self._page, job.status
        if status is None:
            return page.text(WORDS[job.state])
        words = page.words(
            "{done} of {all} inputs: {failed} failed, {not_well} not all well.",
            done=status.done,
            all=status.inputs,
            failed=status.failed,
            not_well=status.not_well,
        )
        left = status.seconds_left
        if job.state == "running" and left is not None:
            words += " " + page.words(
                "{rate} inputs a second, {left} left.", rate=f"{status.rate:.3g}", left=length_of_time(left)
            )
        return words

    def _take_limits(self, name: str) -> None:
        self._limits = name
        ui.timer(0.0, self._sum_up, once=True)

    async def _cancel_job(self) -> None:
        await self._page.bench.beside.done(partial(self._fleet.cancel, self.name))
        self._page.notify(self._page.words("It ends after the tasks that are under way."), "idle")

    async def _sum_up(self) -> None:
        page = self._page
        self._doing.show(page.words("Summing up …"))
        try:
            limits = page.bench.chosen_file(self._limits) if self._limits else None
            summary = await page.bench.beside.done(partial(self._fleet.summary, self.name, limits))
        except TumbleError as error:
            self._doing.show("")
            page.notify(page.text(message(str(error))))
            return
        self._doing.show("")
        self._tables.clear()
        with self._tables:
            for table in self._fleet.tables(summary):
                rest = page.words("on the page")
                show_table(page, page.words(table.title), table.columns, table.rows, rest)
            with block("file-links"):
                query = f"?{urlencode({'limits': self._limits})}" if self._limits else ""
                file_link(page.words("Page of the fleet"), f"/fleets/{quote(self.name)}{query}", "file-link")


def fleet_page(bench: Bench, job: str, limits: str) -> str:
    """Returns the page of a fleet as HTML; raises `TumbleError` where a file or a result cannot be read."""
    fleet = bench.fleet()
    return fleet.page(fleet.summary(job, bench.chosen_file(limits) if limits else None))


def show_fleet(page: PageContext) -> FleetScreen:
    """Builds the screen."""
    return FleetScreen(page)
