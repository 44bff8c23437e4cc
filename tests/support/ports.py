"""Ports that no other process of these tests is given, nor anybody else who sends or connects."""

from __future__ import annotations

import os
from contextlib import contextmanager

import pytest

from tumble.tools.simulate.live import ports

_PROCESS = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
_PROCESSES = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
OWN = range(15_000 + _PROCESS, ports.PORTS.start, _PROCESSES)
"""Below those of benches that run in processes of their own."""


@contextmanager
def chosen_among_own():
    """Benches of this process choose among its own ports too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ports, "turn", ports.in_turn(OWN))
        yield


def free_port():
    """A port at which nobody listens, by UDP or TCP."""
    return ports.free_port("127.0.0.1")


def free_ports(count):
    """Different ones of them."""
    return [free_port() for _ in range(count)]
