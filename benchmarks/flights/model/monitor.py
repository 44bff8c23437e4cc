"""The monitor of a redundant set: windows in, events out; many runs of one length at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.flights.model import clock
from benchmarks.flights.model.aiding import DECIDED, EARLIER, TwoHypotheses, Velocities
from benchmarks.flights.model.error import (
    FORCE_WINDOWS,
    Errors,
    Information,
    levers,
)
from benchmarks.flights.model.hypotheses import Own, Vote
from benchmarks.flights.model.limits import Limits
from benchmarks.flights.model.means import SCALES
from benchmarks.flights.model.rest import Rests
from benchmarks.flights.model.statement import Statement, first_errors
from benchmarks.flights.model.test import MOTION, Comparison, PairTest, motion_of_set
from benchmarks.flights.model.vibration import Aliased, of_set
from benchmarks.flights.model.window import BLOCK, HOP, UnitWindows, Windows, averaged, beside, grid
from benchmarks.redundancy_judgement import Event
from benchmarks.redundancy_set import Samples
from tumble.foundation.recording import FloatArray

BEGINS = 2.0
"""s after which units are compared."""
AGREEING = 0.6
"""Ratio within which all pairs must be in both blocks."""
OTHER_RATE = 2
"""Windows from one to the next whose angular rates count as independent."""
RETURNS = 2.0
"""s without its own fault after which a unit counts again."""
NO_UNIT = -1
SOUND = 4.0
"""Evidence at rest within which a unit is sound."""
SETTLED = 10.0
"""s of agreement after which a dispute is over."""
DWELL = (2, 20)
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
    timed: NDArray[np.bool_]
    """(b, n) the delay of the clock was known throughout."""
    rest: NDArray[np.bool_]
    """(b,) the set was at rest throughout."""
    motion: NDArray[np.bool_]
    """(b,) it was at no time known to be."""


class Monitor:
    """One set of units over many runs."""

    def __init__(
        self,
        windows: Sequence[Windows],
        errors: Errors,
        begins: float = BEGINS,
        velocities: Velocities | None = None,
        delayed: FloatArray | None = None,
    ) -> None:
        """Takes windows of all runs, which share their times, stored errors, and aiding velocities.

        Sigmas of the delays of clocks, s, are (t, b, n); none where the clocks are one.
        """
        self.time = windows[0].time
        self.begins = begins
        reading = np.stack([each.reading for each in windows], axis=1)
        change = np.stack([each.change for each in windows], axis=1)
        product = np.stack([each.product for each in windows], axis=1)
        self.whole = np.stack([each.is_whole for each in windows], axis=1)
        self.reading, self.motion = reading, motion_of_set(reading, change, product, self.whole)
        interval = np.stack([each.interval for each in windows])
        self.delayed = np.zeros(self.whole.shape) if delayed is None else delayed
        self.repeated = np.stack([each.repeated for each in windows], axis=1)
        self.runs, self.units = reading.shape[1:3]
        self.rests = Rests(self.runs, self.units)
        self.test = PairTest(self.runs, self.units, interval)
        pairs = self.test.means.pairs
        self.vote = Vote(pairs, self.units, (len(SCALES), self.runs, len(pairs), 2))
        self.own = Own(windows)
        self.aliased = Aliased(self.runs, self.units)
        self.errors = self.stored = errors
        self.learnt = np.zeros(self.runs, dtype=bool)
        self.limits = Limits(pairs, self.units, self.runs)
        self.beyond = np.zeros((self.runs, self.units), dtype=bool)
        self.agreed_since = np.zeros((self.runs, self.units))
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
        self.begun: _Block = self._block()
        self.waiting: _Block | None = None
        self.source = np.full(self.runs, NO_UNIT - 1)

    def fly(self) -> list[Flown]:
        """Goes through all windows."""
        for step in range(len(self.time)):
            self._step(step)
        return [self._flown(run) for run in range(self.runs)]

    def _flown(self, run: int) -> Flown:
        """Returns a run; errors relative to a primary that is wrong are none of the secondaries."""
        kept = self.stored if self.beyond[run, 0] else self.errors
        return Flown(self.events[run], Errors(*(getattr(kept, name)[[run]] for name in Errors.__slots__)))

    def _block(self) -> _Block:
        return _Block(
            Information.none(self.runs, self.units),
            np.zeros(0),
            np.ones(self.runs, dtype=bool),
            np.ones((self.runs, self.units), dtype=bool),
            np.ones((self.runs, self.units), dtype=bool),
            np.ones(self.runs, dtype=bool),
            np.ones(self.runs, dtype=bool),
        )

    def _step(self, step: int) -> None:
        now = float(self.time[step]) + HOP
        began = float(self.time[0])
        reading, whole, motion = self.reading[step], self.whole[step], self.motion[step]
        self.rests.take(reading, whole, self.repeated[step])
        self.own.take(step, motion)
        self.own.set_state(self.rests.is_rest)
        self._look_at_own(step, now, began)
        active = self._active(now)
        self._forget(step)
        self.test.means.take(reading, self.errors, whole, motion)
        self.aliased.take(reading, motion, whole)
        samples, windows = self.own.ratio(), self.aliased.ratio()
        shaking = np.maximum(of_set(samples, active), of_set(windows, active))
        comparison = self.test.compare(self.errors, shaking, self.delayed[step])
        self.test.note(comparison)
        judged = active[:, self.test.first] & active[:, self.test.second]
        if now - began >= self.begins:
            self._vote(comparison, judged, active, now)
        if self.hypotheses is not None:
            self._aid(step, now, active)
        if now - began >= self.begins:
            self._look_at_rest(now)
            self._reinstate(comparison, now)
        self._select(now)
        worst = np.where(judged[None, :, :, None], comparison.ratio, 0.0).max(axis=(0, 2, 3))
        # Before anything is learnt, an error within the threshold is a sound one.
        self.begun.calm &= worst < np.where(self.learnt, AGREEING, 1.0)
        self.begun.active &= active | self.beyond
        self.begun.timed &= self.delayed[step] < clock.SIGNIFICANT
        self.begun.rest &= self.rests.is_rest
        self.begun.motion &= ~self.rests.is_rest
        self._gather(step, active)
        if (step + 1) % BLOCK == 0:
            self._commit(step + 1)

    def _forget(self, step: int) -> None:
        """Forgets what pairs differed by before their clocks were one, and how much: that is no deviation."""
        if step:
            became = (self.delayed[step] < clock.SIGNIFICANT) & (self.delayed[step - 1] >= clock.SIGNIFICANT)
            pairs = became[:, self.test.first] | became[:, self.test.second]
            self.test.means.difference.forget(pairs)
            self.test.forget_noise(pairs)

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
        corrected = self.held - self.errors.both(self.motion[step])
        force, rate = corrected[..., :3], corrected[..., 3:]
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

    def _look_at_rest(self, now: float) -> None:
        """Names one of two that disagree at rest where physics finds the other sound."""
        evidence = self.rests.evidence()
        active = self._active(now)
        disputed = ~np.isnan(self.disputed_since) & (active.sum(axis=1) == 2)
        suspect = np.where(active, evidence, -np.inf)
        # A disagreement of motion alone, as of a scale, is none that a rest decides.
        lasting = (self.disputing >= DWELL[0]).any(axis=1)
        shown = ~np.isnan(evidence).any(axis=1) & self.rests.is_rest & lasting
        for run in np.nonzero(shown & disputed)[0]:
            worst, other = np.argsort(-suspect[run])[:2]
            if suspect[run, worst] - suspect[run, other] > DECIDED and suspect[run, other] < SOUND:
                self.voted_out[run, worst] = True
                self._name(run, worst, now, "rest")

    def _reinstate(self, comparison: Comparison, now: float) -> None:
        """Lets a unit count again that agreed with all others for a while."""
        sound = self._active(now)
        for unit in range(self.units):
            others = sound.copy()
            others[:, unit] = True
            judged = others[:, self.test.first] & others[:, self.test.second]
            judged &= (self.test.first == unit) | (self.test.second == unit)
            worst = np.where(judged[None, :, :, None], comparison.ratio, 0.0).max(axis=(0, 2, 3))
            self.agreed_since[:, unit] = np.where(
                (worst < AGREEING) & judged.any(axis=1), self.agreed_since[:, unit], now
            )
        back = self.voted_out & ~self.beyond & (now - self.agreed_since > SETTLED)
        for run, unit in zip(*np.nonzero(back), strict=True):
            self.events[run].append((now, int(unit), "healthy", {}))
        self.voted_out &= ~back

    def _hold_to_limits(self, end: int, calm: NDArray[np.bool_], rest: NDArray[np.bool_]) -> None:
        """Names the unit whose error is no sound unit's, by those without it."""
        active = self._active(float(self.time[end - 1]) + HOP)
        motion = self.test.means.motion.mean()[SCALES.index(BLOCK), :, :MOTION]
        odd = self.limits.found(self.errors, motion, active & calm, rest)
        for run in np.nonzero(odd >= 0)[0]:
            self.voted_out[run, odd[run]] = True
            self._name(run, odd[run], float(self.time[end - 1]) + HOP, "out of limits")
            self.beyond[run, odd[run]] = True

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
        for run in np.nonzero((odd > 0) & enough)[0]:
            for unit in range(self.units):
                if odd[run] >> unit & 1:
                    self.voted_out[run, unit] = True
                    self._name(run, unit, now, "out of family")
        worst = np.where(judged[None, :, :, None], comparison.ratio, 0.0).max(axis=(0, 3))
        self.disputing = np.where(worst > 1.0, self.disputing + 1, 0)
        dwell = np.where(enough, DWELL[1], DWELL[0])[:, None]
        for run, pair in zip(*np.nonzero(self.disputing >= dwell), strict=True):
            if np.isnan(self.disputed_since[run]):
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
        # A unit with a large constant error still links the others to one another.
        usable = self.whole[step] & (active | self.beyond)
        weight = (usable & usable[:, :1]).astype(float)
        if step % OTHER_RATE == 0:
            difference = self.reading[step, :, :, 3:] - self.reading[step, :, :1, 3:]
            self.begun.information.add_rate(self.motion[step, :, 3:6], difference, weight)
        if (step + 1) % FORCE_WINDOWS == 0:
            since = slice(step + 1 - FORCE_WINDOWS, step + 1)
            mean = self.motion[since].mean(axis=0)
            lever = levers(mean[:, 9:12], mean[:, 12:])
            reading = self.reading[since].mean(axis=0)
            whole = (self.whole[since].all(axis=0) & (active | self.beyond)).astype(float)
            difference = reading[..., :3] - reading[:, :1, :3] - self.errors.bilinear(lever)
            self.begun.information.add_force(mean[:, :3], lever, difference, whole * whole[:, :1])

    def _commit(self, end: int) -> None:
        """Learns the block before, where it and this one agreed."""
        done = self.begun
        done.noise = self.test.taken()
        seconds = BLOCK * HOP
        if (block := self.waiting) is not None:
            calm = (block.calm & done.calm)[:, None] & block.active & done.active
            calm &= ~self.voted_out[:, :1] | self.beyond[:, :1]
            # Readings of other times are no errors, but where nothing moves.
            timed = calm & (block.timed | block.rest[:, None])
            self.learnt |= timed.any(axis=1)
            before = self.errors
            self.errors = before.walked(seconds).informed(block.information, timed.astype(float))
            self.test.means.move(before, self.errors)
            # A rest is known a second after it began.
            motion = block.motion & done.motion
            # Noise of motion is none of a rest, which would let it fall.
            pairs = calm[:, self.test.first] & calm[:, self.test.second]
            self.test.learn(block.noise, seconds, pairs & motion[:, None])
            has_moved = self.own.kinds[0][..., 0] > 0.0
            self.own.learn(seconds, calm, motion, block.rest)
            self.rests.learn(calm)
            self._hold_to_limits(end, timed, block.rest)
            self.aliased.learn(seconds, calm, motion, has_moved)
        self.own.end_block()
        self.waiting, self.begun = done, self._block()


def flown(
    runs: Sequence[Sequence[Samples]],
    errors: Errors | None = None,
    velocities: Velocities | None = None,
    *,
    statements: Sequence[Statement] | None = None,
    find_delays: bool = True,
) -> list[Flown]:
    """Flies runs of equal length, of each the samples of all units, primary first; velocities aid two."""
    time = grid(runs[0])
    stated = [Statement() for _ in runs[0]] if statements is None else statements
    if statements is not None:
        runs = [[each.turned(unit) for each, unit in zip(stated, run, strict=True)] for run in runs]
    # Runs of one flight share the samples of all units but the faulty one, and so their windows.
    means: dict[tuple[int, int], UnitWindows] = {}
    sigmas: dict[tuple[int, int], FloatArray] = {}
    for run in runs:
        for unit in run:
            if (pair := (id(run[0]), id(unit))) in means:
                continue
            if unit is run[0] or not find_delays:
                means[pair], sigmas[pair] = averaged(unit, time), np.zeros(len(time))
            else:
                means[pair], sigmas[pair], _ = clock.synchronised(means[id(run[0]), id(run[0])], unit, time)
    windows = [beside([means[id(run[0]), id(unit)] for unit in run], time, run) for run in runs]
    delayed = np.stack(
        [np.column_stack([sigmas[id(run[0]), id(unit)] for unit in run]) for run in runs], axis=1
    )
    known_errors = first_errors(stated, len(runs)) if errors is None else errors
    return Monitor(windows, known_errors, clock.BEGINS if find_delays else BEGINS, velocities, delayed).fly()
