"""The monitor as Python drives it, with offsets of clocks that it is told of."""

from __future__ import annotations

import numpy as np
import pytest

from tumble import _core

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
    assert events[0] == (0.02, 1, "selected", "primary failed")
    assert [event for event in events if event[1:3] == (1, "unhealthy")] == []
