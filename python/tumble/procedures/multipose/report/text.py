"""The sentences of a multi-pose calibration, the same on screen, page and in notebooks."""

from __future__ import annotations

import math
from collections.abc import Iterator

from tumble.foundation.gravity import gravity_sentence
from tumble.foundation.words import count_of
from tumble.poses.by_hand import axis_words, orientation_words
from tumble.procedures.magnetometer.report.text import next_sentences as next_of_magnetometer
from tumble.procedures.magnetometer.report.text import sentences as magnetometer_sentences
from tumble.procedures.multipose.result import MultiposeResult, TimeBase
from tumble.report.numbers import readable_scale, significant


def sentences(result: MultiposeResult) -> Iterator[str]:
    """Describes the number of poses, and the calibrated gravity at them and between them."""
    rests, turns = len(result.poses), len(result.turns)
    if result.faces is not None:
        tilt = _quantity(math.degrees(result.faces.tilt), "deg")
        yield f"six faces of a box, each {tilt} off level, as what they leave shows"
    trembling = f", {result.trembling} of which tremble" if result.trembling else ""
    left_out = f"; {count_of('segment', len(result.left_out))} left out" if result.left_out else ""
    yield (
        f"{count_of('rest', rests)} in {count_of('orientation', result.directions)}{trembling}, "
        f"{count_of('turn', turns)} between them{left_out}"
    )
    held_out = (
        ""
        if math.isnan(result.norm_held_out)
        else f"; {_quantity(result.norm_held_out, 'm/s^2')} at orientations held out of the fit"
    )
    yield (
        f"|specific force| minus gravity: {_quantity(result.norm_before, 'm/s^2')} raw, "
        f"{_quantity(result.norm_after, 'm/s^2')} calibrated{held_out}"
    )
    if turns:
        yield (
            f"gravity after a turn: {_quantity(math.degrees(result.angle_before), 'deg')} off with the bias "
            f"at rest alone, {_quantity(math.degrees(result.angle_after), 'deg')} calibrated"
        )
    yield f"gravity: {_gravity(result)}"
    if result.time_base is not None:
        yield f"time: {_time(result.time_base)}"
    if result.magnetometer is not None:
        yield from (f"magnetometer: {line}" for line in magnetometer_sentences(result.magnetometer))


def next_sentences(result: MultiposeResult) -> Iterator[str]:
    """Describes the orientation and the turn that would help most, if by enough."""
    orientation, turn = result.advised_orientation, result.advised_turn
    if orientation is not None:
        how = orientation_words(orientation.up)
        yield _advice(how, orientation.parameter, orientation.before, orientation.after)
    if turn is not None:
        how = f"from {orientation_words(turn.up)}, turn it half round about {axis_words(turn.axis)}"
        yield _advice(how, f"{turn.parameter} of the gyroscope", turn.before, turn.after)
    if result.magnetometer is not None:
        yield from next_of_magnetometer(result.magnetometer)


def _advice(how: str, parameter: str, before: float, after: float) -> str:
    gain = f"{significant(100.0 * before, 2)} % to {significant(100.0 * after, 2)} %"
    return f"Next: {how}; lowers the largest sigma, of {parameter}, from {gain}"


def _quantity(value: float, unit: str) -> str:
    scale = readable_scale(unit, value)
    return f"{significant(scale.factor * value, 2)} {scale.unit}"


def method_lines(result: MultiposeResult) -> tuple[tuple[str, str], ...]:
    """Lists how it was done."""
    options = [
        "g-sensitivity" if result.options.get("g-sensitivity") else "",
        "the Earth's rotation removed" if result.options.get("earth-rate") else "",
        "readings are counts" if result.options.get("raw") else "",
        "six faces" if result.options.get("faces") else "",
    ]
    return (
        ("source", result.source),
        ("gravity", _gravity(result)),
        ("limits of stillness", f"{result.tolerance:g} times the usual"),
        ("asked for", ", ".join(option for option in options if option) or "nothing besides"),
        ("case frame", _case_frame(result)),
        ("software", result.software),
    )


def _gravity(result: MultiposeResult) -> str:
    return gravity_sentence(result, "the scale of the accelerometer")


def _time(base: TimeBase) -> str:
    if base.rate is not None:
        return (
            f"{base.rate:g} Hz, taken as exact; the gyroscope's scale is relative to the "
            "stated rate, and 1 % of one is 1 % of the other"
        )
    if base.sigma > 0.0:
        return f"stamps of the log ± {1e6 * base.sigma:.2g} ppm, within the sigmas of the gyroscope's scale"
    return "stamps of the log, taken as exact; the gyroscope's scale is relative to their clock"


def _case_frame(result: MultiposeResult) -> str:
    if result.faces is not None:
        return "the faces of the box: what was up on face x is axis x, and so on"
    return "x along the accelerometer's axis x, y in the plane of its axes x and y"
