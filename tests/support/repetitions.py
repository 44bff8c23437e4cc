"""Number of repetitions of a random test."""

from __future__ import annotations

import os

SOAK = "TUMBLE_SOAK" in os.environ
"""Indicates whether `make soak` runs the tests: with all repetitions, instead of a quarter."""


def repetitions(everything: int) -> int:
    """Quarter of `everything`, all of it in `make soak`; what is allowed follows from the number."""
    return everything if SOAK else everything // 4
