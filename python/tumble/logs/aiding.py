"""Aiding measurements of the motion: satellites, odometry, a barometer, or an estimator."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tumble.foundation.arrays import column, refuse_other_lengths, times, triad
from tumble.foundation.errors import LogError, ProcedureError
from tumble.foundation.file_names import AIDING_FILE
from tumble.foundation.file_status import is_file
from tumble.foundation.files import BY_TUMBLE, HEAD_OF_OURS, FileKind, note_input, write_text
from tumble.foundation.recording import FloatArray
from tumble.logs.options import ReadOptions
from tumble.logs.text import SoughtTable, find_layout

AidingKind: TypeAlias = Literal["velocity", "body velocity", "heading", "score"]
NativeAiding: TypeAlias = tuple[float, AidingKind, int, FloatArray, FloatArray, float]
"""Time, kind, unit, value (3,), sigma (3,), turn, as the monitor takes them."""

LEVEL: Mapping[str, tuple[int, float]] = {
    **{"vx": (0, 1.0), "vy": (1, 1.0), "vz": (2, 1.0)},
    **{"ve": (0, 1.0), "vn": (1, 1.0), "vu": (2, 1.0), "vd": (2, -1.0), "climb": (2, 1.0)},
}
"""Columns of velocity in a level frame: axis, and sign; z up, x east or of any heading that stays."""
BODY: Mapping[str, tuple[int, float]] = {"body_vx": (0, 1.0), "body_vy": (1, 1.0), "body_vz": (2, 1.0)}
"""Columns of velocity in the primary's axes."""
YAW = "yaw"
HEADING: Mapping[str, float] = {YAW: 1.0, "heading_deg": -math.pi / 180.0}
"""Columns of a heading, and rad of one, counter-clockwise seen from above: a compass counts the other way."""
SCORE = "score_"
SIGMA = "sigma"
TIME, ARRIVAL = "time", "arrival"
KNOWN_COLUMNS = f"{', '.join([*LEVEL, *BODY, *HEADING])} and {SCORE}UNIT"
AIDING = FileKind("a table of an aiding measurement", re.compile(rb"\A(?:#[^\n]*\n)*time,"), BY_TUMBLE)


@dataclass(frozen=True, slots=True)
class Aiding:
    """Measurements of one aiding source, at times of the logs' common clock."""

    kind: AidingKind
    time: FloatArray = field(repr=False)
    """(n,) s, when it held."""
    value: FloatArray = field(repr=False)
    """(n, 3) m/s; of a heading the first column, rad, of a score too: innovation squared over its variance, a
    degree of freedom."""
    sigma: FloatArray = field(repr=False)
    """(n, 3) m/s, infinite where an axis is not measured; of a heading the first column, rad; of a score
    without meaning."""
    unit: str = ""
    """The unit that a score is of."""
    source: str = "aiding"
    """Name of the source in messages."""
    arrival: FloatArray | None = field(default=None, repr=False)
    """(n,) s by the clock of a session, with whose samples of that arrival each was received; None where it
    counts from the first sample of its time on."""

    @classmethod
    def velocity(
        cls,
        time: ArrayLike,
        value: ArrayLike,
        sigma: ArrayLike,
        *,
        in_body: bool = False,
        source: str = "aiding",
    ) -> Aiding:
        """Adds velocity (n, 3) m/s at times (n,) s, NaN where an axis is not measured.

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
    def heading(
        cls, time: ArrayLike, value: ArrayLike, sigma: ArrayLike, *, source: str = "aiding"
    ) -> Aiding:
        """Adds the heading of the primary, rad, (n,) at times (n,) s, as of a magnetometer.

        That is the angle about the vertical of its x axis, counter-clockwise seen from above, from any
        direction that stays. `sigma`, rad, is one number or (n,).

        Raises `ArrayError` where shapes do not fit, `ProcedureError` where a sigma is not above 0.
        """
        stamps, angles = times(time), column(value, "value")
        refuse_other_lengths([("time", stamps), ("value", angles)])
        values, sigmas = np.zeros((len(angles), 3)), np.full((len(angles), 3), np.inf)
        values[:, 0], sigmas[:, 0] = angles, sigma
        if not (sigmas[:, 0] > 0.0).all():
            raise ProcedureError(f"{source}: a sigma is not above 0; give that of the heading, rad")
        return cls("heading", stamps, values, sigmas, source=source)

    @classmethod
    def score(cls, unit: str, time: ArrayLike, value: ArrayLike, *, source: str = "aiding") -> Aiding:
        """Adds the normalised innovation of a unit's estimator, (n,) at times (n,) s.

        That is innovation squared over its variance, a degree of freedom: 1 on average in health.

        Raises `ArrayError` where shapes do not fit.
        """
        stamps, scores = times(time), column(value, "value")
        refuse_other_lengths([("time", stamps), ("value", scores)])
        values = np.zeros((len(scores), 3))
        values[:, 0] = scores
        return cls("score", stamps, values, np.full(values.shape, np.inf), unit, source)

    @classmethod
    def load(cls, path: str | Path, sigma: float | None = None) -> tuple[Aiding, ...]:
        """Reads a table (CSV) of one or several: columns `time`, s, and what is measured, m/s.

        Known are vx, vy, vz, or ve, vn and vu or vd, or climb alone; body_vx, body_vy, body_vz; yaw, rad, or
        heading_deg, degrees clockwise; score_UNIT. Sigmas stand in columns sigma_vx ... or sigma, or are
        given; that of a heading in a column of its own. Empty cells were not measured.

        Raises `LogError`, in one line, where the table cannot be read or nothing in it is known.
        """
        return aiding_measurements_in(_table(Path(path)), str(path), sigma)

    def save(self, path: str | Path) -> Path:
        """Writes the table that `load` reads; returns its path.

        Raises `OutputError` where it cannot be written.
        """
        names = self._columns()
        sigmas = [f"{SIGMA}_{name}" for name in names if self.kind != "score"]
        figures = [self.time[:, np.newaxis], self.value[:, : len(names)], self.sigma[:, : len(sigmas)]]
        rows = np.concatenate(figures, axis=1).tolist()
        lines = [",".join(map(repr, row)) for row in rows]
        write_text(path, "\n".join([HEAD_OF_OURS, ",".join(["time", *names, *sigmas]), *lines, ""]), AIDING)
        return Path(path)

    def _columns(self) -> tuple[str, ...]:
        if self.kind == "score":
            return (f"{SCORE}{self.unit}",)
        return measured_columns(self.kind)


AidingSource: TypeAlias = Aiding | str | Path


def aiding_measurements_of(
    given: AidingSource | Sequence[AidingSource], sigma: float | None = None
) -> tuple[Aiding, ...]:
    """Lists what may be one or several, of files what they hold."""
    sources = [given] if isinstance(given, Aiding | str | Path) else given
    loaded = ((each,) if isinstance(each, Aiding) else Aiding.load(each, sigma) for each in sources)
    return tuple(aiding for found in loaded for aiding in found)


def recorded_aiding(session: str | Path) -> tuple[Aiding, ...]:
    """Returns the measurements received during a session; none where it is no session, or had none."""
    path = Path(session) / AIDING_FILE
    return Aiding.load(path) if is_file(path) else ()


def in_order(measurements: Iterable[Aiding], names: Sequence[str]) -> list[NativeAiding]:
    """Returns all measurements in order of arrival, where that is known of all, and of time.

    Units are given by their numbers; `names` are those, primary first.

    Raises `ProcedureError` where a score is of none of them.
    """
    measurements = list(measurements)
    if any(aiding.arrival is None for aiding in measurements):
        measurements = [replace(aiding, arrival=None) for aiding in measurements]
    return sorted((each for aiding in measurements for each in _native(aiding, names)), key=order)


def order(aiding: NativeAiding) -> tuple[float, float, str, int]:
    """Returns what the order of aiding measurements goes by."""
    time, kind, unit, _, _, turn = aiding
    return turn, time, kind, unit


def _native(aiding: Aiding, names: Sequence[str]) -> Iterator[NativeAiding]:
    if aiding.kind == "score" and aiding.unit not in names:
        raise ProcedureError(
            f"{aiding.source}: the score of {aiding.unit} is of none of {', '.join(names)}; "
            "use one of these names"
        )
    unit = names.index(aiding.unit) if aiding.kind == "score" else 0
    turns = np.full(len(aiding.time), -np.inf) if aiding.arrival is None else aiding.arrival
    for time, value, sigma, turn in zip(
        aiding.time.tolist(), aiding.value, aiding.sigma, turns.tolist(), strict=True
    ):
        yield time, aiding.kind, unit, value, sigma, turn


def aiding_measurements_in(
    columns: Mapping[str, FloatArray], source: str, sigma: float | None = None
) -> tuple[Aiding, ...]:
    """Finds measurements in columns of a table; `time`, s, is one of them. They are left out elsewhere.

    `sigma`, m/s, is that of velocities without a column of theirs.

    Raises `LogError` where nothing is known of them, a velocity has no sigma, or an axis comes twice.
    """
    found = (*_velocities(source, columns, sigma), *_headings(source, columns), *_scores(source, columns))
    if not found:
        others = [name for name in columns if name not in (TIME, ARRIVAL)]
        raise LogError(
            f"{source}: no column is known of {', '.join(others) or 'none'}; known are {KNOWN_COLUMNS}"
        )
    return found


def measured_columns(kind: AidingKind) -> tuple[str, ...]:
    """Returns the names of the columns that a velocity is written under, x, y and z, or a heading."""
    if kind == "heading":
        return (YAW,)
    return tuple(LEVEL)[:3] if kind == "velocity" else tuple(BODY)


def is_column(name: str) -> bool:
    """Returns whether a column of this name is one of an aiding source."""
    return name in (TIME, ARRIVAL, *LEVEL, *BODY, *HEADING) or name.startswith((SCORE, SIGMA))


SOUGHT = SoughtTable("table of an aiding measurement", "time, vx, vy, vz, sigma", is_column)


def _velocities(source: str, table: Mapping[str, FloatArray], sigma: float | None) -> Iterator[Aiding]:
    stamps = table[TIME]
    for known, in_body in ((LEVEL, False), (BODY, True)):
        columns = {name: known[name] for name in table if name in known}
        if not columns:
            continue
        axes = [axis for axis, _ in columns.values()]
        if len(set(axes)) < len(axes):
            raise LogError(f"{source}: {', '.join(columns)}: two of these are of one axis; leave one out")
        values, sigmas = np.full((len(stamps), 3), np.nan), np.full((len(stamps), 3), np.inf)
        for name, (axis, sign) in columns.items():
            values[:, axis] = sign * table[name]
            sigmas[:, axis] = _sigma(source, name, table, sigma)
        said = np.isfinite(values).any(axis=1)
        found = Aiding.velocity(stamps[said], values[said], sigmas[said], in_body=in_body, source=source)
        yield _with_turns(found, table, said)


def _sigma(
    source: str, name: str, table: Mapping[str, FloatArray], sigma: float | None
) -> FloatArray | float:
    for stated in (f"{SIGMA}_{name}", SIGMA):
        if stated in table:
            return table[stated]
    if sigma is None:
        raise LogError(f"{source}: {name} has no sigma; add a column {SIGMA}, or give --aiding-sigma, m/s")
    return sigma


def _headings(source: str, table: Mapping[str, FloatArray]) -> Iterator[Aiding]:
    for name, scale in HEADING.items():
        if name not in table:
            continue
        stated = f"{SIGMA}_{name}"
        if stated not in table:
            raise LogError(f"{source}: {name} has no sigma; add a column {stated}, in the unit of {name}")
        said = np.isfinite(table[name])
        sigmas = table[stated][said] * abs(scale)
        found = Aiding.heading(table[TIME][said], scale * table[name][said], sigmas, source=source)
        yield _with_turns(found, table, said)


def _scores(source: str, table: Mapping[str, FloatArray]) -> Iterator[Aiding]:
    for name, values in table.items():
        if name.startswith(SCORE):
            said = np.isfinite(values)
            found = Aiding.score(name.removeprefix(SCORE), table[TIME][said], values[said], source=source)
            yield _with_turns(found, table, said)


def _with_turns(aiding: Aiding, table: Mapping[str, FloatArray], said: NDArray[np.bool_]) -> Aiding:
    return replace(aiding, arrival=table[ARRIVAL][said]) if ARRIVAL in table else aiding


def _table(path: Path) -> Mapping[str, FloatArray]:
    """Columns of a table that are those of an aiding measurement, by their names."""
    from tumble.logs.csv import TextTable

    note_input(path)
    try:
        layout = find_layout(path, ReadOptions(), SOUGHT)
        table = TextTable(path, layout, [name for name in layout.names if is_column(name)]).whole()
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror or error}") from error
    if TIME not in table:
        raise LogError(f"{path}: has no column {TIME}; it holds {', '.join(layout.names)}")
    # So that what cannot be used is named with what can.
    others = {name: np.empty(0) for name in layout.names if name not in table}
    return table if any(name not in (TIME, ARRIVAL) for name in table) else {**table, **others}
