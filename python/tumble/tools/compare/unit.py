"""Parameters of a calibration: M and b of its triads as one vector, with its covariance."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

import numpy as np

from tumble.calibration.document import Calibration, TriadCalibration
from tumble.foundation.error_decomposition import PAIRS, factor_jacobian, propagated
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CALIBRATED_TRIADS, CalibratedTriad

OF_A_TRIAD = 12
"""Elements of [M row by row, b]."""
PLACES: Mapping[CalibratedTriad, slice] = {
    triad: slice(OF_A_TRIAD * k, OF_A_TRIAD * (k + 1)) for k, triad in enumerate(CALIBRATED_TRIADS)
}
"""Places of a triad's parameters among the 36 of a unit."""
_STEP = 1e-6


@dataclass(frozen=True, slots=True)
class UnitModel:
    """`y = M u + b` of all triads, and how well each number is known."""

    label: str
    triads: tuple[CalibratedTriad, ...]
    """Those that were calibrated."""
    stated: frozenset[CalibratedTriad]
    """Those without any uncertainty: their numbers are taken as they are."""
    values: FloatArray
    """(36,) [M row by row, b] of accelerometer, gyroscope and magnetometer; ideal where one was not
    calibrated."""
    covariance: FloatArray
    """(36, 36); NaN for what is not observable, zero for what is stated."""
    response: FloatArray | None
    """(3, 3) g-sensitivity, rad/s per m/s^2; None where the calibration does not contain it."""
    response_sigma: FloatArray
    """(3, 3) 1-sigma of it."""
    current: FloatArray | None
    """(3,) effect of current on the magnetometer; None where the calibration does not contain it."""
    current_sigma: FloatArray
    """(3,) 1-sigma of it."""
    current_unit: str
    """Unit of both."""

    def matrix(self, triad: CalibratedTriad) -> FloatArray:
        """(3, 3) M."""
        return self.values[PLACES[triad]][:9].reshape(3, 3)

    def bias(self, triad: CalibratedTriad) -> FloatArray:
        """(3,) b."""
        return self.values[PLACES[triad]][9:]

    def says_nothing_of(self, triad: CalibratedTriad) -> bool:
        """Returns whether a triad has neither values nor statements."""
        return triad not in self.triads


def unit_model(
    calibration: Calibration, label: str, inherited: Collection[CalibratedTriad] = ()
) -> UnitModel:
    """Gathers a calibration; its covariance contains the inherited part of the triads `inherited`."""
    sections = {
        triad: section
        for triad in CALIBRATED_TRIADS
        if (section := getattr(calibration, triad)) is not None and _is_calibrated(section)
    }
    values = np.tile(np.concatenate([np.eye(3).ravel(), np.zeros(3)]), len(CALIBRATED_TRIADS))
    # Calibration files keep no covariance between the triads.
    covariance = np.zeros((len(values), len(values)))
    for place in PLACES.values():
        covariance[place, place] = np.nan
    for triad, section in sections.items():
        values[PLACES[triad]] = np.concatenate([section.M.ravel(), section.b])
        own = _covariance(section)
        if triad in inherited and section.inherited is not None:
            own = own + section.inherited.covariance  # compare.md, eq. 13
        covariance[PLACES[triad], PLACES[triad]] = own
    gyroscope = calibration.gyroscope
    response = None if gyroscope is None else gyroscope.g_sensitivity
    sigma = None if gyroscope is None else gyroscope.g_sensitivity_sigma
    magnetometer = calibration.magnetometer
    current = None if magnetometer is None else magnetometer.current
    current_sigma = None if magnetometer is None else magnetometer.current_sigma
    return UnitModel(
        label=label,
        triads=tuple(sections),
        stated=frozenset(triad for triad, section in sections.items() if _is_stated(section)),
        values=values,
        covariance=covariance,
        response=response,
        response_sigma=np.zeros((3, 3)) if sigma is None else sigma,
        current=current,
        current_sigma=np.zeros(3) if current_sigma is None else current_sigma,
        current_unit="" if magnetometer is None else magnetometer.unit_of_current,
    )


def jacobian(function: Callable[[FloatArray], FloatArray], at: FloatArray) -> FloatArray:
    """(m, n) derivatives of (m,) by (n,) numbers of about one."""
    steps = _STEP * np.eye(len(at))
    columns = [(function(at + step) - function(at - step)) / (2.0 * _STEP) for step in steps]
    found: FloatArray = np.array(columns).T
    return found


def _is_calibrated(section: TriadCalibration) -> bool:
    """Returns whether it is more than a placeholder for noise or temperature drift, as `noise` writes."""
    ideal = np.array_equal(section.M, np.eye(3)) and not section.b.any()
    return not (ideal and _is_stated(section))


def _is_stated(section: TriadCalibration) -> bool:
    return section.covariance is None and section.sigma is None


def _covariance(section: TriadCalibration) -> FloatArray:
    """(12, 12) of [M row by row, b]; from sigmas alone where the file has no more."""
    if section.covariance is not None:
        return section.covariance
    if section.sigma is None:
        held = [not section.estimated or group in section.estimated for group in ("matrix", "bias")]
        return np.diag(np.where(np.repeat(held, (9, 3)), 0.0, np.nan))
    angles = section.sigma.non_orthogonality
    pairs = [np.nan if (angle := getattr(angles, pair)) is None else angle for pair in PAIRS]
    sigmas = np.concatenate([section.sigma.scale, np.radians([*pairs, *section.sigma.mounting])])
    inverse = np.asarray(np.linalg.inv(factor_jacobian(section.M)), np.float64)
    found = np.zeros((OF_A_TRIAD, OF_A_TRIAD))
    found[:9, :9] = propagated(inverse, np.diag(sigmas**2))
    found[9:, 9:] = np.diag(section.sigma.bias**2)
    return found
