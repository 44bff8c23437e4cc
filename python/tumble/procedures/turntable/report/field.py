"""The section of a target's page on the magnetic field that both magnetometers measured."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tumble.procedures.turntable.result import FieldAtRest, SharedField
from tumble.report.numbers import fixed, measurement, significant


@dataclass(frozen=True, slots=True)
class FieldRow:
    """The field at a rest, as printed."""

    rest: str
    deviation: str
    remark: str


@dataclass(frozen=True, slots=True)
class FieldSection:
    """Strength, places and mounting in sentences, and the rests."""

    sentences: tuple[str, ...]
    rests: tuple[FieldRow, ...]


def field_section(field: SharedField | None) -> FieldSection | None:
    """Describes the field; None where no magnetometer was calibrated."""
    if field is None:
        return None
    return FieldSection(tuple(_sentences(field)), tuple(map(_row, field.rests)))


def _sentences(field: SharedField) -> Iterator[str]:
    yield f"Strength of the field: {measurement(field.strength, field.strength_sigma, 'uT')}."
    pairs = zip("xyz", field.reference_bias, field.reference_bias_sigma, strict=True)
    biases = ", ".join(f"{axis} {measurement(float(b), float(s), 'uT')}" for axis, b, s in pairs)
    yield f"Hard iron at the reference, which is taken out: {biases}."
    if field.mounting:
        angles = ", ".join(
            f"{each.name[-1]} {measurement(each.value, each.sigma, 'deg')}" for each in field.mounting
        )
        yield f"Mounting of the magnetometer against the accelerometer beside it: {angles}."
    if field.difference is None:
        yield "Residuals show no difference of the field between the places of reference and target."
    else:
        up, north, west = (fixed(float(value), 2) for value in field.difference)
        yield (
            f"Field at the target less that at the reference, across the field: {up} µT upwards, {north} µT "
            f"to magnetic north, {west} µT to the west."
        )


def _row(rest: FieldAtRest) -> FieldRow:
    beyond = np.isfinite(rest.sigma) and rest.sigma > 0.0
    deviation = measurement(rest.deviation, rest.sigma) if beyond else significant(rest.deviation, 2)
    return FieldRow(rest.label, deviation, f"not used: {rest.disturbance}" if rest.disturbance else "")
