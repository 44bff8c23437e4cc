"""Number of repetitions of a random test, and the seed of its draws."""

from __future__ import annotations

import os
import random

SOAK = "TUMBLE_SOAK" in os.environ
"""Indicates whether `make soak` runs the tests: with all repetitions, instead of a quarter."""


def repetitions(everything: int) -> int:
    """Quarter of `everything`, all of it in `make soak`; what is allowed follows from the number."""
    return everything if SOAK else everything // 4


def drawn_seed() -> int:
    """Prints and returns the seed of a test's draws: one for each run, another each time in `make soak`.

    `TUMBLE_SEED` states it, to repeat a run.
    """
    stated = os.environ.get("TUMBLE_SEED") or (str(random.SystemRandom().randrange(2**32)) if SOAK else "1")
    print(f"seed {stated}")
    return int(stated)
