"""The gate before every request: who asks, from which page, and how much at once.

Only browsers that entered reach the pages; nothing from another origin does, whatever it carries. Answers
forbid scripts of others, frames and guesses of types (https://www.w3.org/TR/CSP3).
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from functools import partial
from html import escape
from typing import Any, TypeAlias
from urllib.parse import parse_qs, urlencode, urlsplit

from tumble.bench.access import Access, Browser
from tumble.bench.authority import acting
from tumble.bench.cookies import cookie_values
from tumble.bench.guest_work import (
    MOST_WORK_OF_MESSAGES,
    WORK_OF_A_MESSAGE,
    WORK_OF_A_PAGE,
    GuestWork,
    charged_to,
)
from tumble.bench.settings import LOOPBACK, BenchSettings
from tumble.foundation.numbers import whole_number

Scope: TypeAlias = MutableMapping[str, Any]
Receive: TypeAlias = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send: TypeAlias = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application: TypeAlias = Callable[[Scope, Receive, Send], Awaitable[None]]

MOST_SOCKETS = 64
"""Sockets that are open at once."""
MOST_SOCKETS_OF_ONE = 16
"""Sockets of one browser, and of all browsers of one computer that only look; as many are always left for the
browser that holds the bench."""
LARGEST_BODY = 1 << 16
"""Bytes of a request."""
LARGEST_MESSAGE = 1 << 18
"""Bytes of a message on a socket."""
BROWSER = "tumble.browser"
"""Key of the browser in the scope of a request that passed."""
BEAT = "/beat"
"""Path of the signs of life of a browser."""
_SOCKETS = "/_nicegui_ws/"
_SCRIPT = re.compile(rb"<script(?=[ >])")
_PUBLIC = ("/favicon.ico",)
_FILES = ("/_nicegui/", "/bench/", "/tumble-log/")
"""Paths of files as they are, and of samples; all else is built."""
_METHODS = ("GET", "HEAD", "POST")
REPORTS = ("/runs/", "/history/", "/certificates/", "/fleets/", "/compared/", "/made-here/")
"""Paths of files that were written before; a page among them has an origin of its own, and no cookies."""
REPORT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src 'unsafe-inline'; "
    "sandbox allow-scripts allow-popups"
)

ANSWER_POLICY = "default-src 'none'; frame-ancestors 'none'"


class Gate:
    """Stands before an application; see the module."""

    def __init__(
        self,
        application: Application,
        access: Access,
        settings: BenchSettings,
        note_known: Callable[[tuple[str, int], str], None] = lambda _client, _key: None,
    ) -> None:
        self.app = application
        self._note_known = note_known
        """Notes the other end of a line that a known browser uses, and the key of the browser."""
        self._access = access
        self._settings = settings
        self._sockets: list[Browser] = []
        """Browser of each open socket."""
        self._guests = GuestWork()
        self._messages = GuestWork(MOST_WORK_OF_MESSAGES)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serves one request, or refuses it."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._socket(scope, receive, send)
        else:
            await self._request(scope, receive, send)

    async def _socket(self, scope: Scope, receive: Receive, send: Send) -> None:
        browser = self._browser(scope)
        if browser is None or not self._is_ours(scope, needs_origin=True) or not self._has_room(browser):
            await receive()
            await send({"type": "websocket.close", "code": 1008})
            return
        self._sockets.append(browser)
        scope[BROWSER] = browser
        try:
            with acting(partial(self._access.operates, browser.key)), charged_to(self._messages):
                await self.app(scope, partial(self._message, browser, receive), send)
        finally:
            self._sockets.remove(browser)

    async def _message(self, browser: Browser, receive: Receive) -> MutableMapping[str, Any]:
        """Receives a message; those of guests wait, unread, until there is time for them."""
        message = await receive()
        size = len(message.get("text") or message.get("bytes") or "")
        if size and not self._access.operates(browser.key):
            await self._messages.begin(_group(browser), 1 + size // WORK_OF_A_MESSAGE)
        return message

    async def _request(self, scope: Scope, receive: Receive, send: Send) -> None:
        method, path = scope["method"], scope["path"]
        if not self._is_ours(scope, needs_origin=method == "POST") or method not in _METHODS:
            await _answer(send, 403, "This page can be reached from itself only.")
        elif path.startswith(_SOCKETS):
            await _answer(send, 403, "Sockets only.")
        elif _length(scope) > LARGEST_BODY:
            await _answer(send, 413, "Too large.")
        elif path in _PUBLIC:
            await self.app(scope, receive, send)
        elif (browser := self._browser(scope)) and not self._access.rises(browser, _token(scope)):
            if path == BEAT and method == "POST":
                self._access.beat(browser.key)
                await _answer(send, 204, "")
                return
            scope[BROWSER] = browser
            if not self._access.operates(browser.key):
                await self._guests.begin(_group(browser), 1 if path.startswith(_FILES) else WORK_OF_A_PAGE)
            with acting(partial(self._access.operates, browser.key)), charged_to(self._guests):
                await self.app(scope, receive, _Guarded(send, is_report=path.startswith(REPORTS)))
        else:
            await self._enter(scope, send)

    async def _enter(self, scope: Scope, send: Send) -> None:
        """Lets a browser in that shows the token, or whoever is on this computer."""
        token, path = _token(scope), scope["path"]
        path = path if path.startswith("/") and not path.startswith("//") else "/"
        if _header(scope, b"sec-fetch-site") == "cross-site":
            # The cookie was kept back: without another one the browser stays who it is.
            await _lead_on(send, f"{path}?{urlencode({'token': token})}" if token else path)
            return
        client = scope.get("client") or ("",)
        browser = self._access.enter(token, str(client[0]))
        if browser is None:
            await _answer(
                send, 403, "No entry without the token: use the link or the QR code of the terminal."
            )
            return
        await _lead_on(send, path, self._cookie(browser))

    def _cookie(self, browser: Browser) -> tuple[bytes, bytes]:
        secure = "; Secure" if self._settings.certificate is not None else ""
        name = self._access.cookie_of(browser.rank)
        content = f"{name}={browser.key}; Path=/; HttpOnly; SameSite=Strict{secure}"
        return b"set-cookie", content.encode()

    def _browser(self, scope: Scope) -> Browser | None:
        given = [value for key, value in scope["headers"] if key.lower() == b"cookie"]
        keys = (
            each for value in given for name in self._access.cookies for each in cookie_values(value, name)
        )
        browser = self._access.known(keys)
        if browser is not None:
            self._note_known(tuple(scope.get("client") or ("", 0)), browser.key)
        return browser

    def _is_ours(self, scope: Scope, *, needs_origin: bool) -> bool:
        """Returns whether a request names this server, and comes from its own pages."""
        host, origin = _header(scope, b"host"), _header(scope, b"origin")
        if self._settings.is_local and _hostname(host) not in LOOPBACK:
            return False
        if not origin:
            return not needs_origin
        return origin.lower() == f"{self._settings.scheme}://{host}".lower()

    def _has_room(self, browser: Browser) -> bool:
        """Returns whether a browser may have one more socket; whoever holds the bench always has room."""
        if self._sockets.count(browser) >= MOST_SOCKETS_OF_ONE:
            return False
        if self._access.operates(browser.key):
            return True
        others = [each for each in self._sockets if not self._access.operates(each.key)]
        beside = sum(each.rank == "viewer" and each.address == browser.address for each in others)
        is_crowd = browser.rank == "viewer" and beside >= MOST_SOCKETS_OF_ONE
        return len(others) < MOST_SOCKETS - MOST_SOCKETS_OF_ONE and not is_crowd


class _Guarded:
    """Sends answers with headers that forbid what no page of ours needs; scripts of ours get a number."""

    def __init__(self, send: Send, *, is_report: bool) -> None:
        self._send = send
        self._nonce = secrets.token_urlsafe(12)
        self._start: MutableMapping[str, Any] | None = None
        self._body = b""
        self._is_report = is_report

    async def __call__(self, message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            policy = REPORT_POLICY if self._is_report else _policy(self._nonce)
            message["headers"] = [*message.get("headers", []), *_headers(policy)]
            if _is_page(message["headers"]) and not self._is_report:
                self._start = message
                return
        elif self._start is not None and message["type"] == "http.response.body":
            self._body += message.get("body", b"")
            if message.get("more_body", False):
                return
            message = await self._page(self._start)
        await self._send(message)

    async def _page(self, start: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
        """Marks the scripts of a page as ours: text of others is escaped in it, and opens none."""
        body = _SCRIPT.sub(f'<script nonce="{self._nonce}"'.encode(), self._body)
        length = (b"content-length", str(len(body)).encode())
        start["headers"] = [*(each for each in start["headers"] if each[0].lower() != length[0]), length]
        self._start = None
        await self._send(start)
        return {"type": "http.response.body", "body": body}


def _group(browser: Browser) -> str:
    """Returns the group of guests that waits in one line: all that only look on one computer."""
    return browser.address if browser.rank == "viewer" else browser.key


def _policy(nonce: str) -> str:
    """Returns the policy of our pages; NiceGUI compiles components and styles in them."""
    return "; ".join(
        (
            "default-src 'none'",
            f"script-src 'self' 'nonce-{nonce}' 'unsafe-eval'",
            "style-src 'self' 'unsafe-inline'",
            "img-src 'self' data: blob:",
            "font-src 'self' data:",
            "connect-src 'self'",
            "worker-src 'self'",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        )
    )


def _headers(policy: str) -> list[tuple[bytes, bytes]]:
    return [
        (b"content-security-policy", policy.encode()),
        (b"x-content-type-options", b"nosniff"),
        (b"referrer-policy", b"no-referrer"),
        (b"cross-origin-opener-policy", b"same-origin"),
        (b"cross-origin-resource-policy", b"same-origin"),
    ]


async def _lead_on(send: Send, target: str, *headers: tuple[bytes, bytes]) -> None:
    """Answers with a page of our own that leads on: a way of another site carries no strict cookie."""
    refresh = f'<meta http-equiv="refresh" content="0;url={escape(target, quote=True)}">'
    page = f"<!doctype html><title>Tumble</title>{refresh}"
    await _answer(send, 200, page, "text/html; charset=utf-8", *headers)


async def _answer(
    send: Send, status: int, text: str, kind: str = "text/plain; charset=utf-8", *headers: tuple[bytes, bytes]
) -> None:
    content = text.encode()
    known = [(b"content-type", kind.encode())]
    if status != 204:
        known.append((b"content-length", str(len(content)).encode()))
    await send(
        {
            "type": "http.response.start",
            "status": status,
            "headers": [*known, (b"cache-control", b"no-store"), *_headers(ANSWER_POLICY), *headers],
        }
    )
    await send({"type": "http.response.body", "body": content})


def _header(scope: Scope, name: bytes) -> str:
    headers: Iterable[tuple[bytes, bytes]] = scope["headers"]
    return next((value.decode("latin-1") for key, value in headers if key.lower() == name), "")


def _token(scope: Scope) -> str:
    query: bytes = scope["query_string"]
    return parse_qs(query.decode("latin-1")).get("token", [""])[0]


def _length(scope: Scope) -> int:
    if text := _header(scope, b"content-length"):
        number = whole_number(text)
        return LARGEST_BODY + 1 if number is None else number
    return LARGEST_BODY + 1 if _header(scope, b"transfer-encoding") else 0


def _hostname(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _is_page(headers: Iterable[tuple[bytes, bytes]]) -> bool:
    return any(key.lower() == b"content-type" and value.startswith(b"text/html") for key, value in headers)
