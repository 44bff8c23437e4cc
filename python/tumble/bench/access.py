"""Access to the bench: tokens, browsers that only look, and the one that holds it."""

from __future__ import annotations

import secrets
import threading
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from tumble.foundation import clock

BROWSER_GONE = 2.0
"""s without a sign of life of the operator's browser, after which a table is stopped."""
HOLDS_FOR = 30.0
"""s without a sign of life, after which another may take the bench without asking."""
MOST_BROWSERS = 1000
"""Browsers that are known at once; of more, viewers are forgotten first, the longest silent ones of them."""
COOKIE = "tumble_bench"

Rank: TypeAlias = Literal["operator", "viewer"]
"""Right of a browser: to hold the bench, or only to look."""


@dataclass(slots=True, eq=False)
class Browser:
    """One browser that has entered, known by its cookie."""

    key: str
    rank: Rank
    address: str
    number: int
    """From 1 on, by which people name it."""
    seen: float = field(default_factory=clock.now)
    """s of its last sign of life."""
    has_lived: bool = False
    """Indicates whether it ever gave one after it entered."""


class Access:
    """Tokens, browsers, and the one that operates; may be used from any thread.

    Without tokens whoever reaches the page may operate: it is served on this computer only.
    """

    def __init__(self, *, needs_token: bool, cookie: str = COOKIE) -> None:
        self.cookie = cookie
        """Name of the cookie of operators, which browsers keep for all ports of a computer."""
        self.token = secrets.token_urlsafe(16) if needs_token else ""
        """Token of those who may operate."""
        self.viewer_token = secrets.token_urlsafe(16) if needs_token else ""
        """Token of those who only look."""
        self._browsers: dict[str, Browser] = {}
        self.tenure = 0
        """Number of the tenure: another one begins where the bench changes hands, or its holder was gone."""
        self._is_attended = False
        self._operator = ""
        self._asks = ""
        self._lock = threading.Lock()
        self._number = 0

    @property
    def cookies(self) -> tuple[str, str]:
        """Names of the cookies of operators and of viewers: a link for viewers replaces no operator's."""
        return self.cookie_of("operator"), self.cookie_of("viewer")

    def cookie_of(self, rank: Rank) -> str:
        """Returns the name of the cookie of browsers of a rank."""
        return self.cookie if rank == "operator" else f"{self.cookie}_{rank}"

    def enter(self, token: str, address: str) -> Browser | None:
        """Lets a browser in by a token; returns None where the token is wrong."""
        rank = self._rank(token)
        if rank is None:
            return None
        with self._lock:
            self._number += 1
            browser = Browser(secrets.token_urlsafe(24), rank, address, self._number)
            self._browsers[browser.key] = browser
            self._forget(browser)
        return browser

    def rises(self, browser: Browser, token: str) -> bool:
        """Returns whether a browser that only looks shows the token of those who may operate."""
        return browser.rank == "viewer" and self._rank(token) == "operator"

    def known(self, keys: Iterable[str]) -> Browser | None:
        """Returns the browser of these cookies, whoever holds the bench first, then who may operate.

        None where nobody entered with any of them.
        """
        found = [browser for key in keys if (browser := self._browsers.get(key)) is not None]
        return max(found, key=lambda each: (self.operates(each.key), each.rank == "operator"), default=None)

    def beat(self, key: str) -> None:
        """Notes a sign of life; the first browser that may operate holds a bench that nobody holds."""
        browser = self._browsers.get(key)
        if browser is None:
            return
        with self._lock:
            if browser.rank == "operator" and not self.operates(key) and self.silent > HOLDS_FOR:
                self._hand_to(key)
            browser.seen, browser.has_lived = clock.now(), True
            self._is_attended |= self.operates(key)

    def operates(self, key: str) -> bool:
        """Returns whether a browser holds the bench."""
        return bool(key) and key == self._operator

    @property
    def operator(self) -> Browser | None:
        """The browser that holds the bench; None where none does."""
        return self._browsers.get(self._operator)

    @property
    def asking(self) -> Browser | None:
        """The browser that asks for the bench; None where none does."""
        return self._browsers.get(self._asks)

    @property
    def silent(self) -> float:
        """Returns for how long, s, the operator's browser has given no sign of life; infinite without one."""
        browser = self.operator
        return float("inf") if browser is None else clock.now() - browser.seen

    def ask(self, key: str) -> bool:
        """Asks for the bench; returns whether it was free, and is held now."""
        browser = self._browsers.get(key)
        if browser is None or browser.rank != "operator" or self.operates(key):
            return False
        with self._lock:
            if self.silent > HOLDS_FOR:
                self._hand_to(key)
                return True
            self._asks = key
        return False

    def hand_over(self, key: str, number: int) -> None:
        """Gives the bench to the browser of this number, if it asks; `key` is that of the operator."""
        with self._lock:
            asking = self.asking
            if self.operates(key) and asking is not None and asking.number == number:
                self._hand_to(self._asks)

    def keep(self, key: str) -> None:
        """Turns down the browser that asks; `key` is that of the operator."""
        with self._lock:
            if self.operates(key):
                self._asks = ""

    def note_absence(self) -> None:
        """Ends the tenure of an operator whose browser is gone: he may come back, and then begins another."""
        with self._lock:
            if self._is_attended:
                self._is_attended, self.tenure = False, self.tenure + 1

    def _hand_to(self, key: str) -> None:
        self._operator, self._asks = key, ""
        self._is_attended, self.tenure = True, self.tenure + 1

    def _rank(self, token: str) -> Rank | None:
        if not self.token:
            return "operator"
        if secrets.compare_digest(token.encode(), self.token.encode()):
            return "operator"
        return "viewer" if secrets.compare_digest(token.encode(), self.viewer_token.encode()) else None

    def _forget(self, entered: Browser) -> None:
        while len(self._browsers) > MOST_BROWSERS:
            kept = (self._operator, entered.key)
            others = (each for each in self._browsers.values() if each.key not in kept)
            # Viewers that enter again and again crowd out no operator, and signs of life cost them nothing.
            least = min(others, key=lambda each: (each.rank == "operator", each.has_lived, each.seen))
            del self._browsers[least.key]
