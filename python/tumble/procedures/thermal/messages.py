"""Reasons for a missing result of temperature, and oddities of a result, with remedies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeAlias

from tumble.foundation.words import join, length_of_time
from tumble.procedures.thermal.result import AxisDrift, ThermalBlocks

ThermalFigures: TypeAlias = Mapping[str, float]

NOTABLE_SHARE = 0.01
"""Share of the time left out that is worth a remark."""

NO_TEMPERATURE = (
    "holds no temperature; log that of the sensor, and name its column with --columns temperature=NAME, or "
    "in a bag its topic after that of the IMU: /imu/temperature for /imu/data"
)
ONE_LEG = "no pose was held both while it warmed and while it cooled"
ONE_POSE = (
    "the axis feels much the same in all poses, so that bias and scale look alike; turn the unit over and "
    "let it warm or cool again"
)
AT_REST = "a gyroscope at rest feels hardly anything that a scale could change"
NO_LAG = "the data do not show any: none is as likely"


def explain(word: str, figures: ThermalFigures) -> str:
    """One line: what is missing and what to do."""
    return MESSAGES[word](figures)


def _range_too_small(figures: ThermalFigures) -> str:
    low, high, within, needed = (figures[key] for key in ("low", "high", "within", "needed"))
    if high - low < needed:
        return (
            f"its temperature changes by {high - low:.1f} K only, from {low:.1f} to {high:.1f} degC; needs "
            f"{needed:g} K, better all that it will meet: cool it in a freezer or warm it slowly, and back"
        )
    return (
        f"its temperature changes by {within:.1f} K at most while it stays where it is, though from "
        f"{low:.1f} to {high:.1f} degC in all; let it warm and cool untouched, or, if a fixture returned "
        "it to each orientation exactly, say so with --fixture"
    )


def _too_little_at_rest(figures: ThermalFigures) -> str:
    return (
        f"stands still for {length_of_time(figures['still'])} of "
        f"{length_of_time(figures['still'] + figures['moved'])} only, in too few stretches to compare; let "
        "it lie untouched while it warms and cools, away from fans"
    )


MESSAGES: dict[str, Callable[[ThermalFigures], str]] = {
    "range too small": _range_too_small,
    "too little at rest": _too_little_at_rest,
}
"""Messages by the word for the reason why there is no result."""


def no_temperature_of_start(name: str) -> str:
    """Reports that the temperature at which an initial calibration holds is unknown."""
    return (
        f"{name}: does not say at which temperature it was made, and its bias holds there only; give it with "
        "--calibration-temperature"
    )


def several_temperatures(name: str, found: Sequence[float]) -> str:
    """Reports that the triads of a calibration hold at different temperatures."""
    listed = join([f"{value:.1f}" for value in found])
    return (
        f"{name}: its triads hold at {listed} degC; make them hold at one, or say which is meant with "
        "--calibration-temperature"
    )


def start_out_of_range(temperature: float, low: float, high: float) -> str:
    """Reports that a calibration was made at a temperature outside that of the logs."""
    return (
        f"the calibration it is added to was made at {temperature:.1f} degC, and it is unknown how the unit "
        f"drifts from there to {low:.1f} degC and more: it is taken to hold at the edge of {low:.1f} to "
        f"{high:.1f} degC; let the logs reach {temperature:.0f} degC"
    )


def warnings_of(axes: Sequence[AxisDrift], blocks: ThermalBlocks) -> Iterator[str]:
    """Describes what was left out, and where one curve for warming and cooling is not enough."""
    if blocks.moved > NOTABLE_SHARE * (blocks.still + blocks.moved):
        yield f"{length_of_time(blocks.moved)} were left out, in which the unit did not stand still"
    if not all(axis.hysteresis.observable for axis in axes):
        yield (
            f"hysteresis is not known, as {ONE_LEG}: a curve of one leg may be off on the other by more than "
            "its sigma says; log warming and cooling in one go, untouched"
        )
    apart = [axis for axis in axes if axis.clear_hysteresis]
    if apart:
        yield (
            f"{join([axis.name for axis in apart])}: warming and cooling differ at one temperature, by "
            f"{_largest_hysteresis(apart)} at most; one curve stands for both, with half of that in its sigma"
        )
    torn = [axis.name for axis in axes if not axis.is_one_curve]
    if torn:
        yield (
            f"{join(torn)}: warming and cooling differ by more than a curve over temperature explains, as "
            "where the thermometer is far from the sensor, or the unit warms itself; warm and cool it slowly"
        )


def ambiguous_lag(found: tuple[float, float] | None) -> Iterator[str]:
    """Reports a lag that explains the difference of warming and cooling as well as hysteresis does."""
    if found is not None:
        yield (
            f"a thermometer behind the sensor by {found[0]:.3g} s would explain the difference of warming "
            "and cooling as well as hysteresis does: one axis and a steady pace do not tell them apart; let "
            "it pause at some temperatures, or change the pace"
        )


def _largest_hysteresis(axes: Sequence[AxisDrift]) -> str:
    most: dict[str, float] = {}
    for axis in axes:
        most[axis.unit] = max(most.get(axis.unit, 0.0), abs(axis.clear_hysteresis))
    return join([f"{value:.2g} {unit}" for unit, value in most.items()])
