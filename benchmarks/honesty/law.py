"""The law of honesty: every stated interval holds, or the verdict is not that of a calibration."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from benchmarks.honesty.motion import FloatArray
from benchmarks.honesty.session import Session, Unit
from tumble.cli import main as command_line

MOST_SIGMAS = 5.0
"""Largest error of a stated value, in its sigmas: one in 1.7 million by chance."""
AXES = "xyz"
TRIADS = ("accelerometer", "gyroscope")
PAIRS = ((0, 1), (1, 2), (2, 0))


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


@dataclass(frozen=True)
class Answer:
    """Exit code of a command, and the warnings and errors that it printed."""

    code: int
    words: str


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
    # Warnings end what a command prints; its table before them has words of its own.
    _, mark, warnings = out.getvalue().partition("Warning: ")
    return Answer(code, f"{err.getvalue()}{mark}{warnings}")


def true_values(unit: Unit) -> dict[tuple[str, str], float]:
    """Parameters of a unit that depend on no frame, by triad and name; angles in deg."""
    values = {}
    for triad, matrix in unit.matrix.items():
        axes = matrix / np.linalg.norm(matrix, axis=1, keepdims=True)
        for k, axis in enumerate(AXES):
            values[triad, f"bias {axis}"] = float(unit.true_bias(triad)[k])
            values[triad, f"scale {axis}"] = float(np.linalg.norm(matrix[k]))
        for i, j in PAIRS:
            angle = float(np.degrees(np.arcsin(np.clip(axes[i] @ axes[j], -1.0, 1.0))))
            values[triad, f"non-orthogonality {AXES[i]}{AXES[j]}"] = angle
    return values


def stated_values(folder: Path) -> Iterator[tuple[str, str, float, float]]:
    """Triad, name, value and sigma of all that the calibration files of a folder state; angles in deg."""
    for path in sorted(folder.glob("*.yaml")):
        content = yaml.safe_load(path.read_text())
        if not str(content.get("schema", "")).startswith("tumble-calibration/"):
            continue
        for triad in TRIADS:
            section = content.get(triad) or {"sigma": {}}
            sigma, angles = section["sigma"], section.get("angles", {}).get("non-orthogonality") or {}
            for k, axis in enumerate(AXES):
                for name, value in (("bias", section.get("b")), ("scale", section.get("K"))):
                    shown = (sigma.get(name) or [None] * 3)[k]
                    if value is not None and shown is not None:
                        yield triad, f"{name} {axis}", value[k] if name == "bias" else value[k][k], shown
            for pair, shown in (sigma.get("non-orthogonality") or {}).items():
                if shown is not None and angles.get(pair) is not None:
                    yield triad, f"non-orthogonality {pair}", angles[pair], shown


def judged(
    session: Session, seed: int, drawn: Mapping[str, float], answer: Answer, folder: Path, named: bool
) -> Judgement:
    """Holds the files in a folder against the truth of the last unit of a session."""
    truth = true_values(session.units[-1])
    errors = {
        f"{triad} {name}": abs(value - truth[triad, name]) / sigma if sigma else np.inf
        for triad, name, value, sigma in stated_values(folder)
    }
    worst = max(errors, key=errors.__getitem__, default="")
    within: FloatArray = np.array(list(errors.values()))
    return Judgement(
        seed,
        session.procedure,
        tuple(drawn),
        tuple(drawn.values()),
        answer.code,
        float(errors.get(worst, 0.0)),
        worst,
        len(errors),
        int((within <= 1.96).sum()),
        named,
    )
