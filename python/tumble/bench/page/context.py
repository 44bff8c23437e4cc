"""One open page: whose it is, in which language, and what it may do."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from functools import partial
from inspect import isawaitable
from typing import Any, Protocol

from nicegui import ui
from nicegui.client import Client
from nicegui.element import Element

from tumble.bench.access import Browser
from tumble.bench.authority import NotOperatorError, refuse_unless_allowed
from tumble.bench.bench import Bench
from tumble.bench.lateness import is_late
from tumble.bench.parts.elements import block, set_attribute
from tumble.foundation.errors import TumbleError
from tumble.foundation.message import Message, message
from tumble.foundation.translation import speaking, translated

Act = Callable[[], object]


class Screen(Protocol):
    """One screen, as long as it is shown."""

    def update(self) -> None:
        """Shows what has changed; called many times a second, so it does little where nothing has."""


class PageContext:
    """One open page of one browser."""

    def __init__(self, bench: Bench, browser: Browser, language: str, client: Client) -> None:
        self.bench = bench
        self.browser = browser
        self.language = language
        self.client = client
        self.screen: Screen | None = None
        self._primary: Act | None = None
        self._keys: Element | None = None
        self._shown = 0
        self.scan: Callable[[str], object] | None = None
        """Takes a scanned text on this screen; None where a scanner does nothing."""

    @property
    def primary(self) -> Act | None:
        """Act of space, Enter and the pedal on this screen; None for nothing."""
        return self._primary

    @primary.setter
    def primary(self, act: Act | None) -> None:
        """Gives the keys another act; the page sends with each key the number of the one that it shows."""
        self._primary = act
        self._shown += 1
        if self._keys is not None:
            set_attribute(self._keys, "data-shown", str(self._shown))

    def add_keys(self) -> None:
        """Adds the element that holds the number, which changes in the browser together with the screen."""
        self._keys = block("keys", id="keys", data_shown="0")

    def shows(self, number: object) -> bool:
        """Returns whether a key was pressed while the page showed what it shows now."""
        return number == self._shown

    @property
    def operates(self) -> bool:
        """Returns whether this browser holds the bench."""
        return self.bench.access.operates(self.browser.key)

    def text(self, what: Message) -> str:
        """Returns a message in the language of the page."""
        with speaking(self.language):
            return self._translated(what)

    def words(self, text: str, /, **values: str | int | float) -> str:
        """Returns a text in the language of the page; for labels of screens."""
        return self.text(message(text, **values))

    def guarded(self, act: Act) -> Act:
        """Wraps what changes the bench: a refusal, as to those who do not hold it, is shown in one line.

        An act that takes long is awaitable, and goes on beside the page.
        """
        return partial(self._do, act)

    def notify(self, text: str, kind: str = "bad") -> None:
        """Shows a line for a while."""
        with self.client.content:
            ui.notify(
                text, color=None, position="top", timeout=5000, classes=f"notice {kind}", multi_line=True
            )

    def tone(self, name: str) -> None:
        """Plays a tone: `held`, `part done`, `done`, `failed` or `warning`."""
        self.client.run_javascript(f"benchTone('{name}')")

    def go(self, target: str) -> None:
        """Shows another screen."""
        with self.client.content:
            ui.navigate.to(target)

    def _do(self, act: Act) -> Coroutine[Any, Any, None] | None:
        # The first act may come before the first beat of the page.
        self.bench.access.beat(self.browser.key)
        if is_late():
            self.notify(self.words("This came late, and nothing was done. Look, and press again."), "warn")
            return None
        try:
            refuse_unless_allowed()
            answer = act()
        except TumbleError as error:
            self._refused(error)
            return None
        return self._awaited(answer) if isawaitable(answer) else None

    async def _awaited(self, answer: Awaitable[object]) -> None:
        try:
            await answer
        except TumbleError as error:
            self._refused(error)

    def _refused(self, error: TumbleError) -> None:
        if isinstance(error, NotOperatorError):
            self.notify(self.words(str(error)), "warn")
        else:
            self.notify(self.text(message(str(error))))

    def _translated(self, what: Message) -> str:
        values: dict[str, Any] = {
            name: self._translated(value) if isinstance(value, Message) else value
            for name, value in what.values.items()
        }
        return translated(what.text, **values)
