"""Units of a session recorded on a busy computer: the clock of each sensor has a line of its own."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from log_fixtures import real


@pytest.fixture(scope="module")
def busy():
    session = real("live_session_busy")
    return tumble.align(f"{session}:reference", [f"{session}:target_{number}" for number in (1, 2)])


def test_samples_are_even_by_the_clock_of_their_sensor(busy):
    assert not any("stamps scatter" in warning for warning in busy.warnings)


def test_lines_of_two_sensors_are_no_one_clock(busy):
    for unit in busy:
        shown = {each.name: each for each in unit.parameters}
        # Both are known from arrivals alone, to some 400 ppm.
        assert 0.0 < shown["clock skew"].sigma < 1e-5
        assert abs(shown["clock skew"].value) < 1e-3
        assert shown["time offset"].sigma < 3e-4


def test_units_that_sit_in_one_place_are_shown_in_one_place(busy):
    for unit in busy:
        arms = [each for each in unit.parameters if each.name.startswith("lever arm")]
        off = np.array([each.value / each.sigma for each in arms])
        print(unit.name, off, [each.sigma for each in arms])
        assert np.abs(off).max() < 3.0
        assert max(each.sigma for each in arms) < 6e-4
