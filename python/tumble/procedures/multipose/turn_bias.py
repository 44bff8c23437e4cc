"""The gyroscope's bias in turns against that at rest: one that zeroes itself at rest has two.

Method: docs/theory/multipose.md, section 13.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tumble import _core
from tumble.foundation.recording import Chunk, FloatArray

UNKNOWNS = 12
"""Elements of [M row by row, b]."""
LEAST_FREEDOM = 3
"""Residuals less unknowns, below which the scatter of turns is not known."""
CHANCE = 1e-6
"""Chance of a larger difference in a sound session, below which the bias is not one."""
STEPS = 400
"""Parts of a turn in which rates are taken for constant, for the response to a bias alone."""
SHOWN = 1e-9
"""Share of the largest singular value from which a combination of unknowns is shown."""

Samples = Callable[[int, int], Chunk]
"""Samples from a first one up to the one after the last, as the fit had them."""


@dataclass(frozen=True, slots=True)
class TurnBias:
    """Bias that turns show less that of rests."""

    difference: FloatArray
    """(3,) rad/s."""
    sigma: FloatArray
    """(3,) rad/s, 1-sigma, as turns scatter."""
    chance: float
    """Chance of a larger difference, were it zero."""

    @property
    def contradicts(self) -> bool:
        """Returns whether turns and rests have two biases."""
        return self.chance < CHANCE

    def sentence(self) -> str:
        """Names the difference and what makes one."""
        axis = int(np.argmax(np.abs(self.difference) / self.sigma))
        apart = (
            f"{1e3 * self.difference[axis]:+.2g} ± {1e3 * self.sigma[axis]:.1g} mrad/s about {'xyz'[axis]}"
        )
        return (
            f"the gyroscope reads otherwise in turns than at rest, by {apart}: it zeroes itself at rest, or "
            "has a dead band; its bias cannot be found from rests"
        )


def turn_bias(figures: _core.MultiposeFigures, time: FloatArray, samples: Samples) -> TurnBias | None:
    """Fits the turns alone, and compares their bias with that of the rests; None where they do not show it.

    `time` are the stamps of the fit, s.
    """
    gyroscope = figures["gyroscope"]
    if gyroscope is None or 2 * len(gyroscope["turns"]) < UNKNOWNS + LEAST_FREEDOM:
        return None
    calibration = gyroscope["calibration"]
    rests = len(figures["poses"]["force"])
    residuals, sigmas = calibration["residuals"], calibration["residual_sigmas"]
    turns = [_turn(figures, k, time, samples) for k in range(len(gyroscope["turns"]))]
    correction = np.asarray(np.linalg.inv(calibration["M"]), dtype=np.float64)
    rows, left = [], []
    for k, turn in enumerate(turns, start=rests):
        scale = turn.duration * sigmas[k][0]
        rows.append(turn.across @ turn.response(correction) / scale)
        left.append(turn.across @ correction @ residuals[k] * turn.duration / scale)  # eq. 42
    return _difference(np.vstack(rows), np.concatenate(left), residuals[:rests])


def turn_widening(figures: _core.MultiposeFigures) -> float:
    """Returns the factor by which turns are off beyond noise and a bias that varies; 1 where they are not."""
    gyroscope = figures["gyroscope"]
    if gyroscope is None or gyroscope["turn_excess"] == 0.0:
        return 1.0
    rests, times = len(figures["poses"]["force"]), figures["acquired"].rest_times
    sigmas = gyroscope["calibration"]["residual_sigmas"][rests:]
    durations = np.array([times[after, 0] - times[before, 1] for before, after in gyroscope["turns"]])
    variance = float(np.median((sigmas[:, 0] * durations) ** 2))
    excess = gyroscope["turn_excess"] ** 2
    return math.sqrt(variance / max(variance - excess, 1e-6 * variance))


def _difference(rows: FloatArray, left: FloatArray, of_rests: FloatArray) -> TurnBias | None:
    """Returns the bias that whitened residuals (n,) of turns show less the mean (k, 3) of those of rests."""
    size = np.linalg.svd(rows, compute_uv=False)
    freedom = len(left) - UNKNOWNS
    if size[-1] < SHOWN * size[0]:
        return None
    known = np.linalg.inv(rows.T @ rows)
    change = -known @ rows.T @ left
    rest = left + rows @ change
    scatter = float(rest @ rest) / freedom
    of_mean = np.var(of_rests, axis=0, ddof=1) / len(of_rests)
    difference = change[9:] - of_rests.mean(axis=0)
    covariance = scatter * known[9:, 9:] + np.diag(of_mean)  # eq. 43
    square = float(difference @ np.linalg.solve(covariance, difference))
    # Student's square as a chi-square: its own distribution where turns are many, and no smaller chance else.
    chance = _core.chi_square_tail(freedom * math.log1p(square / freedom), 3.0)  # eq. 44
    return TurnBias(difference, np.sqrt(np.diag(covariance)), chance)


@dataclass(frozen=True, slots=True)
class _Turn:
    """A turn, of which the gyroscope's true rate is known in (n,) parts."""

    duration: float
    rates: FloatArray
    """(n, 3) rad/s."""
    steps: FloatArray
    """(n,) s."""
    up: FloatArray
    """(3,) unit vector at the end, case frame."""

    @property
    def across(self) -> FloatArray:
        """(2, 3) two directions across up."""
        directions: FloatArray = np.linalg.svd(self.up[None])[2][1:]
        return directions

    def response(self, correction: FloatArray) -> FloatArray:
        """(3, 12) derivative of the rotation vector at the end by [M row by row, b], eq. 13."""
        to_end = np.empty((len(self.steps), 3, 3))
        here = np.eye(3)
        for k in range(len(self.steps) - 1, -1, -1):
            angle = self.rates[k] * self.steps[k]
            to_end[k] = here @ _core.rotation_matrix(-0.5 * angle)
            here = here @ _core.rotation_matrix(-angle)
        found = np.empty((3, UNKNOWNS))
        for column in range(3):
            weighted = np.einsum("n,nij->ij", self.rates[:, column] * self.steps, to_end) @ correction
            found[:, column:9:3] = weighted
        found[:, 9:] = np.einsum("n,nij->ij", self.steps, to_end) @ correction
        return found


def _turn(figures: _core.MultiposeFigures, k: int, time: FloatArray, samples: Samples) -> _Turn:
    gyroscope = figures["gyroscope"]
    assert gyroscope is not None
    calibration = gyroscope["calibration"]
    before, after = gyroscope["turns"][k]
    first, last = turn_span(figures, before, time)
    chunk = samples(first, last + 1)
    rates = chunk.gyroscope - calibration["b"]
    felt = calibration.get("g_sensitivity")
    if felt is not None:
        force = figures["accelerometer"]
        rates -= (chunk.accelerometer - force["b"]) @ np.linalg.inv(force["M"]).T @ felt.T
    rates = rates @ np.linalg.inv(calibration["M"]).T
    steps = np.diff(chunk.time)
    angles = 0.5 * (rates[1:] + rates[:-1]) * steps[:, None]
    parts = np.unique(np.linspace(0, len(steps), min(len(steps), STEPS) + 1).astype(int)[:-1])
    lengths = np.maximum(np.add.reduceat(steps, parts), 1e-9)
    up = figures["poses"]["force"][after]
    return _Turn(
        duration=float(chunk.time[-1] - chunk.time[0]),
        rates=np.add.reduceat(angles, parts, axis=0) / lengths[:, None],
        steps=lengths,
        up=up / np.linalg.norm(up),
    )


def turn_span(figures: _core.MultiposeFigures, before: int, time: FloatArray) -> tuple[int, int]:
    """Returns the first and last sample of the turn after a rest."""
    rests = figures["acquired"].rest_times
    # Segments know their times to the microsecond.
    first, last = np.searchsorted(time, [rests[before, 1] - 1e-6, rests[before + 1, 0] - 1e-6])
    return int(first), min(int(last), len(time) - 1)
