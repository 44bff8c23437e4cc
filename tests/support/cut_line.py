"""A line to a server that is cut while in use, and refused for a while: a cable, a server that restarts."""

from __future__ import annotations

import re
import socket
import struct
import threading
from contextlib import contextmanager, suppress

ABORTIVE = struct.pack("ii", 1, 0)
"""Option of a socket that is reset when it is closed."""
_PLACE = re.compile(r"127\.0\.0\.1::(\d+)")


class CutLine:
    """Passes lines on to a server until it is cut."""

    def __init__(self, port, listening):
        self._port = port
        self._listening = listening
        self._open = []
        self._refused = 0

    def cut(self, refused):
        """Resets all lines, and so many more that are opened after it."""
        self._refused = refused
        for line in self._open:
            _reset(line)
        self._open.clear()

    def serve(self):
        """Accepts lines until the socket is closed."""
        with suppress(OSError):
            while True:
                line = self._listening.accept()[0]
                if self._refused > 0:
                    self._refused -= 1
                    _reset(line)
                    continue
                server = socket.create_connection(("127.0.0.1", self._port))
                self._open += [line, server]
                for source, sink in ((line, server), (server, line)):
                    threading.Thread(target=_pass_on, args=(source, sink), daemon=True).start()


def _reset(line):
    with suppress(OSError):
        line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, ABORTIVE)
        line.shutdown(socket.SHUT_RDWR)
    line.close()


def _pass_on(source, sink):
    with suppress(OSError):
        while data := source.recv(4096):
            sink.sendall(data)
    for line in (source, sink):
        with suppress(OSError):
            line.shutdown(socket.SHUT_RDWR)


@contextmanager
def cut_line(address):
    """Gives an address that leads to a table at another one, and the line between them."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        line = CutLine(int(_PLACE.search(address)[1]), listening)
        threading.Thread(target=line.serve, daemon=True).start()
        yield _PLACE.sub(f"127.0.0.1::{listening.getsockname()[1]}", address), line
        listening.shutdown(socket.SHUT_RDWR)
