"""Detection of a clock that was set within a session, by the turns that both units felt."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tumble import _core
from tumble.acquisition.imu import Imu
from tumble.acquisition.stamps import MILLISECONDS
from tumble.foundation.log_time import LogTime
from tumble.foundation.recording import FloatArray

PARTS_PER_MILLION = 1e6

LARGEST_SKEW = 1e-3
"""Largest skew of two clocks, without unit: a thousand ppm, the worst of oscillators."""

SMALLEST_ANGLE = 0.3
"""rad: the centre of a smaller turn is uncertain."""
SMALLEST_MONOTONY = 0.8
"""Least angle over the length of its path: a turn there and back has no centre."""
SMALLEST_SIGMA = 3e-4
"""s: rounding of stamps, and errors of the model, move a centre as far."""
MARGIN = 0.5
"""s of the rests beside a turn that are taken with it: both units may be cut elsewhere."""
LATENCY = 5e-3
"""s: smaller steps, and scatter, are the latency of a logger."""
SET = 0.02
"""s: larger steps are no latency; a smaller one matters if it changes a scale by its sigma."""

FALSE_ALARM = 1e-3
"""Chance of a step that scatter alone shows."""
FEWEST_TURNS = 4
"""Turns from which offset, skew and step leave scatter to compare with."""
KNOWN_FREEDOM = 4
"""Degrees of freedom by which the scatter is known beforehand to be the sigmas'."""


@dataclass(frozen=True, slots=True)
class Delays:
    """Turns that both units felt."""

    time: FloatArray
    """(k,) centres of the turns, s of the clock of the reference."""
    delay: FloatArray
    """(k,) centres by the clock of the target less these, s."""
    sigma: FloatArray
    """(k,) 1-sigma, s."""


@dataclass(frozen=True, slots=True)
class ClockStep:
    """A clock that was set between two turns."""

    size: float
    """s, by which it was set forward."""
    before: float
    """s of the clock of the reference: centre of the last turn before."""
    behind: float
    """The same of the first turn behind."""
    skew: float
    """Skew of the clocks, without unit, beside the step."""


@dataclass(frozen=True, slots=True)
class TimedTurns:
    """Clock of a target, held against the turns that both units felt."""

    clock: _core.ClockFigures
    delays: Delays
    step: ClockStep | None
    """The step that the delays show; None where there is none."""
    scale_sigma: float
    """Least 1-sigma of a scale of the gyroscope."""
    time: LogTime
    """Clock of the log of the reference."""

    @classmethod
    def of(cls, reference: Imu, unit: Imu, figures: _core.TargetFigures) -> TimedTurns:
        """Returns those of a target; none where it has a file for each pose, or no gyroscope."""
        clock, gyroscope, time = figures["clock"], figures["gyroscope"], reference.log.time
        nothing = np.empty(0)
        if gyroscope is None or unit.recording.parts:
            return cls(clock, Delays(nothing, nothing, nothing), None, math.inf, time)
        sigma = float(np.sqrt(np.diag(gyroscope["covariance"])[[0, 4, 8]].min()))
        delays = turn_delays(reference, unit, figures)
        return cls(clock, delays, found_step(delays), sigma, time)

    def objections(self) -> Iterator[str]:
        """Describes a clock that times no turn right: one that was set, or of a pace that turns deny."""
        if self.step is not None and self._matters(self.step):
            yield self._step_words(self.step)
        elif abs(self.clock["skew"]) > LARGEST_SKEW and not lies_on_a_line(self.delays):
            yield f"{self._skew_words()}, and its turns do not confirm that: was the clock set? Record again"

    def warnings(self) -> Iterator[str]:
        """Reports a small step, and a clock that runs evenly and faster or slower than any oscillator."""
        if self.step is not None:
            if not self._matters(self.step) and abs(self.step.size) > LATENCY:
                yield self._step_words(self.step)
        elif abs(self.clock["skew"]) > LARGEST_SKEW and lies_on_a_line(self.delays):
            yield (
                f"{self._skew_words()}; its turns confirm that, and the fit includes it: check the sample "
                "rate or the unit of time of its log"
            )

    def _matters(self, step: ClockStep) -> bool:
        return abs(step.size) > SET or abs(self._apart(step)) > self.scale_sigma

    def _apart(self, step: ClockStep) -> float:
        """Error of the skew, without unit, that a step leaves where it is not known."""
        return 0.0 if self.clock["shared"] else self.clock["skew"] - step.skew

    def _step_words(self, step: ClockStep) -> str:
        apart = self._apart(step)
        scale = (
            f", which was taken for a pace of {PARTS_PER_MILLION * apart:+.0f} ppm and is in the "
            "gyroscope's scale"
            if apart
            else ""
        )
        return (
            f"its clock was set by {MILLISECONDS * step.size:+.3g} ms against that of the reference, at "
            f"some time in {self.time.span(step.before, step.behind)} s{scale}; record again with a clock "
            "that nothing sets"
        )

    def _skew_words(self) -> str:
        return (
            f"its clock runs {PARTS_PER_MILLION * self.clock['skew']:+.0f} ppm apart from that of the "
            f"reference, and those of oscillators by {PARTS_PER_MILLION * LARGEST_SKEW:.0f} at most"
        )


def turn_delays(reference: Imu, unit: Imu, figures: _core.TargetFigures) -> Delays:
    """Returns how much later, by its own clock, a target felt each turn than the reference.

    Both centres are weighted by the rate about one axis, that of the reference. From rest to rest the
    means of a trace have the centre of the samples (docs/theory/turntable.md, eq. 16).
    """
    gyroscope = figures["gyroscope"]
    seen, felt = reference.acquired, unit.acquired
    rows: list[tuple[float, float, float]] = []
    if gyroscope is not None:
        ours, theirs = Rates.of(seen, np.eye(3)), Rates.of(felt, _inverse(gyroscope["M"]))
        density = float(np.hypot(np.max(seen.noise_density[3:]), np.max(felt.noise_density[3:])))
        for (k, _, last), (after, first, _) in pairwise(figures["pairs"]):
            if (
                after != k + 1
                or first != last + 1
                or not (seen.turn_complete[k] and felt.turn_complete[last])
            ):
                continue
            turn = ours.turn(k)
            same = theirs.turn(last)
            angle = float(np.linalg.norm(turn.whole()))
            if angle < max(SMALLEST_ANGLE, SMALLEST_MONOTONY * turn.path()):
                continue
            axis = turn.whole() / angle
            sigma = density * turn.duration**1.5 / (math.sqrt(12.0) * angle)
            rows.append((turn.centre(axis), same.centre(axis), math.hypot(sigma, SMALLEST_SIGMA)))
    table = np.array([row for row in rows if np.all(np.isfinite(row))]).reshape(-1, 3)
    return Delays(table[:, 0], table[:, 1] - table[:, 0], table[:, 2])


@dataclass(frozen=True, slots=True)
class TurnRates:
    """Angular rate from the last of a rest to the first of the next, free of bias."""

    time: FloatArray
    """(n,) s."""
    length: FloatArray
    """(n,) s for which each rate holds."""
    rate: FloatArray
    """(n, 3) rad/s, case frame of the reference."""
    duration: float
    """s, of all of it."""

    def whole(self) -> FloatArray:
        """Integral (3,) of the rate, rad."""
        whole: FloatArray = self.length @ self.rate
        return whole

    def path(self) -> float:
        """Length of the path, rad."""
        return float(self.length @ np.linalg.norm(self.rate, axis=1))

    def centre(self, axis: FloatArray) -> float:
        """Time weighted by the rate about an axis, s; NaN where there is no turn about it."""
        weight = self.length * (self.rate @ axis)
        whole = float(weight.sum())
        return float(self.time @ weight) / whole if whole > 0.0 else math.nan


@dataclass(frozen=True, slots=True)
class Rates:
    """Angular rate of a unit over its recording."""

    unit: _core.Acquired
    time: FloatArray
    """(n,) s from the first point."""
    zero: float
    """s of the clock, of the first point."""
    rate: FloatArray
    """(n, 3) rad/s."""
    into_case: FloatArray
    """(3, 3) case of the reference from readings."""

    @classmethod
    def of(cls, unit: _core.Acquired, into_case: FloatArray) -> Rates:
        """Returns those of what was acquired."""
        time, _, rate = unit.trace()
        return cls(unit, time - time[0], float(time[0]), rate, into_case)

    def turn(self, before: int) -> TurnRates:
        """Returns the turn behind a rest; from one bias to the next the change is even."""
        rests = self.unit.rest_times[before : before + 2] - self.zero
        margins = np.minimum(MARGIN, 0.5 * np.diff(rests).ravel())
        start, end = float(rests[0, 1] - margins[0]), float(rests[1, 0] + margins[1])
        within = slice(*np.searchsorted(self.time, (start, end)))
        time = self.time[within]
        share = np.clip((time - rests[0, 1]) / max(rests[1, 0] - rests[0, 1], 1e-9), 0.0, 1.0)[:, None]
        first, then = self.unit.rest_angular_rate[before : before + 2]
        rate = (self.rate[within] - (first + share * (then - first))) @ self.into_case.T
        length = np.gradient(time) if len(time) > 1 else np.zeros(len(time))
        return TurnRates(self.zero + time, length, rate, end - start)


def found_step(delays: Delays) -> ClockStep | None:
    """Finds the one step beside offset and skew that explains the delays; None where scatter explains them.

    A turn within which the clock was set is on neither side. The place with most evidence
    is compared with no step, by Student's t (docs/theory/turntable.md, eq. 62).
    """
    count = len(delays.time)
    if count < FEWEST_TURNS:
        return None
    best: tuple[float, ClockStep] | None = None
    places = [(k, k + left_out) for left_out in (0, 1) for k in range(1, count - left_out)]
    for end, start in places:
        kept = np.ones(count, dtype=bool)
        kept[end:start] = False
        freedom = int(kept.sum()) - 3
        if freedom < 1:
            continue
        behind = (np.arange(count) >= start).astype(float)[:, None]
        without, _ = _fitted(delays, np.zeros((count, 0)), kept)
        squares, solution = _fitted(delays, behind, kept)
        freedom += KNOWN_FREEDOM
        scatter = max((squares + KNOWN_FREEDOM) / freedom, 1.0)
        certain = _core.student_quantile(1.0 - 0.5 * FALSE_ALARM / len(places), freedom)
        evidence = math.sqrt(max(without - squares, 0.0) / scatter) / certain
        if best is None or evidence > best[0]:
            last, first = float(delays.time[end - 1]), float(delays.time[start])
            best = evidence, ClockStep(float(solution[2]), last, first, float(solution[1]))
    return best[1] if best is not None and best[0] > 1.0 else None


def lies_on_a_line(delays: Delays) -> bool:
    """Returns whether offset and skew explain the delays of turns, and there are enough to show that."""
    count = len(delays.time)
    if count < FEWEST_TURNS:
        return False
    squares, _ = _fitted(delays, np.zeros((count, 0)), np.ones(count, dtype=bool))
    rms = math.sqrt(squares / float(np.sum(delays.sigma**-2.0)) * count / (count - 2))
    return rms < LATENCY


def _fitted(delays: Delays, more: FloatArray, kept: np.ndarray) -> tuple[float, FloatArray]:
    """Chi-square of offset, skew and `more` (k, m) columns, and their values, by weighted least squares."""
    regressors = np.column_stack([np.ones(len(kept)), delays.time - delays.time.mean(), more])[kept]
    weight = 1.0 / delays.sigma[kept]
    solution = np.linalg.lstsq(regressors * weight[:, None], delays.delay[kept] * weight, rcond=None)[0]
    residuals = (delays.delay[kept] - regressors @ solution) * weight
    return float(residuals @ residuals), solution


def _inverse(matrix: FloatArray) -> FloatArray:
    """Inverse (3, 3) of M; columns that no turn showed have their nominal values."""
    inverse: FloatArray = np.linalg.pinv(matrix).astype(np.float64)
    return inverse
