"""The calibration of a secondary: its error against the primary, combined with the primary's own calibration.

The secondary was found to read `y_s = M_r y_p + b_r` where the primary reads `y_p`, and the primary reads
`y_p = M_p u + b_p` where the truth is u, in the primary's case frame. So `y_s = M_r M_p u + (M_r b_p + b_r)`:
the file of the secondary leads to the primary's case frame, with the mounting of one against the other in Q,
and specific force is that at the secondary's own place. Where the primary has no calibration it is the truth.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from tumble.calibration.document import Calibration
from tumble.calibration.triad_content import factors_content, sigma_content
from tumble.foundation.error_decomposition import propagated
from tumble.foundation.errors import ProcedureError
from tumble.foundation.plain import finite_or_none, plain
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import UNITS
from tumble.procedures.redundancy.result import RedundancyResult, SecondaryError, Sensor

_STIMULI: dict[Sensor, str] = {"accelerometer": "specific force along", "gyroscope": "angular rate about"}


def calibration_of(result: RedundancyResult, unit: str) -> Calibration:
    """Creates the calibration file of a secondary.

    It corrects the secondary's readings into the case frame of the primary. A triad without a stored error is
    left out.

    Raises `ProcedureError` where the secondary has no stored error.
    """
    errors = [error for error in result.errors if error.unit == unit]
    if not errors:
        raise ProcedureError(f"{unit}: has no stored error, so there is no calibration to save")
    return Calibration.model_validate(_content(result, unit, errors, result.applied))


def _content(
    result: RedundancyResult, unit: str, errors: Sequence[SecondaryError], primary: Mapping[str, Any]
) -> dict[str, Any]:
    """Content of the file; `primary` is that of the primary's own calibration, or empty."""
    content: dict[str, Any] = {
        "name": unit,
        "serial": result.serials.get(unit, ""),
        "software": result.software,
        **result.provenance.content(),
        "reading": result.readings.get(unit) or None,
        "method": {
            "procedure": "redundancy",
            "truth": f"readings of {result.primary}{', calibrated' if primary else ''}",
            "options": {
                "frame": f"case of {result.primary}",
                **{error.sensor: _fit_figures(error) for error in errors},
            },
        },
        "reference": {
            "name": result.primary,
            "serial": result.serials.get(result.primary, ""),
            "calibration_hash": result.calibration_hash,
        },
        "gravity": {"value": result.settings["gravity"], "source": "setting gravity"},
    }
    for error in errors:
        content[error.sensor] = _section(error, primary.get(error.sensor, {}), result.primary)
    return content


def _fit_figures(error: SecondaryError) -> dict[str, object]:
    figures: dict[str, object] = {
        "fit_model": error.fit_model,
        "directions": error.directions,
        "pairs": error.pairs,
        "sequence": error.sequence,
        "residual": finite_or_none(error.residual),
        "residual_before": finite_or_none(error.residual_before),
    }
    if error.lever_arm is not None and error.lever_arm_sigma is not None:
        sigma = [finite_or_none(float(value)) for value in error.lever_arm_sigma]
        figures |= {"lever_arm": plain(error.lever_arm), "lever_arm_sigma": sigma}
    return figures


def _section(error: SecondaryError, primary: Mapping[str, Any], primary_name: str) -> dict[str, Any]:
    """One triad; eq. as in the head of this file."""
    first_matrix = np.array(primary.get("M", np.eye(3)), dtype=np.float64)
    first_bias = np.array(primary.get("b", np.zeros(3)), dtype=np.float64)
    matrix, bias = error.matrix @ first_matrix, error.matrix @ first_bias + error.bias
    covariance = _covariance(error, first_matrix, first_bias, primary.get("covariance"))
    seen = np.isfinite(np.diag(covariance))
    groups = [name for name, part in (("bias", seen[9:]), ("matrix", seen[:9])) if part.all()]
    content: dict[str, Any] = {
        "unit": UNITS[error.sensor],
        "M": matrix,
        "b": bias,
        "sigma": sigma_content(matrix, covariance),
        "estimated": tuple(groups),
        "unobservable": tuple(_unobservable(error.sensor, seen, primary, primary_name)),
        "rank": int(seen.sum()),
    }
    if "matrix" in groups:
        # K, L and Q of a matrix that was shown in part would be numbers nobody measured.
        content |= factors_content(matrix)
    if "g_sensitivity" in primary:
        content["g_sensitivity"] = error.matrix @ np.array(primary["g_sensitivity"], dtype=np.float64)
    return content


def _covariance(
    error: SecondaryError, first_matrix: FloatArray, first_bias: FloatArray, first: object
) -> FloatArray:
    """(12, 12) of [M row by row, b]; NaN where nothing is known. The errors of M_r and b_r count as apart."""
    identity = np.eye(3)
    of_relation = np.zeros((12, 12))
    of_relation[:9, :9] = np.kron(identity, first_matrix.T)
    of_relation[9:, :9] = np.kron(identity, first_bias[None])
    of_relation[9:, 9:] = identity
    variance = np.concatenate([error.matrix_sigma.ravel(), error.bias_sigma]) ** 2
    covariance = propagated(of_relation, np.diag(variance))
    if first is None:
        return covariance
    of_primary = np.zeros((12, 12))
    of_primary[:9, :9] = np.kron(error.matrix, identity)
    of_primary[9:, 9:] = error.matrix
    return covariance + propagated(of_primary, np.array(first, dtype=np.float64))


def _unobservable(
    sensor: Sensor, seen: np.typing.NDArray[np.bool_], primary: Mapping[str, Any], primary_name: str
) -> Iterator[str]:
    """Describes unobservable parameters in words."""
    stimulus = _STIMULI[sensor]
    shown = seen[:9].reshape(3, 3)
    lacking = [column for column in range(3) if not shown[:, column].any()]
    for column in lacking:
        yield f"response to {stimulus} case axis {'xyz'[column]}: the motion did not show it"
    for row, column in np.argwhere(~shown):
        if column not in lacking:
            yield f"response of axis {'xyz'[row]} to {stimulus} case axis {'xyz'[column]}"
    for row in np.flatnonzero(~seen[9:]):
        yield f"bias of axis {'xyz'[row]}"
    if not primary:
        yield f"errors of the {sensor} of the primary {primary_name} itself: it is assumed to be right"
    elif "covariance" not in primary:
        yield f"how far the calibration of the primary {primary_name} is right: its file does not say"
    for line in primary.get("unobservable", ()):
        yield f"of the primary {primary_name}: {line}"
