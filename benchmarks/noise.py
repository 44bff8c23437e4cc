"""Covariance of means over intervals of the noise that the simulator makes, from its law, in numpy alone.

White noise of density N scatters a sample by `N sqrt(rate)`. Bias instability B is a sum of first-order
Gauss-Markov processes of variance `B^2 ln 4 / pi` each, with correlation times 4, 16, 64 ... samples up to 16
times the recording (Keshner, "1/f noise", Proc. IEEE 70, 1982).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tumble.foundation.recording import FloatArray

IntArray = NDArray[np.int64]


def covariance_of_means(
    first: IntArray, last: IntArray, samples: int, white_variance: float, instability: float
) -> FloatArray:
    """(k, k) covariance of the means over the samples `first[k] ... last[k] - 1`, which do not overlap.

    Each is taken against what the truth calls bias: the mean over all samples of the instability alone.
    """
    lengths = (last - first).astype(np.float64)
    covariance: FloatArray = np.diag(white_variance / lengths)
    if instability > 0.0:
        variance = instability**2 * np.log(4.0) / np.pi
        starts, ends = np.append(first, 0), np.append(last, samples)
        raw = sum(variance * _means(starts, ends, decay) for decay in _decays(samples))
        centring = np.hstack([np.eye(len(first)), -np.ones((len(first), 1))])
        covariance = covariance + centring @ raw @ centring.T
    return covariance


def _decays(samples: int) -> FloatArray:
    times = 4.0 ** np.arange(1, 40)
    decays: FloatArray = np.exp(-1.0 / times[times < 16.0 * samples])
    return decays


def _means(starts: IntArray, ends: IntArray, decay: float) -> FloatArray:
    """Covariance of means of a process of unit variance: variances of sums and the polarisation identity."""
    s, e = starts.astype(np.float64), ends.astype(np.float64)
    # cov(sum over [a, b), sum over [c, d)) = (V(d - a) + V(b - c) - V(c - a) - V(d - b)) / 2
    apart = (
        _variance_of_sum(e[None, :] - s[:, None], decay)
        + _variance_of_sum(e[:, None] - s[None, :], decay)
        - _variance_of_sum(s[None, :] - s[:, None], decay)
        - _variance_of_sum(e[None, :] - e[:, None], decay)
    )
    return 0.5 * apart / np.outer(e - s, e - s)


def _variance_of_sum(length: FloatArray, decay: float) -> FloatArray:
    """V(m): variance of the sum of m successive samples of autocorrelation decay^|lag|; even in m."""
    m = np.abs(length)
    whole = m * (1.0 + decay) / (1.0 - decay)
    return whole - 2.0 * decay * (1.0 - decay**m) / (1.0 - decay) ** 2
