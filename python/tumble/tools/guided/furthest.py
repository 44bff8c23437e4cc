"""Parameters that are furthest out where no limits are stated: furthest from those of an ideal sensor."""

from __future__ import annotations

from collections.abc import Iterable

from tumble.foundation.results import Parameter
from tumble.tools.guided.outcome import FurthestParameter

MOST_SHOWN = 5
"""Parameters that are shown."""


def furthest_from_ideal(named: Iterable[tuple[str, Parameter]]) -> tuple[FurthestParameter, ...]:
    """Returns the observable parameters that differ most from those of an ideal sensor, in their sigmas."""
    shown = [(name, each) for name, each in named if each.observable]
    shown.sort(key=lambda each: -_departure(each[1]))
    return tuple(
        FurthestParameter(name, each.unit, each.value, each.sigma) for name, each in shown[:MOST_SHOWN]
    )


def _departure(parameter: Parameter) -> float:
    ideal = 1.0 if parameter.name.startswith("scale ") else 0.0
    return abs(parameter.value - ideal) / parameter.sigma
