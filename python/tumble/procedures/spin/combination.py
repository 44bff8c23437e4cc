"""Several spins of one IMU: one bias, if they agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import Parameter, TriadName
from tumble.foundation.units import UNITS
from tumble.procedures.spin.result import BiasEstimate, Spin

UNLIKELY = 0.001
"""Chance of a chi-square beyond the gate, were all spins of one bias."""
ROWS: dict[TriadName, slice] = {"accelerometer": slice(0, 3), "gyroscope": slice(3, 6)}
"""Where each triad stands in the covariance of a spin."""


@dataclass(frozen=True, slots=True)
class CombinedBiases:
    """Biases combined over all spins that agree."""

    accelerometer_bias: BiasEstimate
    gyroscope_bias: BiasEstimate
    covariance: FloatArray
    """(6, 6) of [accelerometer bias, gyroscope bias]; NaN where not observable; without that of gravity."""
    agreement: Parameter
    warnings: tuple[str, ...]

    def with_gravity(self, up: FloatArray, sigma: float) -> CombinedBiases:
        """Give them with the share of an uncertain gravity, m/s^2, which all spins have in common."""
        return replace(self, accelerometer_bias=self.accelerometer_bias.with_gravity(up, sigma))


@dataclass(frozen=True, slots=True)
class _TriadWeights:
    """Weights of the spins for one triad."""

    weights: FloatArray
    """(n, 3, 3) for each spin; zero where it does not show the bias."""
    chi_square: float
    freedom: int
    warning: str


def combine(spins: Sequence[Spin]) -> CombinedBiases:
    """Weighs each spin by its information; where they contradict each other, the last one counts.

    Each triad is judged by itself: the bias of a gyroscope wanders, and the accelerometers need not suffer.
    """
    weighed = {triad: _weigh(spins, triad) for triad in ROWS}
    covariance = _covariance(spins, weighed)
    return CombinedBiases(
        _estimate(spins, "accelerometer", weighed["accelerometer"], covariance),
        _estimate(spins, "gyroscope", weighed["gyroscope"], covariance),
        covariance,
        _agreement(
            sum(each.chi_square for each in weighed.values()), sum(each.freedom for each in weighed.values())
        ),
        tuple(each.warning for each in weighed.values() if each.warning),
    )


def bias_of(spin: Spin, triad: TriadName) -> BiasEstimate:
    """Returns the bias of one triad that a spin found."""
    return spin.accelerometer_bias if triad == "accelerometer" else spin.gyroscope_bias


def _weigh(spins: Sequence[Spin], triad: TriadName) -> _TriadWeights:
    rows = ROWS[triad]
    shown = [k for k, spin in enumerate(spins) if bias_of(spin, triad).observable]
    weights = np.zeros((len(spins), 3, 3))
    if not shown:
        return _TriadWeights(weights, 0.0, 0, "")
    values = np.array([bias_of(spins[k], triad).value for k in shown])
    information = np.array([np.linalg.inv(spins[k].covariance[rows, rows]) for k in shown])
    weights[shown] = np.linalg.solve(information.sum(axis=0), information)
    mean = np.einsum("kij,kj->i", weights[shown], values)
    off = values - mean
    chi_square = float(np.einsum("ki,kij,kj->", off, information, off))
    freedom = 3 * (len(shown) - 1)
    if freedom == 0 or chi_square <= _core.chi_square_quantile(UNLIKELY, freedom):
        return _TriadWeights(weights, chi_square, freedom, "")
    weights[:] = 0.0
    weights[shown[-1]] = np.eye(3)
    furthest = int(np.argmax(np.linalg.norm(off, axis=1)))
    apart = float(np.linalg.norm(values[furthest] - values[-1 if furthest + 1 < len(shown) else 0]))
    unit = UNITS[triad]
    return _TriadWeights(
        weights,
        chi_square,
        freedom,
        f"the spins contradict each other by up to {apart:.2g} {unit} in the {triad} bias (chi-square "
        f"{chi_square:.3g} for {freedom}), as when it warms up; the result is the last, "
        f"{spins[shown[-1]].label}",
    )


def _covariance(spins: Sequence[Spin], weighed: dict[TriadName, _TriadWeights]) -> FloatArray:
    covariance = np.zeros((6, 6))
    for k, spin in enumerate(spins):
        weight = np.zeros((6, 6))
        for triad, rows in ROWS.items():
            weight[rows, rows] = weighed[triad].weights[k]
        # An unobservable parameter has no weight, so that the place of its NaN is irrelevant.
        covariance += weight @ (np.nan_to_num(spin.covariance) - _by_earth(spin)) @ weight.T
    rate = ROWS["gyroscope"]
    by_earth = sum(
        each @ _root(spin.by_earth) for each, spin in zip(weighed["gyroscope"].weights, spins, strict=True)
    )
    covariance[rate, rate] += by_earth @ np.transpose(by_earth)  # spin.md, eq. 6f
    for triad, rows in ROWS.items():
        if not weighed[triad].weights.any():
            covariance[rows, :] = np.nan
            covariance[:, rows] = np.nan
    return covariance


def _by_earth(spin: Spin) -> FloatArray:
    """(6, 6) share of the Earth's rotation in the covariance of a spin."""
    share = np.zeros((6, 6))
    share[ROWS["gyroscope"], ROWS["gyroscope"]] = spin.by_earth
    return share


def _root(covariance: FloatArray) -> FloatArray:
    """Symmetric root of a covariance: errors that all spins have in common do not average out."""
    values, vectors = np.linalg.eigh(covariance)
    root: FloatArray = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    return root


def _estimate(
    spins: Sequence[Spin], triad: TriadName, weighed: _TriadWeights, covariance: FloatArray
) -> BiasEstimate:
    last = bias_of(spins[-1], triad)
    if not weighed.weights.any():
        return last
    values = np.array([np.nan_to_num(bias_of(spin, triad).value) for spin in spins])
    rows = ROWS[triad]
    return BiasEstimate(
        value=np.einsum("kij,kj->i", weighed.weights, values),
        sigma=np.sqrt(np.diag(covariance)[rows]),
        observable=True,
        reason=last.reason if len(spins) == 1 else "",
    )


def _agreement(chi_square: float, freedom: int) -> Parameter:
    name = "chi-square of the spins against their mean"
    if freedom == 0:
        alone = "with a single spin there is nothing to compare"
        return Parameter(name, "1", np.nan, np.inf, np.nan, np.nan, False, alone)
    # Its ends are those between which 95 of 100 such sums lie, were all spins of one bias.
    low, high = _core.chi_square_quantile(0.975, freedom), _core.chi_square_quantile(0.025, freedom)
    return Parameter(name, "1", chi_square, float(np.sqrt(2.0 * freedom)), low, high)
