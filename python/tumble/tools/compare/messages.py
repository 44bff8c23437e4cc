"""Warnings on calibrations that limit the comparison, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from tumble.calibration.document import Calibration
from tumble.calibration.doubts import doubts
from tumble.foundation.serials import are_of_two
from tumble.foundation.units import CALIBRATED_TRIADS, CalibratedTriad
from tumble.foundation.words import join
from tumble.tools.compare.inheritance import inherited_apart
from tumble.tools.compare.unit import UnitModel

INDEPENDENT = (
    "errors of different calibrations are taken as independent of each other, and so are those of "
    "the triads of one"
)
_NEAR = 2.0
"""K between two calibrations that are not worth a word."""


def notes_on(
    first: Calibration, second: Calibration, models: tuple[UnitModel, UnitModel], *, turned: bool
) -> Iterator[str]:
    """Describes conditions that limit the comparison of a pair."""
    labels = models[0].label, models[1].label
    if are_of_two(first.serial, second.serial):
        yield f"serial {first.serial} and serial {second.serial}: these are two units"
    yield from _missing(models)
    if turned:
        yield (
            "one is in the axes of its accelerometer, the other is not: both were turned into these, so the "
            "mounting of the accelerometer is left out, and that of the gyroscope is relative to it"
        )
    yield from _shared(first, second)
    for calibration, label in zip((first, second), labels, strict=True):
        yield from warnings_on(calibration, label)
    yield from _stated(models)


def warnings_on(calibration: Calibration, label: str) -> Iterator[str]:
    """Describes known errors of a calibration of that label."""
    return (f"{label}: {doubt}" for doubt in doubts(calibration))


def _missing(models: tuple[UnitModel, UnitModel]) -> Iterator[str]:
    for triad in CALIBRATED_TRIADS:
        lacking = [model.label for model in models if model.says_nothing_of(triad)]
        if len(lacking) == 1:
            yield f"{lacking[0]} has no calibration of the {triad}, which is not compared"
    silent = [model.label for model in models if model.response is None]
    if len(silent) == 1:
        yield f"{silent[0]} says nothing of g-sensitivity, which is not compared"
    units = [model.current_unit for model in models if model.current is not None]
    if len(set(units)) == len(models):
        yield f"the effect of current is in {join(units)}, and not compared"
    elif len(units) == 1:
        silent = [model.label for model in models if model.current is None]
        yield f"{silent[0]} says nothing of the effect of current, which is not compared"


def _shared(first: Calibration, second: Calibration) -> Iterator[str]:
    if apart := [triad for triad in CALIBRATED_TRIADS if triad in inherited_apart(first, second)]:
        yield (
            f"{join(apart)}: errors inherited from reference or gravity are within the sigmas, "
            "as these are not the same for both"
        )
    if first.reference is not None and second.reference is not None:
        names = {(each.name, each.serial) for each in (first.reference, second.reference)}
        if len(names) == 1:
            yield (
                f"both were calibrated against the reference {first.reference.name}: its errors are in "
                "both, and do not show here"
            )
    logs = {each.log.sha256 for each in (first, second) if each.log is not None and each.log.sha256}
    if len(logs) == 1 and first.log is not None and second.log is not None:
        yield (
            "both were found from one log, so that they err alike and their difference is smaller than its "
            "sigma says"
        )


def _stated(models: tuple[UnitModel, UnitModel]) -> Iterator[str]:
    for model, other in (models, models[::-1]):
        if alone := [
            triad for triad in CALIBRATED_TRIADS if triad in model.stated and triad not in other.stated
        ]:
            yield (
                f"{model.label} states no uncertainty of {join(alone)}: its numbers are taken as they are, "
                f"and the question is whether {other.label} bears them out"
            )


def temperature_notes(
    calibrations: Sequence[Calibration], labels: Sequence[str], temperatures: dict[CalibratedTriad, float]
) -> Iterator[str]:
    """Describes the temperature of the comparison, and unknown temperature drift."""
    for triad, temperature in temperatures.items():
        knowing = [
            label
            for each, label in zip(calibrations, labels, strict=True)
            if each.temperature_drifts((triad,))
        ]
        only = "" if len(knowing) == len(labels) else f", as {join(knowing)} knows how to"
        yield f"{triad}: compared at {temperature:.1f} degC{only}"
        unplaced = [
            label
            for each, label in zip(calibrations, labels, strict=True)
            if label not in knowing and each.temperature is None and getattr(each, triad) is not None
        ]
        if unplaced:
            yield f"{triad}: {join(unplaced)} does not say at which temperature it holds"
    means = [each.temperature.mean for each in calibrations if each.temperature is not None]
    if not temperatures and means and max(means) - min(means) > _NEAR:
        yield (
            f"made at {min(means):.1f} to {max(means):.1f} degC, and none knows its drift: some of a "
            "difference may be temperature"
        )
