"""Drift of a reference by its history in the registry, for certificates that state none."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tumble.laboratory.history import history_of
from tumble.laboratory.registry import Registry, units_called


def walks_of(address: str | Path, serial: str) -> Mapping[str, float]:
    """Return q, variance a year, of each parameter of a unit whose drift is known, by name with its triad.

    Empty where the registry holds no unit, or several, of that serial. Raises `TumbleError` where it cannot
    be read.
    """
    registry = Registry(address)
    with registry.database.reading() as connection:
        units = list(units_called(connection, serial))
    if len(units) != 1:
        return {}
    parameters = history_of(registry, serial).parameters
    return {each.measured.name: each.walk.q for each in parameters if each.walk is not None}
