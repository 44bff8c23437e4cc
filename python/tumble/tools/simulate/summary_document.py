"""JSON that `tumble simulate` prints."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from tumble.foundation.printed import Printed
from tumble.tools.simulate.options import SIMULATION


class SimulationDocument(Printed):
    """A simulation; keys that a kind of recording has no use for are left out."""

    schema_: Literal["tumble-simulation/1"] = Field(SIMULATION, alias="schema")
    verdict: Literal["simulated"]
    seed: int
    samples: int | dict[str, int] = 0
    """Number for the unit, or for each by its name."""
    duration: float = 0.0
    """s."""
    turned: list[float] = Field(default_factory=list)
    """rad."""
    rests: list[tuple[float, float]] = Field(default_factory=list)
    """Start and end, s."""
    manoeuvres: list[tuple[float, float]] = Field(default_factory=list)
    """Start and end, s."""
    truth: dict[str, Any] | Path = Path()
    """The truth; for live units the file that holds it."""
    files: dict[str, Path] = Field(default_factory=dict)
    """Path of each file by what it is."""
    units: dict[str, str] = Field(default_factory=dict)
    """Where each live unit is read."""
    table: str = ""
    """Where a simulated table is commanded."""
