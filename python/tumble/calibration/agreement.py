"""Agreement of what a calibration file states twice: angles with M, sigmas with the covariance.

People read angles and sigmas, and certificates state them; corrections and references use M and covariance. A
file in which they differ was edited, and nobody knows which of them holds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tumble import _core
from tumble.foundation.error_decomposition import PAIRS, factor_sigma, factors, non_orthogonality
from tumble.foundation.recording import FloatArray

if TYPE_CHECKING:
    from tumble.calibration.document import Angles, NonOrthogonality, Sigma, TriadCalibration

_ANGLE = 1e-6
"""deg, largest difference between an angle and that in M: rounding of angles typed with nine digits."""
_SIGMA = 1e-6
"""Largest difference between a sigma and that of the covariance, relative."""
_EXACT = 1e-9
"""Sigma below which a number counts as exact: derivatives round by as much; the unit of the number."""
_CORRELATION = 1e-6
"""Asymmetry, and negative eigenvalue, of correlations typed with ten digits."""


def refuse_disagreement(triad: TriadCalibration) -> None:
    """Raises `ValueError`, naming the key, where a section states one thing twice and differently."""
    if triad.covariance is not None:
        _refuse_no_covariance("covariance", triad.covariance)
    if triad.inherited is not None:
        _refuse_no_covariance("inherited.covariance", triad.inherited.covariance)
        _refuse_other_sigma("inherited.", triad.inherited.sigma, triad.M, triad.inherited.covariance)
    if triad.sigma is not None and (total := triad.total_covariance) is not None:
        _refuse_other_sigma("", triad.sigma, triad.M, total)
    if triad.angles is not None:
        _refuse_other_angles(triad.angles, triad.M)


def _refuse_no_covariance(key: str, covariance: FloatArray) -> None:
    """Raises `ValueError` where a matrix (12, 12) with gaps is the covariance of no quantities."""
    variance = np.diag(covariance)
    known = np.isfinite(variance)
    inner = covariance[np.ix_(known, known)]
    if (variance[known] < 0.0).any():
        raise ValueError(f"{key} has a negative variance, {variance[known].min():.3g}; check its diagonal")
    sigma = np.where(variance[known] > 0.0, np.sqrt(variance[known]), 1.0)
    correlation = inner / sigma / sigma[:, None]
    if not np.isfinite(correlation).all():
        raise ValueError(f"{key} has a gap between two known variances; check its rows")
    if np.abs(correlation - correlation.T).max(initial=0.0) > _CORRELATION:
        raise ValueError(f"{key} is not symmetric; check its rows")
    if len(correlation) and np.linalg.eigvalsh(correlation)[0] < -_CORRELATION:
        raise ValueError(f"{key} has a negative eigenvalue, as that of no quantities; check its rows")


def _refuse_other_sigma(prefix: str, sigma: Sigma, matrix: FloatArray, covariance: FloatArray) -> None:
    """Raises `ValueError` for a sigma that is not that of the covariance (12, 12) of M row by row and b."""
    of_factors = factor_sigma(matrix, covariance[:9, :9])
    degrees = np.degrees(of_factors[3:])
    for key, stated, expected in (
        ("bias", sigma.bias, np.sqrt(np.diag(covariance)[9:])),
        ("scale", sigma.scale, of_factors[:3]),
        ("non-orthogonality", _of_pairs(sigma.non_orthogonality), degrees[:3]),
        ("mounting", sigma.mounting, degrees[3:]),
    ):
        known = np.isfinite(stated) & np.isfinite(expected)
        other = known & ~np.isclose(stated, expected, rtol=_SIGMA, atol=_EXACT)
        if other.any():
            first = int(np.argmax(other))
            raise ValueError(
                f"{prefix}sigma.{key} is {stated[first]:.6g}, and that of {prefix}covariance is "
                f"{expected[first]:.6g}; give the sigmas of the covariance"
            )


def _refuse_other_angles(angles: Angles, matrix: FloatArray) -> None:
    """Raises `ValueError` for angles that are not those of the sensing axes in M."""
    skew = _of_pairs(angles.non_orthogonality)
    expected = np.degrees(non_orthogonality(matrix))
    far = np.abs(skew - expected) > _ANGLE
    if far.any():
        first = int(np.argmax(far))
        raise ValueError(
            f"angles.non-orthogonality is {skew[first]:.6g} deg, and that in M is {expected[first]:.6g} deg; "
            "edit M alone and leave K, L, Q, angles out"
        )
    if not np.isfinite(angles.mounting).all():
        return
    turned = _core.rotation_matrix(np.radians(angles.mounting)) @ factors(matrix)[2].T
    error = float(np.degrees(np.arccos(np.clip((np.trace(turned) - 1.0) / 2.0, -1.0, 1.0))))
    if np.abs(turned - np.eye(3)).max() > np.radians(_ANGLE):
        raise ValueError(
            f"angles.mounting is {error:.6g} deg from that in M; edit M alone and leave K, L, Q, angles out"
        )


def _of_pairs(angles: NonOrthogonality) -> FloatArray:
    values = (getattr(angles, pair) for pair in PAIRS)
    return np.array([np.nan if value is None else value for value in values])
