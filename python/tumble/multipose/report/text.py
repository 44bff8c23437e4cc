"""The sentences of a multi-pose calibration, the same on screen, page and in notebooks."""

from __future__ import annotations

import math
from collections.abc import Iterator

from tumble.multipose.result import MultiposeResult
from tumble.recording import FloatArray
from tumble.report.numbers import readable_scale, significant
from tumble.words import count_of

WORTH_ADDING = 0.9
"""Share of the largest sigma that must be left at most, for one more orientation to be advised as needed."""


def sentences(result: MultiposeResult) -> Iterator[str]:
    """Say how many poses there were, and what calibration made of gravity at them and between them."""
    rests, turns = len(result.poses), len(result.turns)
    yield (
        f"{count_of('rest', rests)} in {count_of('orientation', result.directions)}, "
        f"{count_of('turn', turns)} between them"
    )
    held_out = (
        ""
        if math.isnan(result.norm_held_out)
        else f"; {_quantity(result.norm_held_out, 'm/s^2')} at orientations kept from the fit"
    )
    yield (
        f"|specific force| less gravity: {_quantity(result.norm_before, 'm/s^2')} as read, "
        f"{_quantity(result.norm_after, 'm/s^2')} calibrated{held_out}"
    )
    if turns:
        yield (
            f"gravity after a turn: {_quantity(math.degrees(result.angle_before), 'deg')} off with the bias "
            f"at rest alone, {_quantity(math.degrees(result.angle_after), 'deg')} calibrated"
        )


def next_sentence(result: MultiposeResult) -> str:
    """Say which orientation would help most; empty where there is none to say."""
    found = result.next_orientation
    if found is None:
        return ""
    gain = f"{significant(100.0 * found.before, 2)} % to {significant(100.0 * found.after, 2)} %"
    opening = "Next" if found.after < WORTH_ADDING * found.before else "Next, though it gains little"
    return (
        f"{opening}: hold it with {leaning(found.up)} up; lowers the largest sigma, of {found.parameter}, "
        f"from {gain}"
    )


def leaning(up: FloatArray) -> str:
    """Say a direction by the axes it lies between: `between +x and -z`."""
    order = sorted(range(3), key=lambda axis: -abs(up[axis]))
    named = [f"{'+' if up[axis] > 0 else '-'}{'xyz'[axis]}" for axis in order if abs(up[axis]) > 0.35]
    direction = ", ".join(f"{float(value):.2f}" for value in up)
    where = named[0] if len(named) == 1 else f"what lies between {' and '.join(named)}"
    return f"{where} ({direction})"


def _quantity(value: float, unit: str) -> str:
    scale = readable_scale(unit, value)
    return f"{significant(scale.factor * value, 2)} {scale.unit}"


def method_lines(result: MultiposeResult) -> tuple[tuple[str, str], ...]:
    """List how it was done."""
    options = [
        "g-sensitivity" if result.options.get("g-sensitivity") else "",
        "the Earth's rotation taken off" if result.options.get("earth-rate") else "",
        "readings are counts" if result.options.get("raw") else "",
    ]
    return (
        ("source", result.source),
        ("gravity", f"{result.gravity:.6g} m/s², {result.gravity_source}"),
        ("limits of stillness", f"{result.tolerance:g} times the usual"),
        ("asked for", ", ".join(option for option in options if option) or "nothing besides"),
        ("case frame", "x along the accelerometer's axis x, y in the plane of its axes x and y"),
        ("software", result.software),
    )
