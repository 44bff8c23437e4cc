"""Messages of browsers on their sockets: each is about a page of the browser that sends it, or is dropped.

Browsers of this page send no other ones. A malformed message is counted, and leaves no traceback.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Awaitable, Callable
from inspect import isawaitable
from traceback import extract_tb
from typing import Any
from urllib.parse import parse_qs

from nicegui import core
from nicegui.client import Client
from socketio import packet  # type: ignore[import-untyped]
from socketio.exceptions import ConnectionRefusedError as Refusal  # type: ignore[import-untyped]

from tumble.bench.access import Browser
from tumble.bench.backlog import SCOPE, charge_what_is_sent_again
from tumble.bench.gate import BROWSER
from tumble.bench.guest_work import charge_step
from tumble.bench.lateness import SENT, measured

_LOGGERS = ("nicegui", "engineio.server", "socketio.server", "asyncio", "uvicorn.error")
"""Loggers of the libraries that serve the page, which trace each failure."""
_UNCHECKED = ("disconnect",)
_log = logging.getLogger(__name__)
Handler = Callable[..., Any]


class Dropped:
    """Messages that were dropped, and failures of handlers of messages, by kind."""

    def __init__(self) -> None:
        self.kinds: Counter[str] = Counter()

    @property
    def count(self) -> int:
        """Number of all of them."""
        return self.kinds.total()

    def add(self, kind: str, error: BaseException | None = None) -> None:
        """Counts one; the first failure of a kind is one line, and its traceback is for `--debug`."""
        name = kind if error is None else f"{kind}: {type(error).__name__}{_place(error)}"
        self.kinds[name] += 1
        if self.kinds[name] == 1:
            _log.log(logging.DEBUG if error is None else logging.WARNING, "%s", name)
            _log.debug("%s", name, exc_info=error)


class _CountedFailures(logging.Handler):
    """Counts failures that libraries would trace, and passes on nothing of their text, which is foreign."""

    def __init__(self, dropped: Dropped) -> None:
        super().__init__(logging.WARNING)
        self._dropped = dropped

    def emit(self, record: logging.LogRecord) -> None:
        """Counts a record of a failure; remarks of libraries on their own state are for `--debug`."""
        if record.exc_info and record.exc_info[1] is not None:
            self._dropped.add(record.name, record.exc_info[1])
        else:
            _log.debug("%s: %s", record.name, record.getMessage())


class TextPacket(packet.Packet):  # type: ignore[misc]
    """Packet of Socket.IO that takes no attachments: the server would keep as many as are announced."""

    def decode(self, encoded_packet: object) -> None:
        """Reads a packet of one text; raises `ValueError` for any other, which no page sends."""
        if not isinstance(encoded_packet, str) or super().decode(encoded_packet):
            raise ValueError("attachment")
        if self.packet_type in (packet.BINARY_EVENT, packet.BINARY_ACK):
            raise ValueError("packet with attachments")


def guard_messages(dropped: Dropped) -> None:
    """Has each message checked before NiceGUI takes it, and failures counted; once a process."""
    core.sio.packet_class = TextPacket
    handlers: dict[str, Handler] = core.sio.handlers["/"]
    for name, handler in handlers.items():
        if name not in _UNCHECKED:
            is_begin = name == "handshake"
            handlers[name] = (
                _checked_connect(handler) if name == "connect" else _checked(handler, dropped, is_begin)
            )
    # Lines of a log are for programs that run on this computer, not for whoever may look at a page.
    handlers["log"] = _refused(dropped)
    for name in _LOGGERS:
        logger = logging.getLogger(name)
        logger.handlers, logger.propagate = [_CountedFailures(dropped)], False


def _checked(handler: Handler, dropped: Dropped, is_begin: bool) -> Callable[..., Awaitable[object]]:
    async def checked(sid: str, *given: Any) -> object:  # noqa: ANN401 - whatever a browser sends
        charge_step()
        client = given[0].get("client_id") if len(given) == 1 and isinstance(given[0], dict) else None
        if not _is_own(client, core.sio.get_environ(sid)):
            dropped.add("message of no own page")
            return False
        if is_begin:
            charge_what_is_sent_again(client, given[0].get("next_message_id"))
        try:
            with measured(Client.instances[str(client)], given[0].get(SENT)):
                answer = handler(sid, given[0])
                return await answer if isawaitable(answer) else answer
        except Exception as error:
            dropped.add("malformed message", error)
            return False

    return checked


def _checked_connect(handler: Handler) -> Callable[..., Awaitable[object]]:
    async def checked(sid: str, environ: dict[str, Any], auth: object = None) -> object:
        charge_step()
        query = parse_qs(environ.get("QUERY_STRING", ""))
        named = query.get("client_id", [])
        if not all(_is_own(client, environ) for client in named):
            raise Refusal
        for client in named:
            charge_what_is_sent_again(client, query.get("next_message_id", [""])[0])
        return await handler(sid, environ, auth)

    return checked


def _refused(dropped: Dropped) -> Callable[..., Awaitable[None]]:
    async def refused(_sid: str, *_given: object) -> None:
        dropped.add("line for the log")

    return refused


def _is_own(client: object, environ: dict[str, Any] | None) -> bool:
    """Returns whether a page is known, and was made for the browser of a socket."""
    page = Client.instances.get(client) if isinstance(client, str) else None
    browser = ((environ or {}).get(SCOPE) or {}).get(BROWSER)
    if page is None or not isinstance(browser, Browser):
        return False
    return page.request.scope.get(BROWSER) is browser


def _place(error: BaseException) -> str:
    frames = extract_tb(error.__traceback__)
    return f" at {frames[-1].name}:{frames[-1].lineno}" if frames else ""
