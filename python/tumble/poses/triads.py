"""From the figures of the core to what people read: parameters with units, intervals and words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tumble import _core
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import (
    INTERVAL,
    LARGEST_ANGLE_OF_SENSORS,
    SCALES_OF_SENSORS,
    Parameter,
    TriadResult,
)
from tumble.foundation.units import CALIBRATED_UNITS, CalibratedTriad

Flags: TypeAlias = NDArray[np.bool_]

UPPER = 0.975
"""Upper end of a 95 % interval."""
_BETWEEN = {
    "turn": "turn {}-{}",
    "rate": "rate {}",
    "ramp up": "ramp from rest {} to rate {}",
    "ramp": "ramp from rate {} to {}",
    "ramp down": "ramp from rate {} to rest {}",
}
"""Names of what lies between rests, by the word of the core."""
_STIMULI: Mapping[CalibratedTriad, str] = {
    "accelerometer": "specific force along",
    "gyroscope": "angular rate about",
    "magnetometer": "a field along",
}
VERY_MANY = 1e9
"""Degrees of freedom from which Student's distribution is the normal one."""


def triad_result(
    triad: CalibratedTriad,
    figures: _core.TriadFigures | None,
    noise_density: FloatArray,
    bias_instability: FloatArray,
    pose_names: dict[int, str],
) -> TriadResult | None:
    """Describes one triad, None where it was not calibrated; what was not observed carries no number."""
    if figures is None:
        return None
    seen = np.array(figures["observed"])
    covariance = figures["covariance"].copy()
    covariance[~seen, :] = np.nan
    covariance[:, ~seen] = np.nan
    inherited = figures.get("inherited")
    if inherited is not None:
        inherited = np.where(np.outer(seen, seen), inherited, np.nan)
    reasons = tuple(_unobservable(seen[:9].reshape(3, 3), triad))
    parameters = tuple(_parameters(triad, figures, seen, reasons))
    return TriadResult(
        triad=triad,
        unit=CALIBRATED_UNITS[triad],
        M=figures["M"],
        b=figures["b"],
        K=np.diag(figures["scale"]),
        L=figures["L"],
        Q=figures["Q"],
        covariance=covariance,
        parameters=parameters,
        estimated=_estimated(seen, figures),
        unobservable=reasons,
        rank=int(seen.sum()),
        chi_square=figures["chi_square"],
        degrees_of_freedom=figures["degrees_of_freedom"],
        residuals=figures["residuals"],
        residual_sigma=figures["residual_sigmas"],
        residual_labels=tuple(_label(label, pose_names) for label in figures["labels"]),
        widening=math.sqrt(figures["widened"]),
        by_direction=figures["by_direction"],
        objections=() if triad == "magnetometer" else tuple(_beyond_any_sensor(triad, parameters)),
        inherited=inherited,
        noise_density=noise_density,
        bias_instability=bias_instability,
        g_sensitivity=figures.get("g_sensitivity"),
        g_sensitivity_sigma=figures.get("g_sensitivity_sigma"),
    )


def _beyond_any_sensor(triad: CalibratedTriad, parameters: Iterable[Parameter]) -> Iterator[str]:
    """Names parameters that no sensor has: a log of too few digits, or of another unit, shows such."""
    low, high = SCALES_OF_SENSORS
    for each in parameters:
        is_angle = each.name.startswith("non-orthogonality")
        if not each.observable or not (is_angle or each.name.startswith("scale")):
            continue
        if is_angle and abs(each.value) > LARGEST_ANGLE_OF_SENSORS:
            yield f"{triad} {each.name} is {each.value:.0f} deg, which no sensor has; check the log"
        if not is_angle and not low < each.value < high:
            yield f"{triad} {each.name} is {each.value:.2g}, which no sensor has; check the log and its units"


def _estimated(seen: Flags, figures: _core.TriadFigures) -> tuple[str, ...]:
    groups = []
    if seen[9:].all():
        groups.append("bias")
    if seen[:9].all():
        groups.append("matrix")
    if "g_sensitivity" in figures:
        groups.append("g-sensitivity")
    return tuple(groups)


def _unobservable(seen: Flags, triad: CalibratedTriad) -> Iterator[str]:
    """Words for what M was not asked; `seen` is (3, 3)."""
    stimulus = _STIMULI[triad]
    lacking = [axis for column, axis in enumerate("xyz") if not seen[:, column].any()]
    for axis in lacking:
        remedy = "no turn about it was recorded" if triad == "gyroscope" else "no rest shows it"
        yield f"response to {stimulus} case axis {axis}: {remedy}"
    for row, sensor in enumerate("xyz"):
        for column, axis in enumerate("xyz"):
            if not seen[row, column] and axis not in lacking:
                yield f"response of axis {sensor} to {stimulus} case axis {axis}"


def _parameters(
    triad: CalibratedTriad, figures: _core.TriadFigures, seen: Flags, reasons: tuple[str, ...]
) -> Iterator[Parameter]:
    reason = reasons[0] if reasons else "not shown by the data"
    inherited = figures.get("inherited_sigmas", [None] * len(figures["values"]))
    for (name, unit), value, sigma, common, observable in zip(
        _names(triad), figures["values"], figures["sigmas"], inherited, _shown(seen), strict=True
    ):
        factor = math.degrees(1.0) if unit == "deg" else 1.0
        if observable:
            found = parameter(name, unit, value * factor, sigma * factor, figures["variance_freedom"])
            yield found if common is None else _with_inherited(found, common * factor)
        else:
            yield Parameter(name, unit, math.nan, math.inf, -math.inf, math.inf, False, reason)


def _shown(seen: Flags) -> list[bool]:
    """Describes the observable part: a scale needs its row of M, an angle two rows, mounting all three."""
    x, y, z = (bool(row.all()) for row in seen[:9].reshape(3, 3))
    biases = [bool(flag) for flag in seen[9:]]
    return [*biases, x, y, z, x and y, y and z, z and x, *[x and y and z] * 3]


def parameter(name: str, unit: str, value: float, sigma: float, freedom: float) -> Parameter:
    """Number with its 95 % interval; `freedom` is that of sigma itself, infinite where it is known."""
    reach = sigma * _core.student_quantile(UPPER, min(freedom, VERY_MANY))
    return Parameter(name, unit, value, sigma, value - reach, value + reach)


def _with_inherited(found: Parameter, inherited: float) -> Parameter:
    """Adds what the reference leaves on a parameter: to its sigma, and to both sides of its interval."""
    reach = math.hypot(0.5 * (found.high - found.low), INTERVAL * inherited)  # uncertainty.md, eq. 8
    return replace(
        found,
        sigma=math.hypot(found.sigma, inherited),  # uncertainty.md, eq. 8
        low=found.value - reach,
        high=found.value + reach,
        inherited=inherited,
    )


def _names(triad: CalibratedTriad) -> list[tuple[str, str]]:
    return [
        *((f"bias {axis}", CALIBRATED_UNITS[triad]) for axis in "xyz"),
        *((f"scale {axis}", "1") for axis in "xyz"),
        *((f"non-orthogonality {pair}", "deg") for pair in ("xy", "yz", "zx")),
        *((f"mounting {axis}", "deg") for axis in "xyz"),
    ]


def _label(label: tuple[str, int, int], pose_names: dict[int, str]) -> str:
    kind, first, second = label
    if kind in _BETWEEN:
        return _BETWEEN[kind].format(first + 1, second + 1)
    pose = pose_names.get(first)
    return f"rest {first + 1}: {pose}" if pose else f"rest {first + 1}"
