"""The truth of a live bench on disk."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from tumble.foundation.documents import write_document
from tumble.foundation.files import prepare_folder
from tumble.foundation.plain import plain
from tumble.tools.simulate.files import TRUTH, options, without_none
from tumble.tools.simulate.live.procedure import LiveSimulation

_HEADER = """\
The truth of this live bench. SI units, angles in rad unless a key ends in _deg; frames as in
docs/conventions.md. y = M u + b + G f, u in the case frame of the first unit. What a unit's clock shows is
uptime + t + offset + skew t, t being s since the bench began."""


def write_live(simulation: LiveSimulation, directory: str | Path) -> Path:
    """Writes `truth.yaml`; returns its path; raises `OutputError` where the folder cannot be written."""
    path = prepare_folder(directory) / "truth.yaml"
    write_document(path, _HEADER, live_truth(simulation))
    return path


def write_set(simulation: LiveSimulation, path: Path) -> None:
    """Writes what a builder knows of the units of a flight, as settings of `tumble redundancy`."""
    _, *secondaries = simulation.truth["units"].items()
    known = {
        name: {"sensor_from_primary": unit["nominal_mounting"], "lever_arm": unit["lever_arm"]}
        for name, unit in secondaries
    }
    content = {"schema": "tumble-redundancy/1", "units": plain(known)}
    write_document(path, "Nominal mounting and place of the units of a simulated set.", content, renews=True)


def live_truth(simulation: LiveSimulation) -> dict[str, Any]:
    """Returns the truth as plain mappings, lists, numbers and text; the bench has to be entered."""
    scenario = simulation.scenario
    bench = options(scenario)
    bench["faults"] = {
        name: [without_none(asdict(fault)) for fault in faults] for name, faults in scenario.faults.items()
    }
    content = {
        "schema": TRUTH,
        **{key: each for key, each in simulation.truth.items() if key != "schema"},
        "live": {"uptime": scenario.uptime, "addresses": simulation.addresses, **bench},
    }
    if simulation.table_address is not None:
        content["live"]["table"] = simulation.table_address
    return {key: plain(value) for key, value in content.items()}
