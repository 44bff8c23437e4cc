"""The monitor of a redundant set: windows in, events out; many runs of one length at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.flights.model.aiding import DECIDED, EARLIER, TwoHypotheses, Velocities
from benchmarks.flights.model.clock import FIRST, synchronised
from benchmarks.flights.model.error import (
    FORCE_WINDOWS,
    Errors,
    Information,
    levers,
    nothing_known,
)
from benchmarks.flights.model.hypotheses import Own, Vote
from benchmarks.flights.model.test import SCALES, Comparison, PairTest, motion_of_set, paired
from benchmarks.flights.model.vibration import Aliased, of_set
from benchmarks.flights.model.window import HOP, UnitWindows, Windows, averaged, beside, grid
from benchmarks.redundancy_judgement import Event
from benchmarks.redundancy_set import Samples
from tumble.foundation.recording import FloatArray

BEGINS = 2.0
"""s after which units are compared."""
BLOCK = 20
"""Windows of a block, that is learnt from when the next one has ended in agreement."""
AGREEING = 0.6
"""Ratio within which all pairs must be in both blocks."""
OTHER_RATE = 2
"""Windows from one to the next whose angular rates count as independent."""
RETURNS = 2.0
"""s without its own fault after which a unit counts again."""
NO_UNIT = -1
SETTLED = 10.0
"""s of agreement after which a dispute is over."""
DWELL = 2
"""Windows in succession in which two units disagree before it is reported."""


@dataclass(slots=True)
class Flown:
    """A run: events, and errors of the units at its end."""

    events: list[Event]
    errors: Errors
    """Those of this run."""


@dataclass(slots=True)
class _Block:
    """Sums since the block began."""

    information: Information
    noise: FloatArray
    calm: NDArray[np.bool_]
    """(b,) all pairs agreed."""
    active: NDArray[np.bool_]
    first: int
    last: int


class Monitor:
    """One set of units over many runs."""

    def __init__(
        self,
        windows: Sequence[Windows],
        errors: Errors,
        begins: float = BEGINS,
        velocities: Velocities | None = None,
    ) -> None:
        """Takes windows of all runs, which share their times, stored errors, and aiding velocities."""
        self.time = windows[0].time
        self.begins = begins
        reading = np.stack([each.reading for each in windows], axis=1)
        change = np.stack([each.change for each in windows], axis=1)
        product = np.stack([each.product for each in windows], axis=1)
        self.whole = np.stack([each.is_whole for each in windows], axis=1)
        self.reading, self.motion = reading, motion_of_set(reading, change, product, self.whole)
        self.test = PairTest(paired(reading, self.whole, self.motion))
        self.runs, self.units = reading.shape[1:3]
        pairs = self.test.means.pairs
        self.vote = Vote(pairs, self.units, (len(SCALES), self.runs, len(pairs), 2))
        self.own = Own(windows)
        self.aliased = Aliased(reading, self.motion, self.whole)
        self.errors = errors
        self.events: list[list[Event]] = [[] for _ in range(self.runs)]
        self.voted_out = np.zeros((self.runs, self.units), dtype=bool)
        self.own_until = np.full((self.runs, self.units), -np.inf)
        self.was_active = np.ones((self.runs, self.units), dtype=bool)
        self.disputing = np.zeros((self.runs, len(pairs)), dtype=int)
        self.disputed_since = np.full(self.runs, np.nan)
        self.disputed_last = np.full(self.runs, -np.inf)
        aided = velocities is not None and self.units == 2
        self.hypotheses = TwoHypotheses(velocities, self.runs) if velocities is not None and aided else None
        self.held = reading[0]
        self.begun: _Block = self._block(0)
        self.waiting: _Block | None = None
        self.source = np.full(self.runs, NO_UNIT - 1)

    def fly(self) -> list[Flown]:
        """Goes through all windows."""
        for step in range(len(self.time)):
            self._step(step)
        return [
            Flown(
                self.events[run],
                Errors(*(getattr(self.errors, name)[[run]] for name in self.errors.__slots__)),
            )
            for run in range(self.runs)
        ]

    def _block(self, first: int) -> _Block:
        return _Block(
            Information.none(self.runs, self.units),
            np.zeros(0),
            np.ones(self.runs, dtype=bool),
            np.ones((self.runs, self.units), dtype=bool),
            first,
            first,
        )

    def _step(self, step: int) -> None:
        now = float(self.time[step]) + HOP
        began = float(self.time[0])
        self._look_at_own(step, now, began)
        active = self._active(now)
        samples, windows = self.own.ratio(step, SCALES), self.aliased.ratio(step)
        shaking = np.maximum(of_set(samples, active), of_set(windows, active))
        comparison = self.test.compare(step, self.errors, shaking)
        self.test.note(comparison)
        judged = active[:, self.test.first] & active[:, self.test.second]
        if now - began >= self.begins:
            self._vote(comparison, judged, active, now)
        if self.hypotheses is not None:
            self._aid(step, now, active)
        self._select(now)
        self.begun.calm &= (
            np.where(judged[None, :, :, None], comparison.ratio, 0.0).max(axis=(0, 2, 3)) < AGREEING
        )
        self.begun.active &= active & self.whole[step]
        self._gather(step, active)
        if (step + 1) % BLOCK == 0:
            self._commit(step + 1)

    def _active(self, now: float) -> NDArray[np.bool_]:
        return ~self.voted_out & (now >= self.own_until)

    def _look_at_own(self, step: int, now: float, began: float) -> None:
        if now - began < self.begins:
            return
        active = self._active(now)
        for reason, found in self.own.reasons(step, active).items():
            for run, unit in zip(*np.nonzero(found), strict=True):
                if now >= self.own_until[run, unit] and not self.voted_out[run, unit]:
                    self._name(run, unit, now, reason)
                self.own_until[run, unit] = now + RETURNS

    def _aid(self, step: int, now: float, active: NDArray[np.bool_]) -> None:
        """Holds both units against what is measured from outside, and names one of two that disagree."""
        assert self.hypotheses is not None
        self.held = np.where(self.whole[step][..., None], self.reading[step], self.held)
        motion = self.motion[step]
        lever = levers(motion[:, 9:12], motion[:, 12:])
        force = self.held[..., :3] - self.errors.force_error(motion[:, None, :3], lever[:, None])
        rate = self.held[..., 3:] - self.errors.rate_error(motion[:, None, 3:6])
        known = len(self.hypotheses.evidence)
        self.hypotheses.advance(now, force, rate, HOP)
        if len(self.hypotheses.evidence) == known:
            return
        disputed = ~np.isnan(self.disputed_since)
        self.hypotheses.learn(~disputed)
        evidence = self.hypotheses.logarithm(np.where(disputed, self.disputed_since, np.inf) - EARLIER)
        decided = disputed & (np.abs(evidence) > DECIDED) & active.all(axis=1)
        for run in np.nonzero(decided)[0]:
            unit = 0 if evidence[run] > 0.0 else 1
            self.voted_out[run, unit] = True
            self._name(run, unit, now, "aiding")

    def _select(self, now: float) -> None:
        """Takes the first unit without a fault as the source."""
        active = self._active(now)
        source = np.where(active.any(axis=1), np.argmax(active, axis=1), NO_UNIT)
        for run in np.nonzero(source != self.source)[0]:
            reason = "start" if self.source[run] < NO_UNIT else "failed"
            reason = "none fit" if source[run] == NO_UNIT else reason
            self.events[run].append((now, int(source[run]), "selected", {"reason": reason}))
        self.source = source

    def _name(
        self, run: int | np.signedinteger, unit: int | np.signedinteger, now: float, reason: str
    ) -> None:
        self.events[int(run)].append((now, int(unit), "unhealthy", {"reason": reason}))

    def _vote(
        self, comparison: Comparison, judged: NDArray[np.bool_], active: NDArray[np.bool_], now: float
    ) -> None:
        odd = self.vote.found(comparison.ratio, comparison.deviation, judged)
        enough = active.sum(axis=1) > 2
        for run in np.nonzero((odd >= 0) & enough)[0]:
            self.voted_out[run, odd[run]] = True
            self._name(run, odd[run], now, "out of family")
        worst = np.where(judged[None, :, :, None], comparison.ratio, 0.0).max(axis=(0, 3))
        before = self.disputing.copy()
        self.disputing = np.where(worst > 1.0, self.disputing + 1, 0)
        for run, pair in zip(*np.nonzero((self.disputing >= DWELL) & (before < DWELL)), strict=True):
            if not enough[run] and np.isnan(self.disputed_since[run]):
                self.disputed_since[run] = now
                unit = int(self.test.second[pair])
                self.events[run].append((now, unit, "disagree", {"other": int(self.test.first[pair])}))
        self.disputed_last = np.where(worst.max(axis=1) > AGREEING, now, self.disputed_last)
        over = now - self.disputed_last > SETTLED
        for run in np.nonzero(over & ~np.isnan(self.disputed_since))[0]:
            self.events[run].append((now, 1, "agree", {}))
        self.disputed_since = np.where(over, np.nan, self.disputed_since)

    def _gather(self, step: int, active: NDArray[np.bool_]) -> None:
        """Adds windows to the information of the block."""
        usable = self.whole[step] & active
        weight = (usable & usable[:, :1]).astype(float)
        if step % OTHER_RATE == 0:
            difference = self.reading[step, :, :, 3:] - self.reading[step, :, :1, 3:]
            self.begun.information.add_rate(self.motion[step, :, 3:6], difference, weight)
        if (step + 1) % FORCE_WINDOWS == 0:
            since = slice(step + 1 - FORCE_WINDOWS, step + 1)
            mean = self.motion[since].mean(axis=0)
            lever = levers(mean[:, 9:12], mean[:, 12:])
            reading = self.reading[since].mean(axis=0)
            whole = (self.whole[since].all(axis=0) & active).astype(float)
            difference = reading[..., :3] - reading[:, :1, :3] - self.errors.bilinear(lever)
            self.begun.information.add_force(mean[:, :3], lever, difference, whole * whole[:, :1])

    def _commit(self, end: int) -> None:
        """Learns the block before, where it and this one agreed."""
        done = self.begun
        done.noise, done.last = self.test.taken(), end
        seconds = BLOCK * HOP
        if (block := self.waiting) is not None:
            calm = (block.calm & done.calm)[:, None] & block.active & done.active
            calm &= ~self.voted_out[:, :1]
            self.errors = self.errors.walked(seconds).informed(block.information, calm.astype(float))
            pairs = calm[:, self.test.first] & calm[:, self.test.second]
            self.test.learn(block.noise, block.last - block.first, seconds, pairs)
            self.own.learn(block.first, block.last, seconds, calm)
            self.aliased.learn(block.first, block.last, seconds, calm)
        self.waiting, self.begun = done, self._block(end)


def flown(
    runs: Sequence[Sequence[Samples]],
    errors: Errors | None = None,
    velocities: Velocities | None = None,
    *,
    find_delays: bool = True,
) -> list[Flown]:
    """Flies runs of equal length, of each the samples of all units, primary first; velocities aid two."""
    time = grid(runs[0])
    start = max(float(each.time[0]) for each in runs[0])
    # Runs of one flight share the samples of all units but the faulty one, and so their windows.
    means: dict[tuple[int, int], UnitWindows] = {}
    for run in runs:
        for unit in run:
            if (pair := (id(run[0]), id(unit))) not in means:
                known = unit if unit is run[0] or not find_delays else synchronised(run[0], unit, start)
                means[pair] = averaged(known, time)
    windows = [beside([means[id(run[0]), id(unit)] for unit in run], time) for run in runs]
    known_errors = nothing_known(len(runs), len(runs[0])) if errors is None else errors
    return Monitor(windows, known_errors, FIRST if find_delays else BEGINS, velocities).fly()
