"""Plugin of pytest: notes the mutants of Rust that each file of tests reaches."""

from __future__ import annotations

import os
from pathlib import Path

FOLDER = Path(os.environ["TUMBLE_MUTANTS_NOTES"])
REACHED = "TUMBLE_MUTANTS_REACHED"
# The native module reads it at the first mutant that it meets.
os.environ[REACHED] = str(FOLDER / "collection")


def pytest_runtest_logstart(nodeid: str) -> None:
    """Begins a list for each file of tests."""
    # Only a copy of the repository has such a module.
    from tumble._core import forget_mutants  # type: ignore[attr-defined]

    path = str(FOLDER / nodeid.partition("::")[0].replace("/", "+"))
    if os.environ[REACHED] != path:
        os.environ[REACHED] = path
        forget_mutants()
