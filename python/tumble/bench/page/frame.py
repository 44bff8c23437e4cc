"""The frame around all screens: names of the screens, who holds the bench, the stop, keys and tones."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

from nicegui import __version__, ui
from nicegui.client import Client
from nicegui.element import Element

from tumble.bench.bench import Bench
from tumble.bench.connecting import add_connecting
from tumble.bench.gate import BROWSER
from tumble.bench.guest_work import WORK_OF_A_PAGE, charge_step
from tumble.bench.page.banner import Banner
from tumble.bench.page.context import PageContext, Screen
from tumble.bench.page.fleet import show_fleet
from tumble.bench.page.kind import KindScreen
from tumble.bench.page.log import show_log
from tumble.bench.page.result import show_result
from tumble.bench.page.run import show_run
from tumble.bench.page.sources import show_sources
from tumble.bench.page.units import show_units
from tumble.bench.parts.elements import Label, block, button, link, set_attribute, set_class
from tumble.foundation.translation import accepted_language

MOST_UNOPENED = 64
"""Pages that wait for their browsers, or for these to come back; each takes half a megabyte."""
BETWEEN_UPDATES = 0.05
"""s between two looks whether there is anything new to show."""
NamedScreen: TypeAlias = tuple[str, str, Callable[[PageContext], Screen]]
"""Path, name and builder of a screen."""
SCREENS: tuple[NamedScreen, ...] = (
    ("/", "Sources", show_sources),
    ("/run", "Run", show_run),
    ("/result", "Result", show_result),
    ("/units", "Units", show_units),
    ("/log", "Log", show_log),
    ("/fleet", "Fleet", show_fleet),
)
"""All screens; kinds of runs with a screen of their own come behind `Run`."""
BEHIND = 2
"""Place of those."""
FOLLOWS = {"running": "/run", "paused": "/run", "calibrating": "/run", "error": "/run", "result": "/result"}
"""Screen to which pages go that follow a run, by the state of the engine."""
FOLLOWERS = ("/", "/run", "/result")
HEAD = f"""
<link rel="modulepreload" href="/_nicegui/{__version__}/static/dompurify.mjs">
<link rel="stylesheet" href="/bench/bench.css">
<link rel="stylesheet" href="/bench/figures.css">
<script src="/bench/bench.js" defer></script>
"""
TONES = {"held": "held", "part done": "part done", "warning": "warning", "ended early": "failed"}


def show_page(bench: Bench) -> None:
    """Builds the page for the browser that asks."""
    charge_step(WORK_OF_A_PAGE)
    client = ui.context.client
    _forget_unopened(bench)
    request = client.request
    language = accepted_language(request.headers.get("accept-language", ""))
    page = PageContext(bench, request.scope[BROWSER], language, client)
    ui.add_head_html(HEAD)
    add_connecting(page.words("Connecting …"))
    PageFrame(page, request.url.path)


def _forget_unopened(bench: Bench) -> None:
    """Deletes the oldest pages that were built and not opened, but those of whoever holds the bench."""
    unopened = [
        each
        for each in Client.instances.values()
        if not each.has_socket_connection and not bench.access.operates(each.request.scope[BROWSER].key)
    ]
    for each in unopened[:-MOST_UNOPENED]:
        each.delete()


class PageFrame:
    """The frame of one page."""

    def __init__(self, page: PageContext, path: str) -> None:
        self._page = page
        self._path = path
        own = [
            (f"/{kind.word}", page.text(kind.title), kind.word)
            for kind in page.bench.kinds
            if kind.has_screen
        ]
        self._own = {path: word for path, _, word in own}
        """Words of the kinds of runs that have a screen, by its path."""
        kinds: list[NamedScreen] = [(path, name, partial(KindScreen, word=word)) for path, name, word in own]
        self._screens = (*SCREENS[:BEHIND], *kinds, *SCREENS[BEHIND:])
        self._state = page.bench.engine.state
        self._noted = page.bench.engine.notes[-1].number if page.bench.engine.notes else 0
        self._links: dict[str, Element] = {}
        page.add_keys()
        self._header()
        with block("banners", role="status"):
            self._banner = Banner(page)
        with block("screen", id="screen"):
            ui.sub_pages({path: partial(self._show, path, build) for path, _, build in self._screens})
        self._stop_bar()
        self._listen()
        ui.timer(BETWEEN_UPDATES, self._update)

    def _header(self) -> None:
        page = self._page
        with block("head", "header"):
            with block("brand"):
                block("brand-mark", aria_hidden="true")
                Label("Tumble", "brand-name")
            with block("screens", "nav", aria_label=page.words("Screens")):
                for path, name, _ in self._screens:
                    self._links[path] = link(page.words(name), path, "screen-link")
            with block("head-end"):
                self._held = Label("", "holder")
                self._ask = button(page.words("Ask for the bench"), self._ask_for_it, "small")
                button("◐", self._switch_dark, "icon", label=page.words("Light or dark"))
                button("♪", self._mute, "icon", label=page.words("Tones on or off"))
        self._update_holder()
        self._dark = ui.dark_mode(value=None)

    def _stop_bar(self) -> None:
        self._stop = block("stop-bar")
        with self._stop:
            button(self._page.words("Stop"), self._stop_now, "stop")
            Label(self._page.words("or Escape"), "stop-key")

    def _listen(self) -> None:
        page = self._page
        ui.on("bench_stop", lambda _: self._stop_now())
        ui.on("bench_go", lambda event: self._on_keys(event.args, lambda _: self._go()))
        ui.on("bench_scan", lambda event: self._on_keys(event.args, self._scan))
        ui.run_javascript(f"document.documentElement.lang = '{page.language}'")
        ui.run_javascript(f"document.body.dataset.pedal = '{_letters(page.bench.settings.pedal)}'")

    def _show(self, path: str, build: Callable[[PageContext], Screen]) -> None:
        page = self._page
        page.primary = page.scan = None
        self._path = path
        page.screen = build(page)
        page.screen.update()
        for each, element in self._links.items():
            set_attribute(element, "aria-current", "page" if each == path else None)

    def _update(self) -> None:
        page, engine = self._page, self._page.bench.engine
        self._update_holder()
        self._banner.update()
        set_class(self._stop, "shown", engine.state == "running")
        set_class(self._stop, "armed", engine.moves_table)
        self._play_notes()
        if engine.state != self._state:
            self._state = engine.state
            self._follow()
        elif page.screen is not None:
            page.screen.update()

    def _update_holder(self) -> None:
        page = self._page
        access = page.bench.access
        if page.operates:
            text = page.words("You hold the bench")
        elif access.operator is None:
            text = page.words("Nobody holds the bench")
        else:
            text = page.words("Browser {number} holds the bench", number=access.operator.number)
        self._held.show(text)
        set_class(self._held, "mine", page.operates)
        set_class(self._ask, "hidden", page.operates or page.browser.rank != "operator")

    def _play_notes(self) -> None:
        for note in list(self._page.bench.engine.notes):
            if note.number > self._noted:
                self._noted = note.number
                if tone := TONES.get(note.kind):
                    self._page.tone(tone)

    def _follow(self) -> None:
        page, engine = self._page, self._page.bench.engine
        if engine.state == "result" and engine.outcome is not None:
            page.tone("done" if engine.outcome.verdict in ("passed", "warned") else "failed")
        elif engine.state == "error":
            page.tone("failed")
        target = FOLLOWS.get(engine.state, self._path)
        follows = self._path in FOLLOWERS or (self._path in self._own and target == "/result")
        if follows and target != self._path:
            page.go(target)
        elif page.screen is not None:
            page.screen.update()

    def _on_keys(self, sent: object, act: Callable[[str], object]) -> object:
        """Acts on keys, unless the page has shown something else since they were pressed."""
        number, text = sent if isinstance(sent, list) and len(sent) == 2 else (None, None)
        return act(str(text)[:200]) if self._page.shows(number) else None

    def _go(self) -> object:
        act = self._page.primary
        return None if act is None else self._page.guarded(act)()

    def _scan(self, text: str) -> object:
        take = self._page.scan
        return None if take is None else self._page.guarded(partial(take, text))()

    def _stop_now(self) -> None:
        """Stops what runs; whoever may operate may stop, whether the bench is theirs or not."""
        self._page.bench.stop(self._page.browser)

    def _ask_for_it(self) -> None:
        page = self._page
        if page.bench.access.ask(page.browser.key):
            return
        page.notify(page.words("Asked for; whoever holds the bench decides."), "idle")

    def _switch_dark(self) -> None:
        """Goes from the setting of the system to dark, to light, and back."""
        following: dict[bool | None, bool | None] = {None: True, True: False, False: None}
        self._dark.value = following[self._dark.value]

    def _mute(self) -> None:
        ui.run_javascript("benchMute()")


def _letters(text: str) -> str:
    return "".join(each for each in text if each.isalnum())
