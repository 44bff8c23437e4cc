"""The law of honesty: every stated interval holds, or the verdict is not that of a calibration."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from benchmarks.honesty.motion import FloatArray
from benchmarks.honesty.session import Session
from benchmarks.honesty.statements import Answer, Statement
from tumble.cli import main as command_line

MOST_SIGMAS = 5.0
"""Largest error of a stated value, in its sigmas: one in 1.7 million by chance."""


@dataclass(frozen=True)
class Judgement:
    """Statements of a command, held against the truth."""

    seed: int
    procedure: str
    rows: tuple[str, ...]
    """Imperfections that were drawn."""
    sizes: tuple[float, ...]
    code: int
    """Exit code."""
    worst: float
    """Largest error of a stated value, sigmas; 0 where nothing was stated."""
    parameter: str
    """Which value errs most."""
    stated: int
    """Number of stated intervals, and how many of 95 % hold."""
    held: int
    named: bool
    """True where a sentence names every drawn imperfection."""

    @property
    def is_silent_wrong(self) -> bool:
        """True where a number is wrong beyond chance, and the exit code reports success."""
        return self.code == 0 and self.worst > MOST_SIGMAS

    @property
    def is_refused_in_vain(self) -> bool:
        """True where the exit code reports failure although all that was stated holds."""
        return self.code != 0 and self.stated > 0 and self.worst <= MOST_SIGMAS

    def record(self) -> dict[str, Any]:
        """Returns it as plain values."""
        return asdict(self)

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> Judgement:
        """Returns the judgement of a record."""
        return cls(**{**record, "rows": tuple(record["rows"]), "sizes": tuple(record["sizes"])})


def typed(words: Sequence[str]) -> Answer:
    """Runs a command as it is typed; an exception that is no `SystemExit` comes out as it is."""
    out, err, before, code = io.StringIO(), io.StringIO(), sys.argv, 0
    sys.argv = ["tumble", *words]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            command_line.main()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    finally:
        sys.argv = before
    return Answer(code, out.getvalue(), err.getvalue())


def judged(
    session: Session, seed: int, drawn: Mapping[str, float], statement: Statement, named: bool
) -> Judgement:
    """Judges what a command stated."""
    errors = statement.errors
    worst = max(errors, key=errors.__getitem__, default="")
    within: FloatArray = np.array(list(errors.values()))
    # A record that shows some of what is asked for states that part as a success.
    code = 0 if statement.is_success and not named else statement.code
    return Judgement(
        seed,
        session.procedure,
        tuple(drawn),
        tuple(drawn.values()),
        code,
        float(errors.get(worst, 0.0)),
        worst,
        len(errors),
        int((within <= 1.96).sum()),
        named,
    )
