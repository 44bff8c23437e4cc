"""A table that sends noise, as a line at another rate does, is refused at once, so that it is stopped."""

from __future__ import annotations

import itertools
import socket
import threading
from contextlib import suppress
from types import SimpleNamespace

import pytest

from tumble.foundation.errors import TableError
from tumble.tools.table import open_table, text

REPLIES = {
    "without an end": (itertools.repeat(b"x" * 65536), "sends 4096 bytes without an end"),
    "byte by byte": (itertools.repeat(b"x"), "bytes without an end"),
    "empty lines": (itertools.repeat(b"\n"), "replied ''"),
    "infinite": (itertools.repeat(b"1e999\n"), "is no angle"),
    "many digits": (itertools.repeat(b"9" * 400 + b"\n"), "is no angle"),
    "no text": (itertools.repeat(b"\xff\x00\x1b[31m\n"), "expected"),
}


@pytest.mark.parametrize("kind", REPLIES)
def test_a_line_of_noise_is_refused_at_once(kind, monkeypatch):
    replies, words = REPLIES[kind]
    if kind == "byte by byte":  # each of which would come just before the line is given up
        moments = itertools.count(0.0, 0.5)
        monkeypatch.setattr(text, "clock", SimpleNamespace(now=lambda: next(moments)))
    with socket.create_server(("127.0.0.1", 0)) as server:
        noise = threading.Thread(target=make_noise, args=(server, replies))
        noise.start()
        address = f"text:TCPIP::127.0.0.1::{server.getsockname()[1]}::SOCKET?profile=scpi"
        with pytest.raises(TableError, match=words), open_table(address) as table:
            table.position()
        noise.join()


def make_noise(server, replies):
    """Sends to whoever connects first until that goes away."""
    line, _ = server.accept()
    with line, suppress(OSError):
        for each in replies:
            line.sendall(each)
