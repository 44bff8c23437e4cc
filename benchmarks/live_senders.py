"""Units that send live: a line of text a sample, stamped by the clock that the receiver reads too.

Run as a program with what `serve` takes as JSON: it prints the addresses to listen to, sends when a line
comes on its standard input, and is there until that is closed.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import time
import tty
from collections.abc import Callable
from functools import partial
from typing import TypeAlias

from tumble.tools.simulate.live.ports import free_port

Send: TypeAlias = Callable[[bytes], object]

HEADER = b"time,ax,ay,az,gx_rad/s,gy_rad/s,gz_rad/s\n"
ROW = "%.9f,0.0132,-0.0071,9.7987,0.0031,-0.0012,0.0005\n"
"""Only its time counts here."""
NAMES_EVERY = 1000
"""Samples between two lines with the names of columns."""


def serve(over: str, units: int, rate: float, seconds: float) -> None:
    """Sends `units` streams at `rate`, Hz, for `seconds`, over `udp` or `pty`."""
    addresses, sends = zip(*(_udp if over == "udp" else _pty)(units), strict=True)
    print(json.dumps(addresses), flush=True)
    sys.stdin.readline()
    count, began = int(seconds * rate), time.monotonic()
    for number in range(count):
        ahead = began + number / rate - time.monotonic()
        if ahead > 0.0:
            time.sleep(ahead)
        for send in sends:
            if number % NAMES_EVERY == 0:
                send(HEADER)
            send((ROW % time.monotonic()).encode())
    # A terminal is gone with whoever made it.
    sys.stdin.read()


def _udp(units: int) -> list[tuple[str, Send]]:
    line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    places = [("127.0.0.1", free_port("127.0.0.1")) for _ in range(units)]
    return [(f"udp://{host}:{port}", partial(_send, line, (host, port))) for host, port in places]


def _send(line: socket.socket, place: tuple[str, int], data: bytes) -> None:
    line.sendto(data, place)


def _pty(units: int) -> list[tuple[str, Send]]:
    pairs = [os.openpty() for _ in range(units)]
    for _, line in pairs:
        tty.setraw(line)
    return [(f"serial:{os.ttyname(line)}?baud=4000000", partial(os.write, device)) for device, line in pairs]


if __name__ == "__main__":
    serve(**json.loads(sys.argv[1]))
