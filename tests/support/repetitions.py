"""Number of repetitions of a random test, and the seed of its draws."""

from __future__ import annotations

import os
import random
from collections.abc import Sequence
from typing import TypeVar

import pytest

Row = TypeVar("Row")

SOAK = "TUMBLE_SOAK" in os.environ
"""Indicates whether `make soak` runs the tests: with all repetitions, instead of an eighth."""


def repetitions(everything: int) -> int:
    """Eighth of `everything`, all of it in `make soak`; what is allowed follows from the number."""
    return everything if SOAK else max(1, everything // 8)


def few(rows: Sequence[Row], count: int) -> Sequence[Row]:
    """Returns `count` of the rows of a law, evenly spaced from the first to the last; all in `make soak`."""
    if SOAK or count >= len(rows):
        return rows
    last = max(count - 1, 1)
    return [rows[place * (len(rows) - 1) // last] for place in range(count)]


def by_turns(rows: Sequence[Row], place: int, step: int) -> Sequence[Row]:
    """Returns each `step`-th of the rows, so that places in succession share them; all in `make soak`."""
    return rows if SOAK else rows[place % step :: step]


def only_soak(reason: str) -> pytest.MarkDecorator:
    """Marks a test that `make soak` runs alone, because it takes long and repeats what another shows."""
    return pytest.mark.skipif(not SOAK, reason=f"{reason}: for make soak")


def drawn_seed() -> int:
    """Prints and returns the seed of a test's draws: one for each run, another each time in `make soak`.

    `TUMBLE_SEED` states it, to repeat a run.
    """
    stated = os.environ.get("TUMBLE_SEED") or (str(random.SystemRandom().randrange(2**32)) if SOAK else "1")
    print(f"seed {stated}")
    return int(stated)
