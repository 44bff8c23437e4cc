"""Knowledge of the errors of secondaries: one Gaussian a sensor, to which motion adds information.

    y_j = M_j (x + W r_j) + b_j     accelerometer: x specific force at the primary's place
    y_j = M_j x + b_j               gyroscope: x angular rate

Parameters are differences from a perfect unit: rows `[M - 1 | b]` of the gyroscope, which share one
covariance (4, 4), and `[M - 1 | b | r]` of the accelerometer, 15. Leading axes of all arrays are runs and
units. Unit 0 is the primary, of which nothing is unknown: errors are relative to it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tumble.foundation.recording import FloatArray

GYROSCOPE_SIGMA = 0.012
"""rad/s: noise of a difference of two units over a window that counts as independent."""
ACCELEROMETER_SIGMA = 0.1
"""m/s^2: the same over the mean of `FORCE_WINDOWS`."""
FORCE_WINDOWS = 10
"""Windows of a mean of specific force: vibration dilutes the scale of shorter ones."""
WALK = (1e-3, 7e-5)
"""m/s^2 and rad/s by which biases walk in a root second, 1 sigma."""
ARM = slice(12, 15)
BIAS = slice(9, 12)


@dataclass(frozen=True, slots=True)
class Grade:
    """Sigmas of the errors of a unit before any motion is seen."""

    matrix: float
    gyroscope_bias: float
    """rad/s."""
    accelerometer_bias: float
    """m/s^2."""
    arm: float
    """m."""


UNCALIBRATED = Grade(0.03, 0.042, 0.6, 0.12)
"""Nothing stored: the difference of two parts of consumer grade, mounted by hand."""
STORED = Grade(0.002, 0.002, 0.04, 0.01)
"""Added to the stored covariance: change from one flight to the next."""


@dataclass(frozen=True, slots=True)
class Errors:
    """Mean and covariance of all parameters of all units of all runs."""

    rate: FloatArray
    """(b, n, 3, 4) rows of [M - 1 | b], rad/s."""
    rate_covariance: FloatArray
    """(b, n, 4, 4) of each row."""
    force: FloatArray
    """(b, n, 15) M - 1 by rows, b m/s^2, r m."""
    force_covariance: FloatArray
    """(b, n, 15, 15)."""

    def walked(self, seconds: float) -> Errors:
        """Returns them after a time: biases of secondaries have walked."""
        return self.aged(Grade(0.0, WALK[1] * np.sqrt(seconds), WALK[0] * np.sqrt(seconds), 0.0))

    def aged(self, grade: Grade) -> Errors:
        """Returns them with the variances of a grade added."""
        rate, force = self.rate_covariance.copy(), self.force_covariance.copy()
        rate[:, 1:] += np.diag(_rate_sigmas(grade) ** 2)
        force[:, 1:] += np.diag(_force_sigmas(grade) ** 2)
        return replace(self, rate_covariance=rate, force_covariance=force)

    def informed(self, information: Information, chosen: FloatArray) -> Errors:
        """Adds information where `chosen` (b, n) is 1: that of least squares with this prior."""
        some = np.asarray(chosen)[:, 1:, None, None]
        rate_cov, rate = _updated(
            self.rate_covariance[:, 1:],
            self.rate[:, 1:].swapaxes(-1, -2),
            some * information.rate[:, 1:],
            some * information.rate_sum[:, 1:].swapaxes(-1, -2),
        )
        force_cov, force = _updated(
            self.force_covariance[:, 1:],
            self.force[:, 1:, :, None],
            some * information.force[:, 1:],
            some * information.force_sum[:, 1:, :, None],
        )
        found = Errors(
            *(each.copy() for each in (self.rate, self.rate_covariance, self.force, self.force_covariance))
        )
        found.rate[:, 1:], found.rate_covariance[:, 1:] = rate.swapaxes(-1, -2), rate_cov
        found.force[:, 1:], found.force_covariance[:, 1:] = force[..., 0], force_cov
        return found

    def rate_error(self, rate: FloatArray) -> FloatArray:
        """Error (..., b, n, 3) rad/s of each unit at angular rates (..., b, 1, 3)."""
        return np.asarray(np.sum(self.rate[..., :3] * rate[..., None, :], axis=-1) + self.rate[..., 3])

    def rate_variance(self, rate: FloatArray) -> FloatArray:
        """Variance (..., b, n) of that of each axis at rates (..., b, 3): phi' C phi."""
        phi = np.concatenate([rate, np.ones((*rate.shape[:-1], 1))], axis=-1)
        phi = phi[..., None, None, :]
        return np.asarray(np.sum((phi @ self.rate_covariance) * phi, axis=(-1, -2)))

    def force_error(self, force: FloatArray, lever: FloatArray) -> FloatArray:
        """Error (..., b, n, 3) m/s^2 of each unit at forces (..., b, 1, 3) and levers (..., b, 1, 3, 3)."""
        matrix = self.force[..., :9].reshape(*self.force.shape[:-1], 3, 3)
        carried = np.sum(lever * self.force[..., None, ARM], axis=-1)
        turned = np.sum(matrix * (force + carried)[..., None, :], axis=-1)
        return np.asarray(turned + carried + self.force[..., BIAS])

    def both(self, motion: FloatArray) -> FloatArray:
        """Errors (b, n, 6) m/s^2 and rad/s of each unit along motions (b, 18) of the set."""
        lever = levers(motion[:, 9:12], motion[:, 12:])
        force = self.force_error(motion[:, None, :3], lever[:, None])
        return np.concatenate([force, self.rate_error(motion[:, None, 3:6])], axis=-1)

    def bilinear(self, lever: FloatArray) -> FloatArray:
        """Returns (M - 1) W r (b, n, 3) m/s^2 at levers (b, 3, 3): no linear part of the parameters."""
        matrix = self.force[..., :9].reshape(*self.force.shape[:-1], 3, 3)
        carried = np.sum(lever[:, None] * self.force[..., None, ARM], axis=-1)
        return np.asarray(np.sum(matrix * carried[..., None, :], axis=-1))

    def force_variance(self, force: FloatArray, lever: FloatArray) -> FloatArray:
        """Variance (..., b, n, 3) of that at forces (..., b, 3) and levers (..., b, 3, 3)."""
        design = force_design(force, lever)[..., None, :, :]
        return np.asarray(np.sum((design @ self.force_covariance) * design, axis=-1))


@dataclass(frozen=True, slots=True)
class Information:
    """Sums of the normal equations since a time, over the variance of the noise."""

    rate: FloatArray
    """(b, n, 4, 4)."""
    rate_sum: FloatArray
    """(b, n, 3, 4)."""
    force: FloatArray
    """(b, n, 15, 15)."""
    force_sum: FloatArray
    """(b, n, 15)."""

    @classmethod
    def none(cls, runs: int, units: int) -> Information:
        """No information."""
        shapes = ((4, 4), (3, 4), (15, 15), (15,))
        return cls(*(np.zeros((runs, units, *shape)) for shape in shapes))

    def add_rate(self, rate: FloatArray, difference: FloatArray, weight: FloatArray) -> None:
        """Adds windows: rates (b, 3) of the set, secondary minus primary (b, n, 3), weights (b, n)."""
        phi = np.concatenate([rate, np.ones((len(rate), 1))], axis=-1)
        scaled = weight / GYROSCOPE_SIGMA**2
        self.rate[...] += scaled[:, :, None, None] * (phi[:, :, None] * phi[:, None])[:, None]
        self.rate_sum[...] += scaled[:, :, None, None] * difference[..., None] * phi[:, None, None]

    def add_force(
        self, force: FloatArray, lever: FloatArray, difference: FloatArray, weight: FloatArray
    ) -> None:
        """Adds means: forces (b, 3), levers (b, 3, 3), secondary minus primary (b, n, 3), weights (b, n)."""
        design = force_design(force, lever)
        scaled = weight / ACCELEROMETER_SIGMA**2
        square = design.swapaxes(-1, -2) @ design
        self.force[...] += scaled[:, :, None, None] * square[:, None]
        self.force_sum[...] += scaled[:, :, None] * np.einsum("bij,bni->bnj", design, difference)


def nothing_known(runs: int, units: int, grade: Grade = UNCALIBRATED) -> Errors:
    """Returns the errors of units of a grade, of which nothing is stored."""
    none = Errors(
        np.zeros((runs, units, 3, 4)),
        np.zeros((runs, units, 4, 4)),
        np.zeros((runs, units, 15)),
        np.zeros((runs, units, 15, 15)),
    )
    return none.aged(grade)


def levers(change: FloatArray, product: FloatArray) -> FloatArray:
    """Returns W (..., 3, 3) 1/s^2 = [w']x + [w]x[w]x of w' (..., 3) and products (..., 6) of rates."""
    x, y, z = np.moveaxis(change, -1, 0)
    xx, yy, zz, xy, xz, yz = np.moveaxis(product, -1, 0)
    rows = [[-(yy + zz), xy - z, xz + y], [xy + z, -(xx + zz), yz - x], [xz - y, yz + x, -(xx + yy)]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def force_design(force: FloatArray, lever: FloatArray) -> FloatArray:
    """Returns the derivative (..., 3, 15) of an accelerometer's error by its parameters."""
    design = np.zeros((*force.shape[:-1], 3, 15))
    for axis in range(3):
        design[..., axis, 3 * axis : 3 * axis + 3] = force
        design[..., axis, 9 + axis] = 1.0
    design[..., ARM] = lever
    return design


def _rate_sigmas(grade: Grade) -> FloatArray:
    return np.array([*[grade.matrix] * 3, grade.gyroscope_bias])


def _force_sigmas(grade: Grade) -> FloatArray:
    return np.array([*[grade.matrix] * 9, *[grade.accelerometer_bias] * 3, *[grade.arm] * 3])


def _updated(
    covariance: FloatArray, mean: FloatArray, information: FloatArray, total: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Returns covariance (..., k, k) and mean (..., k, m) with information added.

    (P^-1 + L)^-1 = (1 + P L)^-1 P needs no inverse of a covariance that may be singular.
    """
    identity = np.eye(covariance.shape[-1])
    found = np.linalg.solve(identity + covariance @ information, covariance)
    found = 0.5 * (found + found.swapaxes(-1, -2))
    return found, mean + found @ (total - information @ mean)
