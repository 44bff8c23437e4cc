"""Contribution of a spin to a calibration: new biases, beside the matrices of the earlier calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tumble.calibration.contributions import NOISE, TEMPERATURE_DRIFT, part, taken_over
from tumble.calibration.document import Calibration
from tumble.foundation.gravity import GRAVITY, gravity_content, shares_gravity
from tumble.foundation.plain import plain
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadName
from tumble.foundation.units import UNITS
from tumble.foundation.words import join
from tumble.procedures.spin.result import BiasEstimate, SpinResult

_UNSEEN = "scale, non-orthogonality and mounting: a spin shows bias only"


def calibration_of(result: SpinResult) -> Calibration:
    """Creates the calibration file of a unit that was spun, on top of the calibration applied first.

    Its biases are those of the raw sensor, its matrices those applied, or none. A triad whose bias the spin
    does not show keeps the section that was applied, or has none.
    """
    return Calibration.model_validate(_content(result, result.applied))


def _content(result: SpinResult, before: Mapping[str, Any]) -> dict[str, Any]:
    content: dict[str, Any] = {
        "name": result.name,
        "serial": result.serial or before.get("serial", ""),
        "software": result.software,
        **result.provenance.content(),
        "axes": result.axes or before.get("axes"),
        "reading": result.reading or before.get("reading"),
        "verdict": result.verdict,
        "method": {"procedure": "spin", "truth": result.spins[-1].method, "options": _options(result)},
        "gravity": gravity_content(result),
    }
    if "reference" in before:
        content["reference"] = before["reference"]
    if result.temperature is not None:
        low, mean, high = result.temperature
        content["temperature"] = {"low": low, "mean": mean, "high": high}
    up = np.array(result.spins[-1].up)
    force_bias = result.accelerometer_bias
    parts: tuple[tuple[TriadName, BiasEstimate, slice, FloatArray], ...] = (
        ("accelerometer", force_bias, slice(0, 3), result.gravity * up),
        ("gyroscope", result.gyroscope_bias, slice(3, 6), np.zeros(3)),
    )
    content |= taken_over(before, [part(triad, "bias") for triad, bias, *_ in parts if bias.observable])
    for triad, bias, rows, truth in parts:
        section = dict(before.get(triad, {}))
        if bias.observable:
            found = result.covariance[rows, rows]
            content[triad] = _triad(
                triad, section, bias, found, truth, _g_sensitivity_effect(section, force_bias)
            )
            sigma = result.gravity_sigma or 0.0 if triad == "accelerometer" else 0.0
            shared = shares_gravity(before, result.gravity, result.gravity_source)
            content[triad] |= _in_common(
                content[triad], section, truth, sigma / result.gravity, shared=shared
            )
        elif section:
            content[triad] = section
    return content


def _options(result: SpinResult) -> dict[str, Any]:
    applied = {"calibration": result.calibration_hash} if result.calibration_hash else {}
    return {key: plain(value) for key, value in (result.options | applied).items()}


def _g_sensitivity_effect(section: Mapping[str, Any], force_bias: BiasEstimate) -> FloatArray:
    """Rates, rad/s, by which g-sensitivity turned an error in specific force into one of the gyroscope."""
    if "g_sensitivity" not in section or not force_bias.observable:
        return np.zeros(3)
    g_sensitivity_effect: FloatArray = np.array(section["g_sensitivity"]) @ force_bias.value
    return g_sensitivity_effect


def _triad(
    triad: TriadName,
    before: Mapping[str, Any],
    bias: BiasEstimate,
    covariance: FloatArray,
    truth: FloatArray,
    g_sensitivity_effect: FloatArray,
) -> dict[str, Any]:
    """One section; `truth` is what the triad measured at rest, which ties the new b to M.

    The old calibration left `bias`: y = M (u + bias) + b_old, so that b = b_old + M bias, besides what a
    gyroscope made of the error in specific force that was not known then.
    """
    matrix = np.array(before.get("M", np.eye(3)))
    joint = _joint_covariance(before.get("covariance"), matrix, covariance, truth)
    content = {
        "unit": UNITS[triad],
        "M": matrix,
        "b": np.array(before.get("b", np.zeros(3))) + matrix @ bias.value + g_sensitivity_effect,
        "covariance": joint,
        "sigma": _sigma(before.get("sigma"), np.sqrt(np.diag(joint)[9:])),
        "estimated": tuple(dict.fromkeys(["bias", *before.get("estimated", ())])),
        "unobservable": before.get("unobservable", (_UNSEEN,)),
    }
    kept = ("K", "L", "Q", "angles", "g_sensitivity", "g_sensitivity_sigma", *NOISE, TEMPERATURE_DRIFT)
    return content | {key: before[key] for key in kept if key in before}


def _in_common(
    content: Mapping[str, Any], before: Mapping[str, Any], truth: FloatArray, relative: float, *, shared: bool
) -> dict[str, Any]:
    """Give what the old matrix inherited, with what that and an uncertain gravity leave on the new bias.

    `relative` is the relative 1-sigma of gravity, `shared` whether the old scale rests on the same.
    """
    inherited = before.get("inherited")
    if inherited is None and relative == 0.0:
        return {}
    matrix: FloatArray = content["M"]
    old = np.zeros((12, 12)) if inherited is None else np.array(inherited["covariance"], dtype=np.float64)
    of_matrix = old[:9, :9]
    responding, along = of_matrix, relative * matrix @ truth
    if shared:
        # Scale found with the same gravity takes off the bias what gravity adds to it.
        responding, along = of_matrix - relative**2 * np.outer(matrix.ravel(), matrix.ravel()), np.zeros(3)
    response = -np.kron(np.eye(3), truth)
    joint = np.zeros((12, 12))
    joint[:9, :9] = of_matrix
    joint[9:, :9] = response @ responding
    joint[:9, 9:] = joint[9:, :9].T
    joint[9:, 9:] = response @ responding @ response.T + np.outer(along, along)  # eq. 10
    bias = np.sqrt(np.maximum(np.diag(joint)[9:], 0.0))
    sources = dict.fromkeys(
        [*(inherited or {"source": GRAVITY})["source"].split(" and "), *([GRAVITY] if relative else [])]
    )
    stated = None if inherited is None else inherited["sigma"]
    own: FloatArray = content["sigma"]["bias"]
    return {
        "inherited": {
            "source": join(list(sources)),
            "sigma": _sigma(stated, bias),
            "covariance": joint,
        },
        "sigma": {**content["sigma"], "bias": np.hypot(own, bias)},
    }


def _joint_covariance(before: object, matrix: FloatArray, found: FloatArray, truth: FloatArray) -> FloatArray:
    """(12, 12) of [M row by row, b]: the new bias is what M does not explain, errors of M included."""
    joint = np.full((12, 12), np.nan)
    joint[9:, 9:] = matrix @ found @ matrix.T
    if before is None:
        return joint
    joint[:9, :9] = np.array(before, dtype=np.float64)[:9, :9]
    if np.isfinite(joint[:9, :9]).all():
        # y = M u + b at rest, and y is known: an error dM makes db = -dM u.
        response = -np.kron(np.eye(3), truth)
        joint[9:, :9] = response @ joint[:9, :9]
        joint[:9, 9:] = joint[9:, :9].T
        joint[9:, 9:] += response @ joint[:9, :9] @ response.T
    return joint


def _sigma(before: Mapping[str, Any] | None, bias: FloatArray) -> dict[str, Any]:
    gaps = {"xy": None, "yz": None, "zx": None}
    unknown = {"scale": np.full(3, np.nan), "non-orthogonality": gaps, "mounting": np.full(3, np.nan)}
    return {**(before or unknown), "bias": bias}
