"""Kinds of parameters: which belong together, and how a kind is shown."""

from __future__ import annotations

from tumble.foundation.results import Parameter, TriadResult

_TITLES = {"scale": "scale error"}


def group_name(parameter: Parameter) -> str:
    """Returns `non-orthogonality` of `non-orthogonality xy`."""
    return group_of(parameter.name)


def group_of(name: str) -> str:
    """Returns `non-orthogonality` of `non-orthogonality xy`, with or without the triad before it."""
    return name.rpartition(" ")[0] or name


def group_title(name: str) -> str:
    """Returns what a group is headed: a scale is shown as its deviation from one."""
    return _TITLES.get(name, name)


def shown_value(parameter: Parameter, number: float) -> float:
    """Returns a value or an end of the interval as shown: of a scale, what it differs from one by."""
    return shown_number(group_name(parameter), number)


def shown_number(group: str, number: float) -> float:
    """Returns the number of a group as shown, whose name may begin with the triad."""
    return number - 1.0 if group.rpartition(" ")[2] == "scale" else number


def groups_of(triad: TriadResult) -> dict[str, list[Parameter]]:
    """Returns the parameters by group, in the order they come."""
    groups: dict[str, list[Parameter]] = {}
    for parameter in triad.parameters:
        groups.setdefault(group_name(parameter), []).append(parameter)
    return groups
