"""What something else on board says of the motion: satellites, odometry, a barometer, or an estimator."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from tumble.arrays import column, refuse_other_lengths, times, triad
from tumble.errors import LogError, ProcedureError
from tumble.files import FileKind, note_input, write_text
from tumble.numbers import number_of
from tumble.recording import FloatArray
from tumble.words import count_of

WitnessKind: TypeAlias = Literal["velocity", "body velocity", "score"]
NativeWitness: TypeAlias = tuple[float, WitnessKind, int, FloatArray, FloatArray]
"""Time, kind, unit, value (3,), sigma (3,), as the monitor takes them."""

LEVEL: Mapping[str, tuple[int, float]] = {
    **{"vx": (0, 1.0), "vy": (1, 1.0), "vz": (2, 1.0)},
    **{"ve": (0, 1.0), "vn": (1, 1.0), "vu": (2, 1.0), "vd": (2, -1.0), "climb": (2, 1.0)},
}
"""Columns of velocity in a level frame: axis, and sign; z up, x east or of any heading that stays."""
BODY: Mapping[str, tuple[int, float]] = {"body_vx": (0, 1.0), "body_vy": (1, 1.0), "body_vz": (2, 1.0)}
"""Columns of velocity in the primary's axes."""
SCORE = "score_"
SIGMA = "sigma"
WITNESS = FileKind("a table of a witness", re.compile(rb"\Atime,"))


@dataclass(frozen=True, slots=True)
class Witness:
    """What one of them said, at times of the logs' common clock."""

    kind: WitnessKind
    time: FloatArray = field(repr=False)
    """(n,) s, when it held."""
    value: FloatArray = field(repr=False)
    """(n, 3) m/s; of a score the first column: innovation squared over its variance, a degree of freedom."""
    sigma: FloatArray = field(repr=False)
    """(n, 3) m/s, infinite where an axis is not measured; of a score without meaning."""
    unit: str = ""
    """The unit that a score is of."""
    source: str = "witness"
    """What messages call it."""

    @classmethod
    def velocity(
        cls,
        time: ArrayLike,
        value: ArrayLike,
        sigma: ArrayLike,
        *,
        in_body: bool = False,
        source: str = "witness",
    ) -> Witness:
        """Take velocity (n, 3) m/s at times (n,) s, NaN where an axis is not measured.

        It is that of the primary's place in a level frame with z up, whose heading stays and may be unknown;
        with `in_body`, in the primary's axes. `sigma`, m/s, is one number, three, or (n, 3).

        Raises `ArrayError` where shapes do not fit, `ProcedureError` where a sigma is not above 0.
        """
        stamps, values = times(time), triad(value, "value")
        refuse_other_lengths([("time", stamps), ("value", values)])
        sigmas = np.broadcast_to(np.asarray(sigma, dtype=np.float64), values.shape).copy()
        measured = np.isfinite(values)
        if not (sigmas[measured] > 0.0).all():
            raise ProcedureError(f"{source}: a sigma is not above 0; give that of the velocity, m/s")
        sigmas[~measured] = np.inf
        values = np.where(measured, values, 0.0)
        return cls("body velocity" if in_body else "velocity", stamps, values, sigmas, source=source)

    @classmethod
    def score(cls, unit: str, time: ArrayLike, value: ArrayLike, *, source: str = "witness") -> Witness:
        """Take how badly an estimator that runs on a unit fits its other sensors, (n,) at times (n,) s.

        That is innovation squared over its variance, a degree of freedom: 1 on average in health.

        Raises `ArrayError` where shapes do not fit.
        """
        stamps, scores = times(time), column(value, "value")
        refuse_other_lengths([("time", stamps), ("value", scores)])
        values = np.zeros((len(scores), 3))
        values[:, 0] = scores
        return cls("score", stamps, values, np.full(values.shape, np.inf), unit, source)

    @classmethod
    def load(cls, path: str | Path, sigma: float | None = None) -> tuple[Witness, ...]:
        """Read a table (CSV) of one or several: columns `time`, s, and what is measured, m/s.

        Known are vx, vy, vz, or ve, vn and vu or vd, or climb alone; body_vx, body_vy, body_vz; score_UNIT.
        Sigmas stand in columns sigma_vx ... or sigma, or are given. Empty cells were not measured.

        Raises `LogError`, in one line, where the table cannot be read or nothing in it is known.
        """
        path = Path(path)
        table = _table(path)
        stamps = table.pop("time", None)
        if stamps is None:
            raise LogError(f"{path}: has no column time; it holds {', '.join(table) or 'nothing'}")
        found = [*_velocities(path, stamps, table, sigma), *_scores(path, stamps, table)]
        if not found:
            raise LogError(
                f"{path}: no column is known of {', '.join(table) or 'none'}; known are "
                f"{', '.join([*LEVEL, *BODY])} and {SCORE}UNIT"
            )
        return tuple(found)

    def save(self, path: str | Path) -> Path:
        """Write the table that `load` reads; give its path.

        Raises `OutputError` where it cannot be written.
        """
        names = self._columns()
        sigmas = [f"{SIGMA}_{name}" for name in names if self.kind != "score"]
        figures = [self.time[:, np.newaxis], self.value[:, : len(names)], self.sigma[:, : len(sigmas)]]
        rows = np.concatenate(figures, axis=1).tolist()
        lines = [",".join(map(repr, row)) for row in rows]
        write_text(path, "\n".join([",".join(["time", *names, *sigmas]), *lines, ""]), WITNESS)
        return Path(path)

    def _columns(self) -> tuple[str, ...]:
        if self.kind == "score":
            return (f"{SCORE}{self.unit}",)
        return tuple(LEVEL)[:3] if self.kind == "velocity" else tuple(BODY)


WitnessSource: TypeAlias = Witness | str | Path


def witnesses_of(
    given: WitnessSource | Sequence[WitnessSource], sigma: float | None = None
) -> tuple[Witness, ...]:
    """List what may be one or several, of files what they hold."""
    sources = [given] if isinstance(given, Witness | str | Path) else given
    loaded = ((each,) if isinstance(each, Witness) else Witness.load(each, sigma) for each in sources)
    return tuple(witness for found in loaded for witness in found)


def in_order(witnesses: Iterable[Witness], names: Sequence[str]) -> list[NativeWitness]:
    """Give all that was said in order of time, units by their numbers; `names` are those, primary first.

    Raises `ProcedureError` where a score is of none of them.
    """
    said = [each for witness in witnesses for each in _native(witness, names)]
    return sorted(said, key=lambda each: each[0])


def _native(witness: Witness, names: Sequence[str]) -> Iterator[NativeWitness]:
    if witness.kind == "score" and witness.unit not in names:
        raise ProcedureError(
            f"{witness.source}: the score of {witness.unit} is of none of {', '.join(names)}; "
            "use one of these names"
        )
    unit = names.index(witness.unit) if witness.kind == "score" else 0
    for time, value, sigma in zip(witness.time.tolist(), witness.value, witness.sigma, strict=True):
        yield time, witness.kind, unit, value, sigma


def _velocities(
    path: Path, stamps: FloatArray, table: Mapping[str, FloatArray], sigma: float | None
) -> Iterator[Witness]:
    for known, in_body in ((LEVEL, False), (BODY, True)):
        columns = {name: known[name] for name in table if name in known}
        if not columns:
            continue
        axes = [axis for axis, _ in columns.values()]
        if len(set(axes)) < len(axes):
            raise LogError(f"{path}: {', '.join(columns)}: two of these are of one axis; leave one out")
        values, sigmas = np.full((len(stamps), 3), np.nan), np.full((len(stamps), 3), np.inf)
        for name, (axis, sign) in columns.items():
            values[:, axis] = sign * table[name]
            sigmas[:, axis] = _sigma(path, name, table, sigma)
        said = np.isfinite(values).any(axis=1)
        yield Witness.velocity(stamps[said], values[said], sigmas[said], in_body=in_body, source=str(path))


def _sigma(path: Path, name: str, table: Mapping[str, FloatArray], sigma: float | None) -> FloatArray | float:
    for stated in (f"{SIGMA}_{name}", SIGMA):
        if stated in table:
            return table[stated]
    if sigma is None:
        raise LogError(f"{path}: {name} has no sigma; add a column {SIGMA}, or give --witness-sigma, m/s")
    return sigma


def _scores(path: Path, stamps: FloatArray, table: Mapping[str, FloatArray]) -> Iterator[Witness]:
    for name, values in table.items():
        if name.startswith(SCORE):
            said = np.isfinite(values)
            yield Witness.score(name.removeprefix(SCORE), stamps[said], values[said], source=str(path))


def _table(path: Path) -> dict[str, FloatArray]:
    """Columns of numbers by their names; lines that begin with # and empty ones are left out."""
    note_input(path)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            lines = [(k, line) for k, line in enumerate(file, start=1) if line.strip() and line[0] != "#"]
    except (OSError, UnicodeDecodeError) as error:
        raise LogError(f"{path}: cannot be read: {error}; give a table of comma-separated values") from None
    if not lines:
        raise LogError(f"{path}: is empty")
    names = [name.strip() for name in next(csv.reader([lines[0][1]]))]
    rows = [_numbers(path, line, text, len(names)) for line, text in lines[1:]]
    return dict(zip(names, np.array(rows).reshape(-1, len(names)).T, strict=True))


def _numbers(path: Path, line: int, text: str, columns: int) -> list[float]:
    cells = [cell.strip() for cell in next(csv.reader([text]))]
    if len(cells) != columns:
        raise LogError(f"{path}: line {line}: has {count_of('cell', len(cells))}, the names are {columns}")
    numbers = [number_of(cell) if cell else math.nan for cell in cells]
    for cell, number in zip(cells, numbers, strict=True):
        if number is None:
            raise LogError(f"{path}: line {line}: {cell!r} is no number; correct it, or leave the cell empty")
    return [number for number in numbers if number is not None]
