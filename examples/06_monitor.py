"""A program of your own watches a redundant set: fed as samples come, it acts on the events of the monitor.

python examples/06_monitor.py
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

import tumble
from tumble import Chunk, RedundancyMonitor
from tumble.tools.simulate.fault import Fault
from tumble.tools.simulate.flight.files import known_of_units
from tumble.tools.simulate.flight.procedure import SimulatedFlight
from tumble.tools.simulate.flight.scenario import FlightUnit

UNITS = (
    FlightUnit(grade="industrial", ageing=0.0, faults=(Fault(kind="dead", start=130.0),)),
    FlightUnit(lever_arm_m=(0.03, 0.0, 0.0)),
    FlightUnit(lever_arm_m=(0.0, -0.02, 0.01)),
)
TOGETHER = 0.02
"""s of samples that come together, as from a bus that is read so often."""


def as_they_come(flight: SimulatedFlight) -> Iterator[tuple[str, Chunk]]:
    """Returns what each unit sent, piece by piece; in a vehicle these are reads of a bus."""
    given = {unit.name: 0 for unit in flight.units}
    for until in np.arange(0.0, flight.duration + TOGETHER, TOGETHER):
        for unit in flight.units:
            first, last = given[unit.name], int(unit.arrival.searchsorted(until))
            given[unit.name], part, samples = last, slice(first, last), unit.samples
            if last > first:
                yield (
                    unit.name,
                    Chunk(samples.time[part], samples.accelerometer[part], samples.gyroscope[part]),
                )


def main() -> None:
    """Flies two flights, in the second of which the primary dies; prints what the monitor does meanwhile."""
    flight = tumble.simulate_flight(seed=7, units=UNITS, flights=2)
    primary, *secondaries = (unit.name for unit in flight.units)
    monitor = RedundancyMonitor(primary, secondaries, settings=known_of_units(flight))

    outputs = 0
    for name, samples in as_they_come(flight):
        for event in monitor.push(name, samples):
            if event.event in ("triggered", "adopted", "unhealthy", "selected"):
                print(f"{event.time:7.2f} s  {event.unit:12}  {event.event}")
        # Here a vehicle would hand them to its navigation.
        outputs += len(monitor.output)

    print(f"{outputs} compensated samples; {monitor.source} is the source")
    for record in monitor.records:
        print(f"{record.name}: {record.residual_before:.4f} before, {record.residual:.4f} after")
    assert monitor.source in secondaries
    assert all(record.residual < 0.2 * record.residual_before for record in monitor.records)


if __name__ == "__main__":
    main()
