"""Functions that jobs of a fleet call in tests: quick, slow, and deadly for their worker."""

import os
import signal
import time
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


def slow(seed):
    """Takes a while, so that a job can be ended in its midst."""
    time.sleep(0.05)
    return squared(seed)


def faulty(seed):
    """Raises an error that is a mistake of whoever wrote the function."""
    return {"value": 1 / (seed - 2)}
