"""Hands the results that a command has written over to the registry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from tumble.calibration.document import KIND
from tumble.laboratory.registry import Added, Registry, UnitFacts


def enter_written(address: str, written: Sequence[Path], stated: Mapping[str, str]) -> list[Added]:
    """Add the calibration files among the files that were written; raises `TumbleError`.

    `stated` holds manufacturer, model and lot of the units, as far as they are set.
    """
    calibrations = [path for path in written if path.suffix == ".yaml" and KIND.begins(path)]
    if not calibrations:
        return []
    manufacturer, model, lot = (stated.get(key, "") for key in ("manufacturer", "model", "lot"))
    facts = UnitFacts(manufacturer, model, lot)
    return Registry(address).add(*calibrations, facts=facts)
