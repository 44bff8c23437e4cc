"""Rows in the order of their time, sorted within a window: datagrams and radio links change their order.

A late row fills a gap that its absence left. A row that fills none has a wrong time, and is not moved.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tumble import _core
from tumble.foundation.recording import Chunk, FloatArray
from tumble.foundation.words import count_of

LARGEST_DISPLACEMENT = 1024
"""Places between a row and where its time belongs; rows are held that long, so that memory is bounded."""
_SMALLEST_GAP = 1.5
"""Ratio to the usual step above which a gap lacks a row."""
_LARGEST_STEP_AT_ENDS = 3.0
"""Largest ratio to the usual step between a row that becomes the first or the last and its neighbour."""

_FEWEST_BEHIND = 10
"""Rows behind a step back that show that time goes on from there; with fewer, they may be late rows."""
_ROWS_A_STEP_BACK = 4
"""Late rows for each step back of time, at most, for which the step of all rows is the usual one."""

Mask = NDArray[np.bool_]
Numbers = NDArray[np.int64]


@dataclass(slots=True)
class Reordering:
    """Rows that were moved, counted."""

    rows: int = 0
    places: int = 0
    """Largest number of places that a row was moved."""
    late: float = 0.0
    """Largest time by which a row came after a later one, s."""

    def add(self, other: Reordering) -> None:
        """Counts those of another pass."""
        self.rows += other.rows
        self.places = max(self.places, other.places)
        self.late = max(self.late, other.late)

    def phrase(self) -> str:
        """Describes them for users."""
        return (
            f"sorted by time: {count_of('row', self.rows)} stood up to {count_of('place', self.places)} from "
            f"where their time belongs, up to {self.late:.3g} s late"
        )


@dataclass(frozen=True, slots=True)
class Rows:
    """Successive samples with their places in the log."""

    chunk: Chunk
    numbers: Numbers
    """(n,) numbers of the samples in the log."""
    places: Numbers
    """(n,) places among the rows that reached the sorting."""
    moved: bool = False
    """Indicates whether their places may not follow one another."""

    def __len__(self) -> int:
        return len(self.chunk)

    def select(self, which: Mask | Numbers | slice) -> Rows:
        """Returns some rows, or all in another order."""
        moved = self.moved or not isinstance(which, slice)
        return Rows(select(self.chunk, which), self.numbers[which], self.places[which], moved)


@dataclass(frozen=True, slots=True)
class WrongTime:
    """A row whose time fits nowhere in the window."""

    number: int
    """Number of the sample in the log."""
    time: float
    step: float
    """Time since the row before it in the log, s."""
    alone: bool
    """True where the rows beside it in the log are in order."""
    goes_on: bool = False
    """True where the rows behind it go on from its time, as where a clock starts anew."""


class RowOrder:
    """Sorts the rows of one pass by time; ordered chunks pass as they are."""

    def __init__(self, *, drop_wrong: bool) -> None:
        self.reordering = Reordering()
        self.dropped: list[WrongTime] = []
        """Rows left out since the last look; only with `drop_wrong`, and only those that stand alone."""
        self._drop_wrong = drop_wrong
        self._held: list[Rows] = []
        self._pushed = 0
        self._given = 0
        self._last = -np.inf

    def push(self, chunk: Chunk, numbers: Numbers) -> list[Rows]:
        """Adds the next chunk, and returns the rows that are ready.

        Raises `WrongOrderError` where a row belongs nowhere in the window.
        """
        places = np.arange(self._pushed, self._pushed + len(chunk), dtype=np.int64)
        self._pushed += len(chunk)
        rows = Rows(chunk, numbers, places)
        latest = self._held[-1].chunk.time[-1] if self._held else self._last
        ordered = len(chunk) == 0 or (chunk.time[0] >= latest and _core.steps(chunk.time)[0] == 0)
        if len(chunk):
            self._held.append(rows)
        if not ordered:
            self._sort(at_end=False)
        return self._ready()

    def finish(self) -> list[Rows]:
        """Returns what is held; raises `WrongOrderError` as `push` does."""
        if any(rows.moved and (rows.places[1:] < rows.places[:-1]).any() for rows in self._held):
            self._sort(at_end=True)
        ready, self._held = self._held, []
        self._count(ready)
        return ready

    def _ready(self) -> list[Rows]:
        """Removes rows from the front that no row within the window can still precede."""
        ready: list[Rows] = []
        spare = sum(map(len, self._held)) - LARGEST_DISPLACEMENT
        while self._held and len(self._held[0]) <= spare:
            ready.append(self._held.pop(0))
            spare -= len(ready[-1])
        first = self._held[0] if self._held else None
        if first is not None and spare > 0 and first.moved and (first.places[1:] < first.places[:-1]).any():
            ready.append(first.select(slice(None, spare)))
            self._held[0] = first.select(slice(spare, None))
        self._count(ready)
        return ready

    def _count(self, ready: list[Rows]) -> None:
        for rows in ready:
            if rows.moved or rows.places[0] != self._given:
                moved = np.abs(rows.places - np.arange(self._given, self._given + len(rows)))
                self.reordering.rows += int(np.count_nonzero(moved))
                self.reordering.places = max(self.reordering.places, int(moved.max(initial=0)))
            self._given += len(rows)
            self._last = float(rows.chunk.time[-1])

    def _sort(self, *, at_end: bool) -> None:
        """Sorts all that is held."""
        together = _joined(self._held)
        logged = together.select(np.argsort(together.places, kind="stable"))
        moved = ~_longest_in_order(logged.chunk.time)
        wrong = self._wrong(logged, moved, at_end=at_end)
        if wrong.any():
            logged = self._without(logged, wrong)
        lateness = np.maximum.accumulate(logged.chunk.time) - logged.chunk.time
        self.reordering.late = max(self.reordering.late, float(lateness.max(initial=0.0)))
        self._held = [logged.select(np.argsort(logged.chunk.time, kind="stable"))]

    def _wrong(self, logged: Rows, moved: Mask, *, at_end: bool) -> Mask:
        """Finds the moved rows that fill no gap, or stand too far from it; (n,) of the order of the log."""
        time, kept = logged.chunk.time, logged.chunk.time[~moved]
        usual = _usual_step(time, moved)
        place = np.searchsorted(kept, time[moved], side="right")
        inside = (place > 0) & (place < len(kept))
        gap = np.full(len(place), np.inf)
        gap[inside] = kept[place[inside]] - kept[place[inside] - 1]
        order = np.argsort(time, kind="stable")
        rank = np.empty(len(time), dtype=np.int64)
        rank[order] = np.arange(len(time))
        ordered = time[order]
        after = np.append(np.diff(ordered), np.inf)[rank[moved]]
        before = np.append(np.inf, np.diff(ordered))[rank[moved]]
        repeats = _repeats(logged, order, rank)[moved]
        sound = (gap >= _SMALLEST_GAP * usual) & (before > 0.0) & (after > 0.0)
        sound[place == 0] &= after[place == 0] <= _LARGEST_STEP_AT_ENDS * usual
        if at_end:
            sound[place == len(kept)] &= before[place == len(kept)] <= _LARGEST_STEP_AT_ENDS * usual
        # A row that repeats another fills no gap: it came twice, and is left out later.
        sound |= repeats
        displacement = np.abs(rank[moved] + self._given - logged.places[moved])
        sound &= (displacement <= LARGEST_DISPLACEMENT) & (time[moved] >= self._last)
        wrong = np.zeros(len(time), dtype=np.bool_)
        wrong[np.flatnonzero(moved)[~sound]] = True
        return wrong

    def _without(self, logged: Rows, wrong: Mask) -> Rows:
        """Omits wrong rows if allowed; otherwise raises `WrongOrderError` with the first."""
        time = logged.chunk.time
        steps = np.diff(time, prepend=max(self._last, time[0]) if np.isfinite(self._last) else time[0])
        beside = np.append(wrong[1:], False) | np.append(False, wrong[:-1])
        alone = bool((wrong & ~beside).any()) and not (wrong & beside).any()
        rows = np.flatnonzero(wrong) if alone else np.flatnonzero(steps < 0.0)[:1]
        found = [
            WrongTime(
                int(logged.numbers[at]),
                float(time[at]),
                float(steps[at]),
                alone,
                not alone and _goes_on(steps[at:]),
            )
            for at in rows
        ]
        if not (alone and self._drop_wrong):
            raise WrongOrderError(found[0])
        self.dropped += found
        self._pushed -= len(found)
        kept = logged.select(~wrong)
        return replace(kept, places=kept.places - np.searchsorted(np.sort(logged.places[wrong]), kept.places))


def _goes_on(steps: FloatArray) -> bool:
    """Returns whether a step back, first of (n,) s, is followed by none, nor by one that takes it back."""
    behind = steps[1:]
    return len(behind) >= _FEWEST_BEHIND and bool((behind >= 0.0).all() and behind.max() < -0.5 * steps[0])


class WrongOrderError(Exception):
    """A row has a time that fits nowhere in the window."""

    def __init__(self, row: WrongTime) -> None:
        super().__init__()
        self.row = row


def select(chunk: Chunk, which: Mask | Numbers | slice) -> Chunk:
    """Returns some samples of a chunk, or all in another order."""
    temperature: FloatArray | None = None if chunk.temperature is None else chunk.temperature[which]
    received: FloatArray | None = None if chunk.received is None else chunk.received[which]
    return Chunk(
        chunk.time[which],
        chunk.accelerometer[which],
        chunk.gyroscope[which],
        temperature,
        received=received,
    )


def _joined(held: list[Rows]) -> Rows:
    chunks = [rows.chunk for rows in held]

    def optional(name: str) -> FloatArray | None:
        if all(getattr(chunk, name) is None for chunk in chunks):
            return None
        columns = [getattr(chunk, name) for chunk in chunks]
        return np.concatenate(
            [
                np.full(len(chunk), np.nan) if column is None else column
                for chunk, column in zip(chunks, columns, strict=True)
            ]
        )

    return Rows(
        Chunk(
            np.concatenate([chunk.time for chunk in chunks]),
            np.concatenate([chunk.accelerometer for chunk in chunks]),
            np.concatenate([chunk.gyroscope for chunk in chunks]),
            optional("temperature"),
            received=optional("received"),
        ),
        np.concatenate([rows.numbers for rows in held]),
        np.concatenate([rows.places for rows in held]),
        moved=True,
    )


def _repeats(logged: Rows, order: Numbers, rank: Numbers) -> Mask:
    """Finds rows that repeat one beside them in time, values and all; (n,) of the order of the log."""
    values = np.column_stack([logged.chunk.time, logged.chunk.accelerometer, logged.chunk.gyroscope])[order]
    same = ((values[1:] == values[:-1]) | np.isnan(values[1:])).all(axis=1)
    repeats: Mask = (np.append(same, False) | np.append(False, same))[rank]
    return repeats


def _usual_step(time: FloatArray, moved: Mask) -> float:
    """Returns the usual step of (n,) times once sorted.

    Late rows come one by one or in bursts, each burst with a step back. A second recording, or a clock set
    back, has one step back for many rows; the step is then that of the rows that stay.
    """
    sparse = _ROWS_A_STEP_BACK * int(np.count_nonzero(np.diff(time) < 0.0)) < int(moved.sum())
    steps = np.diff(np.sort(time[~moved] if sparse else time))
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if len(steps) else 0.0


def _longest_in_order(time: FloatArray) -> Mask:
    """Finds the most rows of (n,) times that can stay where they are: a longest rising subsequence."""
    settled = (np.maximum.accumulate(time) <= time) & (np.minimum.accumulate(time[::-1])[::-1] >= time)
    kept: Mask = settled.copy()
    unsettled = np.flatnonzero(~settled)
    if len(unsettled):
        for block in np.split(unsettled, np.flatnonzero(np.diff(unsettled) > 1) + 1):
            kept[block[_longest_rising(time[block])]] = True
    return kept


def _longest_rising(time: FloatArray) -> list[int]:
    """Returns the positions of a longest subsequence of (n,) times that never falls, by patience sorting."""
    tails: list[float] = []
    ends: list[int] = []
    before = np.full(len(time), -1, dtype=np.int64)
    for position, value in enumerate(time.tolist()):
        pile = bisect_right(tails, value)
        if pile:
            before[position] = ends[pile - 1]
        if pile == len(tails):
            tails.append(value)
            ends.append(position)
        else:
            tails[pile], ends[pile] = value, position
    chain = [ends[-1]]
    while (position := int(before[chain[-1]])) >= 0:
        chain.append(position)
    return chain[::-1]
