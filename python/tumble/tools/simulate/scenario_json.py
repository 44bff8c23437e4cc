"""Scenario in the form of the native simulator: in SI units and rad, as one text in JSON.

The mappings made here and in each procedure are the structs of `crates/tumble-lab/src/simulate`, field by
field; what does not fit them is refused with its place.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from math import radians
from typing import Any, TypeVar

from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.plain import plain
from tumble.tools.simulate.fault import AXES, Fault
from tumble.tools.simulate.grade import Grade
from tumble.tools.simulate.scenario import ScenarioError

Played = TypeVar("Played")

FOREVER = 1e9
"""s, beyond any recording."""
NATIVE_KINDS = {
    "bias-jump": "bias",
    "bias-drift": "bias",
    "absent": "gap",
    "dead": "gap",
    "time-backwards": "clock-jump",
}
"""Kinds of faults that the native simulator treats as cases of another kind."""


def play(simulator: Callable[[str], Played], scenario: Mapping[str, Any], what: str) -> Played:
    """Runs a scenario in the native simulator; raises `ScenarioError`, in one line, on failure."""
    try:
        return simulator(as_json(scenario))
    except ValueError as error:
        raise ScenarioError(f"the {what} cannot be simulated: {error}; change that option") from error


def as_json(scenario: Mapping[str, Any]) -> str:
    """Writes a scenario as JSON; raises `ValueError` where it holds what JSON has no form for."""
    content = plain(scenario)
    for place, number in _not_finite(content):
        raise ValueError(f"{place} is {number}, which is no finite number")
    try:
        return json.dumps(content)
    except TypeError as error:
        raise ValueError(str(error)) from error


def _not_finite(content: object, place: str = "") -> Iterator[tuple[str, float]]:
    if isinstance(content, dict):
        for key, item in content.items():
            yield from _not_finite(item, f"{place}.{key}" if place else key)
    elif isinstance(content, list):
        for index, item in enumerate(content):
            yield from _not_finite(item, f"{place}[{index}]")
    elif isinstance(content, float) and not math.isfinite(content):
        yield place, content


def conditions(
    *,
    seed: int,
    temperature_celsius: float,
    warm_up_kelvin: float = 0.0,
    warm_up_seconds: float = 1.0,
    bias_instability: bool,
    quantisation: bool,
    g_sensitivity: bool,
) -> dict[str, Any]:
    """Returns what all units of a scenario share."""
    return {
        "seed": seed,
        "warming": {
            "start": temperature_celsius,
            "rise": warm_up_kelvin,
            "time_constant": warm_up_seconds,
        },
        "bias_instability": bias_instability,
        "quantisation": quantisation,
        "g_sensitivity": g_sensitivity,
    }


def unit(
    grade: Grade,
    *,
    perfect: bool,
    rate: float,
    mounting: float | list[float],
    lever_arm: Sequence[float],
    clock: Mapping[str, Any],
    biases: Sequence[Sequence[float] | None] = (None, None),
    ageing: Sequence[float | Sequence[float]] = (0.0, 0.0),
    latency: float = 0.0,
    faults: Sequence[Mapping[str, Any]] = (),
) -> dict[str, Any]:
    """Returns a unit as it is built and mounted; of two things the accelerometer's is the first."""
    return {
        "grade": {key: value for key, value in asdict(grade).items() if key != "name"},
        "geometry": "perfect" if perfect else "drawn",
        "rate": rate,
        "package_from_case": mounting,
        "biases": biases,
        "ageing": ageing,
        "lever_arm": lever_arm,
        "clock": clock,
        "latency": latency,
        "faults": faults,
    }


def given_clock(offset: float = 0.0, skew: float = 0.0, phase: float = 0.0) -> dict[str, Any]:
    """Returns a clock of which nothing is drawn; without figures it is the session's own."""
    return {"given": {"offset": offset, "skew": skew, "phase": phase}}


def floor(tilt_deg: float, uphill_deg: float) -> dict[str, float]:
    """Returns a floor that is even."""
    return {"tilt": radians(tilt_deg), "uphill": radians(uphill_deg)}


def in_radians(rotation: float | Sequence[float]) -> float | list[float]:
    """Returns a rotation in rad."""
    return radians(rotation) if isinstance(rotation, int | float) else [radians(part) for part in rotation]


def in_radians_or_none(angle: float | None) -> float | None:
    """Returns an angle in rad where there is one."""
    return None if angle is None else radians(angle)


def injected_fault(fault: Fault, middle: float, largest: float) -> dict[str, Any]:
    """Returns a fault; what its kind has no use for is ignored.

    `middle` of the first rest, s, is when it starts by default; `largest` is what its triad reads at
    most, m/s^2 or rad/s.
    """
    axis = AXES.index(fault.axis)
    start, end = _fault_span(fault, middle)
    return {
        "kind": NATIVE_KINDS.get(fault.kind, fault.kind),
        "channels": fault.triad,
        "axis": axis,
        "other_axis": (axis + 1) % 3,
        "start": start,
        "end": end,
        "size": _fault_size(fault, largest),
    }


def _fault_span(fault: Fault, middle: float) -> tuple[float, float]:
    start = middle if fault.start is None else fault.start
    match fault.kind:
        case "saturated":
            return -FOREVER if fault.start is None else start, FOREVER if fault.end is None else fault.end
        case "absent":
            return -FOREVER, FOREVER if fault.end is None else fault.end
        case "dead":
            return start, FOREVER
        case "bias-jump":
            return start, start
    return start, start + 1.0 if fault.end is None else fault.end


def _fault_size(fault: Fault, largest: float) -> float:
    """In the unit the simulator asks for."""
    accelerometer = fault.triad == "accelerometer"
    usual = {
        "scale": 1.2,
        "moved": 2.0,
        "bias-jump": 1.0 if accelerometer else 0.1,
        "bias-drift": 1.0 if accelerometer else 0.1,
        "noise": 1.0 if accelerometer else 0.1,
        "spikes": 50.0 if accelerometer else 10.0,
        "saturated": 0.8,
        "late": 0.5,
        "time-backwards": 1.0,
        "clock-jump": 1.0,
    }
    size = usual.get(fault.kind, 0.0) if fault.size is None else fault.size
    match fault.kind:
        case "moved":
            return radians(size)
        case "saturated":
            return largest * size
        case "wrong-unit":
            return 1.0 / STANDARD_GRAVITY if accelerometer else math.degrees(1.0)
        case "time-backwards":
            return -size
    return size
