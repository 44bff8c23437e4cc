"""One simulated session: what the procedure found, how wrong it was, and how wrong anybody has to be."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

import tumble
from benchmarks.bound import (
    Bound,
    NoiseCovariance,
    accelerometer_bound,
    attitudes_of,
    gyroscope_bound,
    parts,
)
from benchmarks.noise import IntArray, covariance_of_means
from benchmarks.settings import Cell
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadResult
from tumble.tools.simulate import (
    SimulatedTurntable,
    SimulatedUnit,
    TriadGrade,
    TriadTruth,
    simulate_turntable,
)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Errors of one triad, twelve parameters each: bias, scale, non-orthogonality, mounting; SI and rad."""

    error: FloatArray
    """Found less true."""
    sigma: FloatArray
    """Sigma that the procedure states."""
    reach: FloatArray
    """Half the 95 % interval the procedure states."""
    bound: FloatArray
    """Cramer-Rao, 1-sigma."""
    best: FloatArray
    """Error of the efficient estimate on the same data: its variance is the square of the bound."""


@dataclass(frozen=True, slots=True)
class Intervals:
    """Successive intervals of one unit by sample: `first[k] ... last[k] - 1`."""

    first: IntArray
    last: IntArray
    samples: int
    interval: float
    """s of the session between samples."""

    @property
    def seconds(self) -> FloatArray:
        """(k,) s of the session that the samples stand for."""
        seconds: FloatArray = np.float64(self.interval) * (self.last - self.first)
        return seconds

    def covariance(self, grade: TriadGrade, rate: float, unstable: bool) -> FloatArray:
        """Covariance of the means of one axis."""
        return _covariance(
            tuple(self.first.tolist()),
            tuple(self.last.tolist()),
            self.samples,
            grade.noise_density**2 * rate,
            grade.bias_instability if unstable else 0.0,
        )

    def means(self, readings: FloatArray) -> FloatArray:
        """(k, 3) means of (n, 3) readings."""
        sums = np.vstack([np.zeros(3), np.cumsum(readings, axis=0)])
        means: FloatArray = (sums[self.last] - sums[self.first]) / (self.last - self.first)[:, None]
        return means


@lru_cache(maxsize=64)
def _covariance(
    first: tuple[int, ...], last: tuple[int, ...], samples: int, white: float, instability: float
) -> FloatArray:
    return covariance_of_means(np.array(first), np.array(last), samples, white, instability)


def run(cell: Cell, session: int) -> dict[str, Outcome]:
    """Simulates and calibrates one session."""
    played = simulate_turntable(cell.scenario(session))
    found = tumble.turntable(played.reference, played.targets, clock=cell.clocks, jobs=1).targets[0]
    if found.accelerometer is None or found.gyroscope is None:
        raise RuntimeError(f"{cell.name}, seed {cell.seed(session)}: {found.failure}")
    target = played.target_units[0]
    accelerometer, force_noise = _accelerometer(played)
    gyroscope, rate_noise = _gyroscope(played)
    return {
        "accelerometer": outcome_of(found.accelerometer, target.accelerometer, accelerometer, force_noise),
        "gyroscope": outcome_of(found.gyroscope, target.gyroscope, gyroscope, rate_noise),
    }


def outcome_of(found: TriadResult, true: TriadTruth, bound: Bound, noise: FloatArray) -> Outcome:
    """Compares estimates with the truth, and with the efficient estimate on the same noise."""
    estimated = parts(found.M, found.b)
    stated = np.array([p.sigma for p in found.parameters])
    reach = np.array([0.5 * (p.high - p.low) for p in found.parameters])
    # Angles are reported in degrees, after bias and scale.
    stated[6:], reach[6:] = np.radians(stated[6:]), np.radians(reach[6:])
    truth = np.concatenate([true.b + true.drift, np.diag(true.K), true.non_orthogonality, true.mounting])
    return Outcome(estimated - truth, stated, reach, bound.sigma, bound.gain @ noise.ravel())


def intervals_of(played: SimulatedTurntable, unit: SimulatedUnit, turns: bool) -> Intervals:
    """Returns the true rests, then the turns between them where asked for, by samples of the unit."""
    starts = [rest.start for rest in played.rests]
    ends = [rest.end for rest in played.rests]
    if turns:
        starts, ends = starts + ends[:-1], ends + starts[1:]
    rate = played.scenario.rate_of(unit.name)
    samples = len(unit.samples)
    ticks = rate * (1.0 + unit.clock.skew * 1e-6)

    def index(times: list[float]) -> IntArray:
        periods = (np.array(times) - unit.clock.phase / rate) * ticks
        # Rounding must not move a sample that falls on the very boundary.
        return np.clip(np.ceil(periods - 1e-6).astype(np.int64), 0, samples)

    return Intervals(index(starts), index(ends), samples, 1.0 / ticks)


def _both(
    played: SimulatedTurntable, triad: str, turns: bool
) -> tuple[NoiseCovariance, FloatArray, FloatArray]:
    """Covariance of the means, and the means (k, 3) of reference and target."""
    covariances, means = [], []
    for unit in played.units:
        intervals = intervals_of(played, unit, turns)
        grade: TriadGrade = getattr(unit.grade, triad)
        rate = played.scenario.rate_of(unit.name)
        covariances.append(intervals.covariance(grade, rate, played.scenario.bias_instability))
        means.append(intervals.means(getattr(unit.samples, triad)))
    return NoiseCovariance(*covariances), means[0], means[1]


def _accelerometer(played: SimulatedTurntable) -> tuple[Bound, FloatArray]:
    forces = np.array([rest.specific_force for rest in played.rests])
    seen, felt = (unit.accelerometer for unit in played.units)
    return accelerometer_of(*_both(played, "accelerometer", turns=False), forces, seen, felt)


def accelerometer_of(
    covariance: NoiseCovariance,
    reference: FloatArray,
    target: FloatArray,
    forces: FloatArray,
    seen: TriadTruth,
    felt: TriadTruth,
) -> tuple[Bound, FloatArray]:
    """Returns the bound and the noise of means (k, 3) over rests with true `forces` (k, 3)."""
    noise = np.vstack(
        [reference - forces - seen.b - seen.drift, target - forces @ felt.M.T - felt.b - felt.drift]
    )
    return accelerometer_bound(felt.M, felt.b, forces, covariance), noise


def _gyroscope(played: SimulatedTurntable) -> tuple[Bound, FloatArray]:
    seen, felt = (unit.gyroscope for unit in played.units)
    forces = np.array([rest.specific_force for rest in played.rests])
    earth = np.array([rest.angular_rate for rest in played.rests])
    seconds, own_seconds = (intervals_of(played, unit, turns=True).seconds for unit in played.units)
    stretch = (seconds / own_seconds)[len(forces) :]
    return gyroscope_of(*_both(played, "gyroscope", turns=True), forces, earth, stretch, seen, felt)


def gyroscope_of(
    covariance: NoiseCovariance,
    reference: FloatArray,
    target: FloatArray,
    forces: FloatArray,
    earth: FloatArray,
    stretch: FloatArray,
    seen: TriadTruth,
    felt: TriadTruth,
) -> tuple[Bound, FloatArray]:
    """Bound and the noise of means over rests, then turns; `earth` (k, 3) rad/s is felt at rests."""
    rests = len(forces)
    # The true angle of a turn is unknown to the estimate, so it may be counted from what the reference saw.
    turn_rates = reference[rests:] - seen.b - seen.drift
    of_target = np.vstack([earth, stretch[:, None] * turn_rates])
    noise = np.vstack(
        [
            reference[:rests] - earth - seen.b - seen.drift,
            np.zeros_like(turn_rates),
            target - of_target @ felt.M.T - felt.b - felt.drift,
        ]
    )
    attitudes = attitudes_of(forces, earth)
    return gyroscope_bound(felt.M, felt.b, attitudes, earth[0], turn_rates, stretch, covariance), noise


PIECE_SAMPLES = 20
"""Samples of a turn that are taken together where a turn is seen sample by sample: a tenth of a second."""


def share_of_information_in_integrals(cell: Cell, session: int) -> FloatArray:
    """(12,) bound from single samples of the turns over that from their integrals, gyroscope.

    Single samples can only be used where the clocks and bandwidths of both units are known exactly.
    """
    played = simulate_turntable(cell.scenario(session))
    whole = intervals_of(played, played.target_units[0], turns=True)
    rests = len(played.rests)
    starts = [
        np.arange(first, last, PIECE_SAMPLES)
        for first, last in zip(whole.first[rests:], whole.last[rests:], strict=True)
    ]
    first = np.concatenate([whole.first[:rests], *starts])
    last = np.concatenate([whole.last[:rests], *(start + PIECE_SAMPLES for start in starts)])
    pieces = Intervals(first, last, whole.samples, whole.interval)
    return _bound_of_partition(played, pieces).sigma / _bound_of_partition(played, whole).sigma


def _bound_of_partition(played: SimulatedTurntable, intervals: Intervals) -> Bound:
    """Bounds of the gyroscope for rests, then pieces of turns of both units."""
    covariance = NoiseCovariance(
        *(
            intervals.covariance(unit.grade.gyroscope, played.scenario.rate_of(unit.name), False)
            for unit in played.units
        )
    )
    seen, felt = played.reference_unit, played.target_units[0].gyroscope
    forces = np.array([rest.specific_force for rest in played.rests])
    earth = np.array([rest.angular_rate for rest in played.rests])
    rates = intervals.means(seen.samples.gyroscope)[len(forces) :] - seen.gyroscope.b
    attitudes = attitudes_of(forces, earth)
    return gyroscope_bound(felt.M, felt.b, attitudes, earth[0], rates, np.ones(len(rates)), covariance)
