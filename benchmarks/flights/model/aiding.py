"""Two hypotheses where two units disagree: each unit alone explains a velocity from outside, or it does not.

A filter a unit holds attitude, velocity, biases, and the delay of the aiding measurement, 13 errors, and is
updated by means of velocity over successive spans. The unit with the larger innovations is wrong. The heading
is unknown at first: filters begin with several, and those that explain the first seconds best go on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.recording import FloatArray

SPAN = 0.5
"""s over which a position gives a mean velocity."""
HEADINGS = 12
"""Headings that are tried."""
SIGMAS = {"tilt": 0.2, "heading": 0.25, "velocity": 0.5, "gyroscope": 0.02, "force": 0.4, "delay": 0.1}
"""rad, rad, m/s, rad/s, m/s^2, s, of what is known at first."""
NOISE = (0.06, 2e-3)
"""m/s^2 and rad/s over a root hertz: what windows leave of vibration."""
WALK = (5e-4, 5e-5)
"""m/s^2 and rad/s in a root second."""
MEASURED = 0.12
"""m/s, 1 sigma of an axis of a mean velocity of a position in steps of 0.1 m."""
CLIPPED = 27.0
"""Largest term of an innovation."""
CHOOSING = 4.0
"""s after which one heading goes on."""
USUAL_SHARE = 0.1
"""Share of a new measurement in what is usual."""
DECIDED = 6.0
"""Logarithm of the ratio of likelihoods beyond which one of two units is wrong."""
EARLIER = 0.4
"""s before units disagree from which on evidence counts."""
ATTITUDE, VELOCITY, RATE_BIAS, FORCE_BIAS, DELAY = (
    slice(0, 3),
    slice(3, 6),
    slice(6, 9),
    slice(9, 12),
    slice(12, 13),
)
ERRORS = 13
UP = np.array([0.0, 0.0, STANDARD_GRAVITY])


@dataclass(frozen=True, slots=True)
class Velocities:
    """Means of velocity over successive spans, level axes, z up."""

    end: FloatArray
    """(m,) s."""
    value: FloatArray
    """(m, 3) m/s."""
    span: float
    """s."""
    sigma: float
    """m/s of an axis."""


def of_positions(time: FloatArray, position: FloatArray) -> Velocities:
    """Returns mean velocities of positions (n, 3) m, north, east, down, at times (n,) s."""
    if len(time) < 2:
        return Velocities(np.zeros(0), np.zeros((0, 3)), SPAN, MEASURED)
    edges = np.arange(float(time[0]), float(time[-1]), SPAN)
    at = np.column_stack([np.interp(edges, time, column) for column in position.T])
    return Velocities(edges[1:], np.diff(at, axis=0) / SPAN * [1.0, -1.0, -1.0], SPAN, MEASURED)


@dataclass(slots=True)
class Evidence:
    """Terms of one measurement: how badly each of two units explains it."""

    time: float
    """s, the end of its span."""
    terms: FloatArray
    """(b, 2) innovations squared over their usual size, 3 on average."""


class TwoHypotheses:
    """Filters of both units of all runs, and the logarithm of the ratio of their likelihoods."""

    def __init__(self, velocities: Velocities, runs: int) -> None:
        """Begins before the first sample."""
        self.velocities, self.runs = velocities, runs
        self.next = 0
        self.filters: Navigation | None = None
        self.headings = HEADINGS
        self.misfit = np.zeros((HEADINGS, runs, 2))
        self.usual = np.full((runs, 2), 3.0)
        self.evidence: list[Evidence] = []
        self.first_force: list[FloatArray] = []

    def advance(self, now: float, force: FloatArray, rate: FloatArray, step: float) -> None:
        """Goes on by a step, s, to a time, s, with forces and rates (b, 2, 3) as both units read them."""
        ends = self.velocities.end
        if self.next >= len(ends):
            return
        if self.filters is None:
            self.first_force.append(force)
            if now >= ends[self.next]:
                self._begin(self.velocities.value[self.next])
                self.next += 1
            return
        tiled = [np.tile(each.reshape(-1, 3), (self.headings, 1)) for each in (force, rate)]
        self.filters.advance(tiled[0], tiled[1], step)
        if now >= ends[self.next]:
            self._measure(float(ends[self.next]), self.velocities.value[self.next])
            self.next += 1

    def _begin(self, velocity: FloatArray) -> None:
        force = np.mean(self.first_force, axis=0).reshape(-1, 3)
        count = len(force)
        heading = np.repeat(np.arange(HEADINGS) * 2.0 * np.pi / HEADINGS, count)
        tiled = np.tile(force, (HEADINGS, 1))
        self.filters = Navigation(tiled, np.tile(velocity, (len(tiled), 1)), heading)

    def _measure(self, time: float, velocity: FloatArray) -> None:
        assert self.filters is not None
        given = np.tile(velocity, (len(self.filters.velocity), 1))
        squares = self.filters.measure(given, self.velocities.span, self.velocities.sigma)
        squares = squares.reshape(self.headings, self.runs, 2)
        if self.headings > 1:
            self.misfit += squares
            if time - float(self.velocities.end[0]) > CHOOSING:
                self._choose()
            return
        terms = 3.0 * squares[0] / self.usual
        self.evidence.append(Evidence(time, terms))

    def _choose(self) -> None:
        """Goes on with the heading that explains both units best."""
        assert self.filters is not None
        best = np.argmin(self.misfit.sum(axis=2), axis=0)
        count = self.runs * 2
        self.filters.chosen(np.repeat(best, 2) * count + np.arange(count))
        self.headings = 1

    def learn(self, calm: NDArray[np.bool_]) -> None:
        """Takes the latest measurement as usual, of runs (b,) whose units agree."""
        if not self.evidence or not calm.any():
            return
        latest = self.evidence[-1].terms * self.usual / 3.0
        moved = np.maximum(self.usual + USUAL_SHARE * (latest - self.usual), 3.0)
        self.usual = np.where(calm[:, None], moved, self.usual)

    def logarithm(self, since: FloatArray) -> FloatArray:
        """Returns the logarithm (b,) of the likelihood that the second unit is right over that of the first.

        One measurement alone decides nothing: 0 until there are two.
        """
        found, count = np.zeros(self.runs), np.zeros(self.runs)
        for each in self.evidence:
            found += np.where(each.time > since, 0.5 * (each.terms[:, 0] - each.terms[:, 1]), 0.0)
            count += each.time > since
        return np.asarray(np.where(count > 1, found, 0.0))


class Navigation:
    """Filters of any number of units (m,): `of` is what each begins with."""

    def __init__(self, force: FloatArray, velocity: FloatArray, heading: FloatArray) -> None:
        """Begins with gravity as specific force (m, 3), a velocity (m, 3), and a heading (m,) rad."""
        self.attitude = _levelled(force, heading)
        self.velocity = velocity.copy()
        count = len(force)
        self.rate_bias, self.force_bias = np.zeros((count, 3)), np.zeros((count, 3))
        self.delay = np.zeros(count)
        sigmas = np.array(
            [
                *[SIGMAS["tilt"]] * 2,
                SIGMAS["heading"],
                *[SIGMAS["velocity"]] * 3,
                *[SIGMAS["gyroscope"]] * 3,
                *[SIGMAS["force"]] * 3,
                SIGMAS["delay"],
            ]
        )
        self.covariance = np.tile(np.diag(sigmas**2), (count, 1, 1))
        self.acceleration = np.zeros((count, 3))
        self.sum, self.sum_acceleration, self.steps = np.zeros((count, 3)), np.zeros((count, 3)), 0

    def chosen(self, which: NDArray[np.int64]) -> None:
        """Goes on with some of the filters."""
        for name in (
            "attitude",
            "velocity",
            "rate_bias",
            "force_bias",
            "delay",
            "covariance",
            "acceleration",
        ):
            setattr(self, name, getattr(self, name)[which].copy())
        self.sum, self.sum_acceleration = self.sum[which].copy(), self.sum_acceleration[which].copy()

    def advance(self, force: FloatArray, rate: FloatArray, step: float) -> None:
        """Goes on by a step, s, with specific force (m, 3) and angular rate (m, 3)."""
        turn = _rotation((rate - self.rate_bias) * step)
        felt = np.einsum("mij,mj->mi", self.attitude, force - self.force_bias)
        self.acceleration = felt - UP
        self.velocity = self.velocity + step * self.acceleration
        change = np.tile(np.eye(ERRORS), (len(force), 1, 1))
        change[:, VELOCITY, ATTITUDE] = -step * _cross(felt)
        change[:, ATTITUDE, RATE_BIAS] = -step * self.attitude
        change[:, VELOCITY, FORCE_BIAS] = -step * self.attitude
        noise = np.concatenate([[NOISE[1]] * 3, [NOISE[0]] * 3, [WALK[1]] * 3, [WALK[0]] * 3, [0.0]])
        self.covariance = change @ self.covariance @ change.swapaxes(-1, -2) + np.diag(noise**2 * step)
        self.attitude = self.attitude @ turn
        self.sum += self.velocity
        self.sum_acceleration += self.acceleration
        self.steps += 1

    def measure(self, velocity: FloatArray, span: float, sigma: float) -> FloatArray:
        """Updates with the mean velocity (m, 3) since the last time: innovations squared (m,), clipped."""
        mean = self.sum / max(self.steps, 1)
        acceleration = self.sum_acceleration / max(self.steps, 1)
        self.sum, self.sum_acceleration, self.steps = np.zeros_like(mean), np.zeros_like(mean), 0
        design = np.zeros((len(mean), 3, ERRORS))
        felt = self.acceleration + UP
        # The mean is what the velocity was half a span ago.
        design[:, :, ATTITUDE] = 0.5 * span * _cross(felt)
        design[:, :, VELOCITY] = np.eye(3)
        design[:, :, FORCE_BIAS] = 0.5 * span * self.attitude
        design[:, :, 12] = -acceleration
        innovation = velocity - mean + self.delay[:, None] * acceleration
        variance = design @ self.covariance @ design.swapaxes(-1, -2) + sigma**2 * np.eye(3)
        weighted = np.linalg.solve(variance, innovation[..., None])
        square = np.sum(innovation * weighted[..., 0], axis=1)
        gain = np.linalg.solve(variance, design @ self.covariance).swapaxes(-1, -2)
        # An outlier moves the filter no more than its largest plausible innovation would.
        taper = np.sqrt(np.minimum(1.0, CLIPPED / np.maximum(square, 1e-9)))[:, None]
        found = taper * np.einsum("mij,mj->mi", gain, innovation)
        self.attitude = _rotation(found[:, ATTITUDE]) @ self.attitude
        self.velocity = self.velocity + found[:, VELOCITY]
        self.rate_bias = self.rate_bias + found[:, RATE_BIAS]
        self.force_bias = self.force_bias + found[:, FORCE_BIAS]
        self.delay = self.delay + found[:, 12]
        kept = self.covariance - gain @ design @ self.covariance
        self.covariance = 0.5 * (kept + kept.swapaxes(-1, -2))
        return np.asarray(np.minimum(square, CLIPPED))


def _cross(vector: FloatArray) -> FloatArray:
    """Returns matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    found = np.zeros((*vector.shape, 3))
    x, y, z = np.moveaxis(vector, -1, 0)
    found[..., 0, 1], found[..., 0, 2] = -z, y
    found[..., 1, 0], found[..., 1, 2] = z, -x
    found[..., 2, 0], found[..., 2, 1] = -y, x
    return found


def _rotation(vector: FloatArray) -> FloatArray:
    """Returns rotations (..., 3, 3) by vectors (..., 3) rad."""
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    cross = _cross(vector)
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    return np.asarray(np.eye(3) + first * cross + second * (cross @ cross))


def _levelled(force: FloatArray, heading: FloatArray) -> FloatArray:
    """Returns attitudes (m, 3, 3), level from body, of a body that feels gravity alone."""
    up = force / np.linalg.norm(force, axis=-1, keepdims=True)
    ahead = np.array([1.0, 0.0, 0.0]) - up * up[:, :1]
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    level = np.stack([ahead, np.cross(up, ahead), up], axis=1)
    turn = np.zeros((len(force), 3, 3))
    turn[:, 0, 0], turn[:, 0, 1] = np.cos(heading), -np.sin(heading)
    turn[:, 1, 0], turn[:, 1, 1] = np.sin(heading), np.cos(heading)
    turn[:, 2, 2] = 1.0
    return np.asarray(turn @ level)
