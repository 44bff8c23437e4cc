"""Files whose simulated benches run at one time."""

from __future__ import annotations

import fcntl
import os
import time

import pytest

from tumble.bench.authority import acting


@pytest.fixture(scope="module", autouse=True)
def core(tmp_path_factory):
    """A simulated bench and its browser keep a core busy: files of tests take turns, one a core."""
    shared = tmp_path_factory.getbasetemp().parent
    places = [(shared / f"bench-{number}.lock").open("w") for number in range(os.cpu_count() or 1)]
    while not any(_taken(place) for place in places):
        time.sleep(0.2)
    yield
    for place in places:
        place.close()


@pytest.fixture(autouse=True)
def acts_as_bench():
    """Has a test that calls a bench of its own process act as the bench itself does."""
    with acting(lambda: True):
        yield


def _taken(place) -> bool:
    try:
        fcntl.flock(place, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
