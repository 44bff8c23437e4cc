"""The tables of a spin: parameters with intervals, both accelerometer biases side by side. Text to print."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.foundation.results import NOT_SHOWN, Parameter
from tumble.procedures.spin.result import BiasEstimate, Spin, SpinResult
from tumble.report.numbers import (
    NOT_OBSERVABLE,
    Scale,
    measurement,
    readable_scale,
    round_like,
    significant,
)
from tumble.report.parameters import ParameterGroup, printed_group

_SCALE = "gyroscope scale"

Cells: TypeAlias = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class MethodRow:
    """One axis of the accelerometer bias as both methods have it, and what the floor's tilt makes of it."""

    axis: str
    level_free: str
    published: str
    difference: str


@dataclass(frozen=True, slots=True)
class Methods:
    """Level-free beside published: which is the result, and what their difference means."""

    unit: str
    rows: tuple[MethodRow, ...]
    chosen: str
    remark: str


@dataclass(frozen=True, slots=True)
class SpinRow:
    """One spin as a line of the overview."""

    label: str
    stretch: str
    turns: str
    method: str
    accelerometer: Cells
    gyroscope: Cells


@dataclass(frozen=True, slots=True)
class Overview:
    """The biases of all spins in common units, and what they agree on."""

    accelerometer_unit: str
    gyroscope_unit: str
    rows: tuple[SpinRow, ...]
    combined: SpinRow


def spin_groups(spin: Spin) -> tuple[ParameterGroup, ...]:
    """Prints every parameter of a spin, by kind; a scale as its deviation from one."""
    kinds: dict[str, list[Parameter]] = {}
    for parameter in (*spin.parameters, spin.slow_turn):
        kinds.setdefault(_kind(parameter), []).append(parameter)
    return tuple(
        printed_group(
            f"{kind} error" if kind == _SCALE else kind,
            [scale_error(each) if is_scale(each) else each for each in members],
            [None] * len(members),
        )
        for kind, members in kinds.items()
    )


def methods(spin: Spin, gravity: float) -> Methods:
    """Prints both accelerometer biases, and their difference as the tilt of the floor; `gravity` in m/s^2."""
    both = (spin.level_free, spin.published)
    scale = _common_scale("m/s^2", both)
    rows = tuple(
        MethodRow(
            axis,
            _cell(spin.level_free, k, scale),
            _cell(spin.published, k, scale),
            _difference(spin, k, scale),
        )
        for k, axis in enumerate("xyz")
    )
    chosen = (
        f"The {spin.method} bias is the result."
        if spin.accelerometer_bias.observable
        else "Neither is known well enough to be the result."
    )
    return Methods(scale.unit, rows, chosen, _tilt_remark(spin, gravity))


def overview(result: SpinResult) -> Overview:
    """Prints the biases of every spin and those they agree on."""
    force = _common_scale("m/s^2", [spin.accelerometer_bias for spin in result.spins])
    rate = _common_scale("rad/s", [spin.gyroscope_bias for spin in result.spins])
    rows = tuple(
        SpinRow(
            label=spin.label,
            stretch=f"{spin.start:.1f} to {spin.end:.1f}",
            turns=turns_text(spin),
            method=spin.method,
            accelerometer=_cells(spin.accelerometer_bias, force),
            gyroscope=_cells(spin.gyroscope_bias, rate),
        )
        for spin in result.spins
    )
    combined = SpinRow(
        label="all spins",
        stretch="",
        turns="",
        method="",
        accelerometer=_cells(result.accelerometer_bias, force),
        gyroscope=_cells(result.gyroscope_bias, rate),
    )
    return Overview(force.unit, rate.unit, rows, combined)


def turns_text(spin: Spin) -> str:
    """Prints how far the robot turned, by direction: `3.00 clockwise, 3.00 counter-clockwise`."""
    turned = [f"{turns:.2f} {direction}" for direction, turns in spin.turns_by_direction.items()]
    return ", ".join(turned) or significant(spin.turns, 2)


def parameter_named(spin: Spin, name: str) -> Parameter | None:
    """Finds a parameter the data showed; None if they did not, or if there is none of that name."""
    return next((each for each in spin.parameters if each.name == name and each.observable), None)


def _kind(parameter: Parameter) -> str:
    if is_scale(parameter):
        return _SCALE
    head, _, axis = parameter.name.rpartition(" ")
    return head if axis in ("x", "y", "z", "roll", "pitch") else parameter.name


def is_scale(parameter: Parameter) -> bool:
    """Returns whether it is a scale of the gyroscope, which is 1 for a perfect one."""
    return parameter.name.startswith(_SCALE)


def scale_error(parameter: Parameter) -> Parameter:
    """Returns a scale as its error, which people read more easily."""
    return replace(parameter, value=parameter.value - 1.0, low=parameter.low - 1.0, high=parameter.high - 1.0)


def _common_scale(unit: str, biases: Sequence[BiasEstimate]) -> Scale:
    finite = [np.abs(bias.value[np.isfinite(bias.value)]) for bias in biases if bias.observable]
    numbers = np.concatenate(finite) if finite else np.empty(0)
    return readable_scale(unit, float(numbers.max()) if numbers.size else 0.0)


def _cell(bias: BiasEstimate, axis: int, scale: Scale) -> str:
    if not bias.observable:
        return NOT_OBSERVABLE
    return measurement(scale.factor * float(bias.value[axis]), scale.factor * float(bias.sigma[axis]))


def _cells(bias: BiasEstimate, scale: Scale) -> Cells:
    return tuple(_cell(bias, axis, scale) for axis in range(3))


def _difference(spin: Spin, axis: int, scale: Scale) -> str:
    if not (spin.level_free.observable and spin.published.observable):
        return ""
    difference = _apart(spin)[axis]
    sigma = math.hypot(float(spin.level_free.sigma[axis]), float(spin.published.sigma[axis]))
    return round_like(scale.factor * difference, scale.factor * sigma)


def _apart(spin: Spin) -> FloatArray:
    """Returns published less level-free accelerometer bias: (3,) m/s^2, case frame."""
    return spin.published.value - spin.level_free.value


def _tilt_remark(spin: Spin, gravity: float) -> str:
    for bias, name in ((spin.level_free, "level-free"), (spin.published, "published")):
        if not bias.observable:
            why = bias.reason or NOT_SHOWN
            return f"The {name} bias is not observable, so there is nothing to compare: {why}."
    difference = _apart(spin)
    across = float(np.linalg.norm(difference - difference @ spin.up * spin.up))
    tilt = math.degrees(math.asin(min(across / gravity, 1.0)))
    # Both come from the same samples, and how they go together is not kept: sigma is at most the sum.
    sigma = math.degrees(float(np.max(spin.level_free.sigma + spin.published.sigma)) / gravity)
    fit = parameter_named(spin, "floor tilt")
    found = f"; the fit has a floor tilt of {measurement(fit.value, fit.sigma, fit.unit)}" if fit else ""
    return (
        "The difference across the turning axis is the error that a floor tilted by "
        f"{measurement(tilt, sigma, 'deg')} causes in the published bias{found}. One degree of tilt is "
        f"{significant(gravity * math.radians(1.0))} m/s²."
    )
