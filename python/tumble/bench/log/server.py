"""A page on this computer: loopback only, with a token, for one browser's user."""

from __future__ import annotations

import secrets
import socket
import threading
import webbrowser
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any, Final, TypeAlias
from urllib.parse import parse_qs

import uvicorn
from fastapi import APIRouter, FastAPI
from nicegui import app, ui

from tumble.foundation.errors import TumbleError

HOST: Final = "127.0.0.1"
_Scope: TypeAlias = MutableMapping[str, Any]
_Receive: TypeAlias = Callable[[], Awaitable[MutableMapping[str, Any]]]
_Send: TypeAlias = Callable[[MutableMapping[str, Any]], Awaitable[None]]
_App: TypeAlias = Callable[[_Scope, _Receive, _Send], Awaitable[None]]


class Guard:
    """Lets in who came with the token; refuses names of other hosts, and pages of other origins."""

    def __init__(self, app: _App, port: int, token: str) -> None:
        self._app = app
        self._token = token
        self._hosts = {f"{host}:{port}" for host in (HOST, "localhost")}
        self._cookie = f"tumble_view_{port}"

    async def __call__(self, scope: _Scope, receive: _Receive, send: _Send) -> None:
        """Passes a request on, or answers it with a refusal."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        if not self._is_ours(headers):
            await _refuse(scope, send)
        elif self._may_enter(headers.get("cookie", "")):
            await self._app(scope, receive, send)
        elif scope["type"] == "http" and self._knows(scope["query_string"]):
            cookie = f"{self._cookie}={self._token}; HttpOnly; SameSite=Strict; Path=/"
            moved = [(b"location", scope["path"].encode()), (b"set-cookie", cookie.encode())]
            await send({"type": "http.response.start", "status": 303, "headers": moved})
            await send({"type": "http.response.body", "body": b""})
        else:
            await _refuse(scope, send)

    def _is_ours(self, headers: dict[str, str]) -> bool:
        origin = headers.get("origin")
        from_here = origin is None or origin.removeprefix("http://") in self._hosts
        return headers.get("host") in self._hosts and from_here

    def _may_enter(self, cookies: str) -> bool:
        try:
            found = SimpleCookie(cookies).get(self._cookie)
        except CookieError:
            return False
        return found is not None and secrets.compare_digest(found.value.encode(), self._token.encode())

    def _knows(self, query: bytes) -> bool:
        given = parse_qs(query.decode("latin-1")).get("token", [""])[0]
        return secrets.compare_digest(given.encode(), self._token.encode())


async def _refuse(scope: _Scope, send: _Send) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})
        return
    head = [(b"content-type", b"text/plain; charset=utf-8")]
    await send({"type": "http.response.start", "status": 403, "headers": head})
    await send({"type": "http.response.body", "body": b"Open the address that tumble printed.\n"})


class PageServer:
    """Serves one page until it is stopped, and does the work behind it on a thread of its own."""

    def __init__(
        self,
        title: str,
        build: Callable[[], None],
        routers: Iterable[APIRouter],
        port: int,
        work: Callable[[], None],
    ) -> None:
        self._socket = _listening(port)
        found = int(self._socket.getsockname()[1])
        token = secrets.token_urlsafe(16)
        self.address = f"http://{HOST}:{found}/?token={token}"
        """Address to open, with the token."""
        pages = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
        for router in routers:
            pages.include_router(router)
        ui.run_with(pages, root=build, title=title, dark=None, language="en-US", show_welcome_message=False)
        # While it starts, NiceGUI looks through all objects of the process, also tuples that are being
        # filled; CPython then fails to fill them. So no other thread works before that.
        app.on_startup(threading.Thread(target=work, daemon=True).start)
        guarded: Any = Guard(pages, found, token)
        # Browsers close sockets late; nothing here needs a goodbye.
        self._server = uvicorn.Server(
            uvicorn.Config(guarded, log_level="error", ws_ping_interval=20.0, timeout_graceful_shutdown=1)
        )

    def run(self, *, opens_browser: bool) -> None:
        """Serves until Ctrl-C."""
        if opens_browser:
            threading.Thread(target=webbrowser.open, args=(self.address,), daemon=True).start()
        self._server.run(sockets=[self._socket])


def _listening(port: int) -> socket.socket:
    """Listens at a port of this computer, any free one for 0; raises `TumbleError` where it is taken."""
    found = socket.socket()
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        found.bind((HOST, port))
        found.listen()
    except (OSError, OverflowError) as error:
        found.close()
        raise TumbleError(
            f"--port {port}: cannot be used ({error}); give another, or leave it out"
        ) from error
    return found
