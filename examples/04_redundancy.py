"""A quadrotor flies with three IMUs: the primary calibrates the others and fails, and one of them takes over.

python examples/04_redundancy.py [FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path

import tumble
from tumble.tools.simulate import write_flight
from tumble.tools.simulate.fault import Fault
from tumble.tools.simulate.flight.scenario import FlightUnit

UNITS = (
    FlightUnit(grade="industrial", ageing=0.0, faults=(Fault(kind="dead", start=130.0),)),
    FlightUnit(lever_arm_m=(0.03, 0.0, 0.0)),
    FlightUnit(lever_arm_m=(0.0, -0.02, 0.01), mounting_deg=(180.0, 0.0, 0.0)),
)


def main(folder: Path) -> None:
    """Simulates two flights, replays them through the monitor, and prints what it did."""
    flight = tumble.simulate_flight(seed=7, units=UNITS, flights=2)
    logs = write_flight(flight, folder)

    secondaries = ["secondary_1", "secondary_2"]
    result = tumble.redundancy(
        str(logs["primary"]), [str(logs[name]) for name in secondaries], settings=folder / "units.yaml"
    )
    for event in result.events:
        if event.event in ("triggered", "adopted", "unhealthy", "selected"):
            print(f"{event.time:7.2f} s  {event.unit:12}  {event.event}  {dict(event.figures)}")
    for error in result.errors:
        print(f"{error.unit} {error.sensor}: {error.residual_before:.4f} before, {error.residual:.4f} after")

    assert result.selected[-1].unit in secondaries
    assert all(error.residual < 0.2 * error.residual_before for error in result.errors)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "redundancy"))
