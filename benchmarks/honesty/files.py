"""Imperfections of clocks and files."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from benchmarks.honesty.motion import FloatArray
from benchmarks.honesty.session import STATED, UNNAMED, Session


def run_fast(session: Session, size: float) -> None:
    """Has the target's clock run fast by so many ppm."""
    session.units[-1].stamps.append(lambda time: (1.0 + 1e-6 * size) * time)


def step_clock(session: Session, size: float) -> None:
    """Sets the clock forward by so many s, once."""

    def stepped(time: FloatArray) -> FloatArray:
        after: FloatArray = time + size * (time > session.rng.uniform(time[0], time[-1]))
        return after

    session.units[-1].stamps.append(stepped)


def truncate_stamps(session: Session, size: float) -> None:
    """Truncates stamps to so many s."""
    session.units[-1].stamps.append(lambda time: size * np.floor(time / size))


def delay_stamps(session: Session, size: float) -> None:
    """Delays stamps at random, by so many s on average, in order."""

    def delayed(time: FloatArray) -> FloatArray:
        return np.maximum.accumulate(time + session.rng.exponential(size, len(time)))

    session.units[-1].stamps.append(delayed)


def _chosen(session: Session, rows: list[str], share: float) -> npt.NDArray[np.bool_]:
    return session.rng.random(len(rows)) < share


def double_rows(session: Session, size: float) -> None:
    """Writes a share of the rows twice."""

    def doubled(rows: list[str]) -> list[str]:
        twice = _chosen(session, rows, size)
        return [row for row, again in zip(rows, twice, strict=True) for _ in range(1 + int(again))]

    session.units[-1].rows.append(doubled)


def lose_rows(session: Session, size: float) -> None:
    """Loses a share of the rows."""

    def kept(rows: list[str]) -> list[str]:
        lost = _chosen(session, rows, size)
        return [row for row, is_lost in zip(rows, lost, strict=True) if not is_lost]

    session.units[-1].rows.append(kept)


def swap_rows(session: Session, size: float) -> None:
    """Exchanges a share of the rows with their successors."""

    def swapped(rows: list[str]) -> list[str]:
        out = list(rows)
        for place in np.flatnonzero(_chosen(session, rows[1:], size)):
            out[place], out[place + 1] = out[place + 1], out[place]
        return out

    session.units[-1].rows.append(swapped)


def write_degrees(session: Session, _: float) -> None:
    """Writes deg/s in columns that do not state it."""
    unit = session.units[-1]
    unit.scale = (unit.scale[0], float(np.degrees(1.0)))
    unit.head = unit.head.replace(STATED, UNNAMED)


def write_g(session: Session, _: float) -> None:
    """Writes g in columns that do not state it."""
    unit = session.units[-1]
    unit.scale = (1.0 / 9.80665, unit.scale[1])


def write_commas(session: Session, _: float) -> None:
    """Writes decimal commas, and semicolons between columns."""
    for unit in session.units:
        unit.head = unit.head.replace(",", ";")
        unit.rows.append(lambda rows: [row.replace(",", ";").replace(".", ",") for row in rows])
