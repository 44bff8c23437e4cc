"""Reasons why calibrations do not become one over temperature, and oddities of a result, with remedies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from tumble.foundation.words import join
from tumble.tools.plateaus.result import PlateauFacts, TriadOverTemperature

FEWEST = 3
"""Temperatures that are needed: two for a straight line, one to check it."""
_LARGEST_SPREAD = 0.2
"""Share of the range by which the temperature of one session may change without a remark."""

_NOTABLE_WIDENING = 2.0
"""Factor on sigmas that is worth a remark."""

ONE_LEG = (
    "hysteresis is not known, as no temperature was reached both by warming and by cooling: a curve of one "
    "leg may be off on the other by more than its sigma says; go back through some of the temperatures, and "
    "give the files in the order of their recording"
)


def too_few(count: int) -> str:
    """Reports too few temperatures."""
    return (
        f"calibrations at {count} different temperatures; give {FEWEST} or more, such as -20, 0, 25, 50 and "
        "70 degC: two make a straight line, and the third checks it"
    )


def no_temperature(name: str) -> str:
    """Reports that a calibration states no temperature."""
    return (
        f"{name}: does not state its temperature; calibrate from a log with that of the sensor, or give "
        "--temperature for each file, in their order"
    )


def no_covariance(name: str, triad: str) -> str:
    """Reports that a calibration states no uncertainty."""
    return (
        f"{name}: states no covariance of the {triad}, so that nobody knows how far to trust it; give "
        "calibrations that tumble turntable or tumble multipose wrote"
    )


MAGNETOMETER_LEFT_OUT = (
    "the magnetometer is left out, as some of the calibrations have none; their warnings say what disturbed "
    "the field"
)


def warnings_of(plateaus: Sequence[PlateauFacts], triads: Sequence[TriadOverTemperature]) -> Iterator[str]:
    """Describes where the result knows less than it seems to."""
    low, high = triads[0].range
    wide = [each for each in plateaus if each.spread > _LARGEST_SPREAD * (high - low)]
    if wide:
        listed = join([f"{each.name} by {each.spread:.1f} K" for each in wide])
        yield (
            f"the temperature changed within a session: {listed}; each counts at its mean, so let the unit "
            "settle first, or ramp more slowly"
        )
    if not all(np.isfinite(triad.hysteresis).all() for triad in triads):
        yield ONE_LEG
    for triad in triads:
        apart = triad.clear_hysteresis
        if apart.any():
            axes = join([axis for axis, value in zip("xyz", apart, strict=True) if value])
            yield (
                f"{triad.triad} {axes}: the bias after warming and after cooling differs at one temperature, "
                f"by {np.abs(apart).max():.2g} {triad.unit} at most; one curve stands for both, with half of "
                "that in its sigma"
            )
        yield from _constant(triad)
        yield from _scattered(triad)


def _constant(triad: TriadOverTemperature) -> Iterator[str]:
    for each in triad.constancies:
        if each.changes:
            yield (
                f"{triad.triad} {each.group} {each.described}: not modelled, one value holds for all "
                "temperatures"
            )


def _scattered(triad: TriadOverTemperature) -> Iterator[str]:
    wide = {name: factor for name, factor in triad.widening.items() if factor > _NOTABLE_WIDENING}
    if wide:
        listed = join([f"{name} {factor:.1f} times" for name, factor in wide.items()])
        why = (
            "; the bias wanders, most where the unit was switched off in between, so leave it on"
            if "bias" in wide
            else ""
        )
        yield (
            f"{triad.triad}: sessions scatter about the curve by more than their sigmas, which were widened: "
            f"{listed}{why}"
        )
