"""The monitor as Python drives it, with offsets of clocks that it is given."""

from __future__ import annotations

import numpy as np
import pytest

from tumble import Chunk, RedundancyMonitor, _core

RATE = 100.0


def said(start, end, generator):
    """Time, specific force and angular rate of a unit at rest."""
    time = np.arange(round(start * RATE), round(end * RATE)) / RATE
    force = generator.normal((0.0, 0.0, 9.80665), 0.01, (len(time), 3))
    return time, force, generator.normal(0.0, 0.001, (len(time), 3))


@pytest.mark.parametrize("ahead", [80.0, 0.0, -80.0, -1.7e9])
def test_secondary_is_the_source_before_a_primary_of_a_late_clock(ahead):
    seed = 51
    print(f"seed {seed}")
    generator = np.random.default_rng(seed)
    monitor = _core.RedundancyMonitor(
        [_core.RedundancyUnit(1), _core.RedundancyUnit(2, time_offset=-ahead)], {"rest_duration": 1.0}
    )
    primary, secondary = said(10.0, 20.0, generator), said(0.0, 20.0, generator)
    all_said = zip(primary, (secondary[0] + ahead, *secondary[1:]), strict=True)
    replay = monitor.replay(*(list(both) for both in all_said))
    events = [
        (round(time, 2), unit, event, figures.get("reason"))
        for time, unit, event, figures in replay["events"]
    ]
    assert events[0] == (0.1, 1, "selected", "primary failed")
    assert [event for event in events if event[1:3] == (1, "unhealthy")] == []


def warming(told):
    """Events of two units at rest, of which the secondary drifts as 25 K make it."""
    monitor = RedundancyMonitor("front", ["rear"])
    random = np.random.default_rng(5)
    time = np.arange(3000) / 50
    warmth = -np.expm1(-time / 20.0)
    happened = []
    readings = {}
    for unit, drift in (("front", 0.0), ("rear", 0.09)):
        force = random.normal((0.0, 0.0, 9.80665), 0.01, (len(time), 3))
        force[:, 0] += drift * warmth
        readings[unit] = force, random.normal(0.0, 0.001, (len(time), 3))
    for at in range(len(time)):
        for unit, (force, rate) in readings.items():
            one = slice(at, at + 1)
            temperature = 20.0 + 25.0 * warmth[one] if told else None
            happened += monitor.push(unit, Chunk(time[one], force[one], rate[one], temperature))
    return [each.event for each in happened]


def test_units_with_thermometers_may_drift_as_warmth_explains():
    assert "disagree" in warming(told=False)
    assert {"disagree", "unhealthy"}.isdisjoint(warming(told=True))
