"""Bytes that wait to be sent to a browser that only looks: so many, and no more.

The libraries keep all that a browser does not take. A page that was gone for a while is sent again what it
missed, which takes time, and is charged.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import core
from nicegui.client import Client

from tumble.bench.access import Browser
from tumble.bench.browser_socket import ABORT
from tumble.bench.gate import BROWSER
from tumble.bench.guest_work import charge
from tumble.foundation.numbers import whole_number

SCOPE = "asgi.scope"
"""Key of the scope of a socket in its environment."""
MOST_WAITING = 4 << 20
"""Bytes that wait for a socket: forty screens. A browser over a line of 1 MB/s takes them in 4 s."""
MOST_SENT_AGAIN = 200
"""Messages that a page which comes back is sent again: those of twice 5 s, at twenty looks a second."""
TIME_OF_A_MESSAGE = 0.5e-3
"""s of a processor to send a message again, as a thousand of them were measured."""


def close_slow_sockets(operates: Callable[[str], bool]) -> None:
    """Closes each socket for which too much waits, but those of whoever holds the bench."""
    for key, each in list(core.sio.eio.sockets.items()):
        scope = (core.sio.environ.get(key) or {}).get(SCOPE) or {}
        browser, abort = scope.get(BROWSER), scope.get(ABORT)
        if abort is None or not isinstance(browser, Browser) or operates(browser.key):
            continue
        if _waiting(each.queue) > MOST_WAITING:
            abort()


def charge_what_is_sent_again(page: object, wanted: object) -> None:
    """Charges the guest who acts for what a page is sent again from message `wanted` on."""
    client = Client.instances.get(page) if isinstance(page, str) else None
    number = whole_number(str(wanted))
    if client is None or number is None:
        return
    count, kept = client.outbox.next_message_id - number, len(client.outbox.message_history)
    charge(TIME_OF_A_MESSAGE * (count if 0 <= count <= kept else kept))


def _waiting(queue: Any) -> int:  # noqa: ANN401 - a queue of packets, of a library without types
    waiting = (each.data for each in queue._queue if each is not None)
    return sum(len(each) for each in waiting if isinstance(each, str | bytes))
