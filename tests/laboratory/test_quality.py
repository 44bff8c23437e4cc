"""Control charts, capability and precision against their definitions and against simulation."""

from __future__ import annotations

import numpy as np
import pytest

from repetitions import repetitions
from tumble.laboratory.quality import capability, control_chart, precision

QUIET = [0.1, -0.2, 0.3, -0.1, 0.2, -0.3, 0.0, 0.2, -0.2, 0.1]


@pytest.mark.parametrize(
    ("added", "rule"),
    [
        ([5.0], "beyond three sigmas"),
        ([0.8, 0.9], "two of three beyond two sigmas"),
        ([0.45] * 5, "four of five beyond one sigma"),
        ([0.25] * 9, "eight in a row on one side"),
    ],
)
def test_each_rule_is_seen(added, rule):
    chart = control_chart([*QUIET * 3, *added])
    assert rule in {name for _, name in chart.signals}
    assert chart.signals[-1][0] >= len(QUIET * 3) - 1


def test_a_quiet_standard_has_no_signal():
    assert control_chart(QUIET).signals == ()
    assert control_chart([1.0] * 8).signals == ()
    assert control_chart([1.0, 2.0]) is None


def test_sigma_of_the_moving_range_is_that_of_the_values():
    values = np.random.default_rng(1).normal(5.0, 2.0, 20_000)
    assert control_chart(values).sigma == pytest.approx(2.0, rel=0.03)


def test_intervals_of_cp_and_cpk_hold_the_truth():
    random = np.random.default_rng(2)
    tried, held = repetitions(4000), np.zeros(2)
    for _ in range(tried):
        found = capability(random.normal(1.0, 1.0, 30), 0.0, 6.0)
        held += [
            found.cp_interval[0] <= 2.0 <= found.cp_interval[1],
            found.cpk_interval[0] <= 5.0 / 3.0 <= found.cpk_interval[1],
        ]
    print("held", held / tried)
    assert np.abs(held / tried - 0.95).max() < 3.5 * np.sqrt(0.95 * 0.05 / tried) + 0.005


def test_a_lot_too_small_or_without_scatter_has_no_capability():
    assert capability([1.0, 2.0], 0.0, 3.0) is None
    assert capability([1.0] * 10, 0.0, 3.0) is None


def test_repeatability_and_reproducibility_are_those_simulated():
    random = np.random.default_rng(3)
    cells = {}
    for unit in range(200):
        for station in range(3):
            offset = random.normal(0.0, 2.0)
            cells[f"{unit}", f"{station}"] = 10.0 * unit + offset + random.normal(0.0, 1.0, 2 + unit % 3)
    found = precision(cells)
    assert found.repeatability == pytest.approx(1.0, rel=0.1)
    assert found.repeatability_interval[0] < 1.0 < found.repeatability_interval[1]
    assert found.reproducibility == pytest.approx(np.sqrt(5.0), rel=0.1)
    assert found.stations == 3


def test_stations_that_do_not_differ_add_nothing_below_zero():
    found = precision({("1", "a"): [0.0, 1.0], ("1", "b"): [0.5, 0.5]})
    assert found.reproducibility == found.repeatability
    assert precision({("1", "a"): [0.0], ("1", "b"): [0.5]}) is None
