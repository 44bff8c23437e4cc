"""Files whose simulated benches run at one time."""

from __future__ import annotations

import fcntl
import os

import pytest

from tumble.bench.authority import acting

PROCESS = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))


@pytest.fixture(scope="module", autouse=True)
def core(request, tmp_path_factory):
    """A simulated bench and its browser keep a core busy: files that open one take turns, one a core."""
    if not hasattr(request.module, "chromium"):
        yield
        return
    shared = tmp_path_factory.getbasetemp().parent
    places = [(shared / f"bench-{number}.lock").open("w") for number in range(os.cpu_count() or 1)]
    if not any(_taken(place) for place in places):
        fcntl.flock(places[PROCESS % len(places)], fcntl.LOCK_EX)
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
