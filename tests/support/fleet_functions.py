"""Functions that jobs of a fleet call in tests: quick, slow, and deadly for their worker."""

import os
import signal
from pathlib import Path

POISONED = 7
"""Seed that kills its worker."""


def squared(seed, offset=0):
    """Returns a number that shows which seed it comes from."""
    return {"verdict": "computed", "value": seed * seed + offset}


def deadly(seed):
    """Kills the process on one seed."""
    if seed == POISONED:
        os.kill(os.getpid(), signal.SIGKILL)
    return squared(seed)


def deadly_once(seed, folder=""):
    """Kills the process on every third seed, the first time that it comes."""
    mark = Path(folder) / str(seed)
    if seed % 3 == 0 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return squared(seed)


HELD_FROM = 100
"""Seed from which on a job is held."""
COMES, GOES = "comes", "goes"


def held(seed, folder=""):
    """Waits midway at the gate of a job, where there is one: it comes by a pipe, and goes by another."""
    comes, goes = Path(folder) / COMES, Path(folder) / GOES
    if seed >= HELD_FROM and comes.exists():
        comes.write_bytes(b".")
        with goes.open("rb", buffering=0) as gate:
            gate.read(1)
    return squared(seed)


def nested():
    """Lists in lists, deeper than any reader goes."""
    outer = inner = []
    for _ in range(100_000):
        inner.append([])
        inner = inner[0]
    return {"value": outer}


class WordlessError(Exception):
    """Has no words: to ask for them raises another error."""

    def __str__(self):
        raise RuntimeError("no words")


HOSTILE = (
    lambda: None,
    lambda: [1],
    lambda: {"value": object()},
    nested,
    lambda: {"verdict": "\ud800"},
    lambda: fail(WordlessError()),
    lambda: fail(ValueError("\x1b[31mred\nFailed: 99: as if\u202e")),
    lambda: fail(MemoryError()),
)
"""Outcomes of a function that are none."""


def fail(error):
    """Raises an error."""
    raise error


def hostile(seed):
    """Changes what its process shares; its outcome is none, another for each seed but the last."""
    print("not JSON")
    os.chdir("/")
    return HOSTILE[seed]() if seed < len(HOSTILE) else squared(seed)


def faulty(seed):
    """Raises an error that is a mistake of whoever wrote the function."""
    return {"value": 1 / (seed - 2)}
