"""Ports that a bench chooses by itself."""

from __future__ import annotations

import errno
import itertools
import random
import socket
from collections.abc import Iterator, Sequence

from tumble.tools.simulate.scenario import ScenarioError

PORTS = range(20_000, 30_000)
"""None that a system gives to whoever sends or connects: Linux begins at 32768, others at 49152.

Such a one would now and then be taken before a program listens there, or while that is started again.
"""
_MOST_TAKEN = 100
"""Ports that are tried: where so many are taken one after the other, something else is wrong."""
_TAKEN = (errno.EADDRINUSE, errno.EACCES)
"""Errors of a port that another process has, or that Windows reserves."""


def in_turn(ports: Sequence[int]) -> Iterator[int]:
    """Returns ports round and round, so that none comes again soon, from one that chance decides."""
    first = random.SystemRandom().randrange(len(ports))
    return itertools.cycle((*ports[first:], *ports[:first]))


turn = in_turn(PORTS)
"""Shared by all benches of a process: what one chose is free until a program listens there."""


def free_port(host: str) -> int:
    """Returns a port at which nobody listens, by UDP or TCP.

    Raises `ScenarioError` where `host` is none of this computer's, or has none free.
    """
    for port in itertools.islice(turn, _MOST_TAKEN):
        try:
            _listen(host, port)
        except OSError as error:
            refused = error
            if error.errno not in _TAKEN:
                break
        else:
            return port
    reason = refused.strerror or refused
    raise ScenarioError(f"host {host}: {reason}; give one of this computer, or --port too") from refused


def _listen(host: str, port: int) -> None:
    """Listens at a port, and lets go of it."""
    for kind in (socket.SOCK_DGRAM, socket.SOCK_STREAM):
        with socket.socket(socket.AF_INET, kind) as one:
            one.bind((host, port))
