"""One drawn session with imperfections of the catalogue, judged; a function of its seed alone."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.honesty.catalogue import CATALOGUE, Imperfection
from benchmarks.honesty.law import Judgement, judged, typed
from benchmarks.honesty.sessions import SESSIONS
from benchmarks.honesty.statements import answered

UNDISTURBED = 0.1
"""Share of draws without any imperfection, which show how often intervals hold."""


def rows_for(procedure: str, seed: int, pair: bool) -> list[Imperfection]:
    """Returns the imperfections of a draw: rows take turns, a second one is drawn."""
    rows = [row for row in CATALOGUE if procedure in row.procedures]
    rng = np.random.default_rng([seed, 0])
    if rng.random() < UNDISTURBED:
        return []
    first = rows[seed % len(rows)]
    others = [row for row in rows if row is not first]
    return [first, others[int(rng.integers(len(others)))]] if pair else [first]


def draw(procedure: str, seed: int, pair: bool = False, only: Sequence[str] = ()) -> Judgement:
    """Draws a session of a procedure by a seed, runs the command on its files, and judges the answer.

    `only` names the imperfections that are put in, in the place of those that the seed draws.
    """
    rows = [row for row in CATALOGUE if row.name in only] if only else rows_for(procedure, seed, pair)
    rng = np.random.default_rng([seed, 1])
    session = SESSIONS[procedure](rng)
    drawn = {row.name: row.draw(rng) for row in rows}
    for row in rows:
        row.put(session, drawn[row.name])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        statement = answered(session, typed(session.write(folder)), folder / "out")
        words = " ".join(statement.words.replace(name, "").split())
        named = bool(rows) and all(re.search(row.says, words, re.IGNORECASE) for row in rows)
        return judged(session, seed, drawn, statement, named)


def judge(seed: int, procedure: str = "multipose", pair: bool = False) -> dict[str, Any]:
    """Judges a draw, as a job of a fleet calls it."""
    return draw(procedure, seed, pair).record()
