"""Parameters in a column of a table, all numbers of one unit in one scale."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from tumble.foundation.results import Parameter
from tumble.report.numbers import NOT_OBSERVABLE, Scale, scales_of


def parameter_scales(parameters: Iterable[Parameter]) -> dict[str, Scale]:
    """Chooses for each unit the scale that suits the largest of the parameters that were observed."""
    seen = [each for each in parameters if each.observable]
    return scales_of((each.unit, max(abs(each.value), each.sigma)) for each in seen)


def parameter_cell(parameter: Parameter, scales: Mapping[str, Scale]) -> str:
    """Prints a parameter with its 1-sigma and unit."""
    if not parameter.observable:
        return NOT_OBSERVABLE
    return scales[parameter.unit].measurement(parameter.value, parameter.sigma)
