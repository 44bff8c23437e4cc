"""The sentences of a calibrated magnetometer, the same on screen, page and in notebooks."""

from __future__ import annotations

import math
from collections.abc import Iterator

from tumble.foundation.words import count_of
from tumble.poses.by_hand import axis_words, orientation_words
from tumble.procedures.magnetometer.result import MagnetometerResult
from tumble.report.numbers import measurement, readable_scale, significant


def sentences(result: MagnetometerResult) -> Iterator[str]:
    """Describes the number of readings, and the calibrated field at them."""
    if not result.at_rest:
        yield "all samples of a unit that was turned"
    elif result.disturbed:
        left_out = len(result.disturbed)
        yield f"{count_of('rest', len(result.points))}, {left_out} of them left out as disturbed"
    else:
        yield count_of("rest", len(result.points))
    yield f"directions of the field that were met: {100.0 * result.coverage:.0f} %"
    held_out = (
        ""
        if math.isnan(result.norm_held_out)
        else f"; {_field(result.norm_held_out)} where held out of the fit"
    )
    yield (
        f"|field| minus its strength: {_field(result.norm_before)} raw, {_field(result.norm_after)} "
        f"calibrated{held_out}"
    )
    if result.scatter is not None and result.correlated is not None:
        yield (
            f"a sample scatters by {_field(result.scatter)}; {significant(result.correlated, 2)} successive "
            "ones are worth one that is independent"
        )
    yield f"field strength: {_strength(result)}"
    if result.aligned:
        yield f"dip of the field: {_dip(result)}"


def _strength(result: MagnetometerResult) -> str:
    found = result.strength
    if result.strength_source == "free":
        return (
            f"{measurement(found.value, found.sigma, 'µT')} by the mean scale of its axes, as nobody states "
            "it: scales are relative to their mean; state --field, or --latitude and --longitude"
        )
    if found.sigma == 0.0:
        return f"{found.value:.3f} µT ({result.strength_source}), taken as exact; see --field-uncertainty"
    size = measurement(found.value, found.sigma, "µT")
    return f"{size} ({result.strength_source}), within the sigmas of scale"


def _dip(result: MagnetometerResult) -> str:
    found = measurement(result.dip.value, result.dip.sigma, "deg")
    scatter = f", which varies by {significant(result.dip_scatter, 2)} deg from rest to rest"
    expected = "" if result.expected_dip is None else f"; {result.expected_dip:.2f} deg by the model"
    return f"{found}{scatter}{expected}"


def next_sentences(result: MagnetometerResult) -> Iterator[str]:
    """Describes the orientation that would help most, if by enough."""
    found = result.advised
    if found is not None:
        gain = f"{significant(100.0 * found.before, 2)} % to {significant(100.0 * found.after, 2)} %"
        how = "turn it" if found.up is None else f"{orientation_words(found.up)}, turned"
        axis = axis_words(found.field)
        yield (
            f"Next: {how} so that the field points along {axis}; lowers the largest sigma, of "
            f"{found.parameter}, from {gain}"
        )


def _field(value: float) -> str:
    scale = readable_scale("uT", value)
    return f"{significant(scale.factor * value, 2)} {scale.unit}"


def method_lines(result: MagnetometerResult) -> tuple[tuple[str, str], ...]:
    """Lists how it was done."""
    frame = (
        "that of the accelerometer"
        if result.aligned
        else "x along the magnetometer's axis x, y in the plane of its axes x and y"
    )
    fit = "length and dip of the field, at rests" if result.aligned else "length of the field, at all samples"
    return (
        ("source", result.source),
        ("constant", fit),
        ("field strength", _strength(result)),
        ("case frame", frame),
        ("current", "fitted" if result.options.get("current") else "not asked for"),
        ("software", result.software),
    )
