"""Messages of a spin: one line each, with the place, the figures and the remedy."""

from __future__ import annotations

import math

import pytest

from tumble.procedures.spin.failure import SpinFailure, SpinFailureKind
from tumble.procedures.spin.messages import CHANNELS, cause, explain, remedy

WITH_REMEDY = [
    ("never still", {"waited": 60.0}, "60 s"),
    ("turned too little", {"turned": math.pi, "wanted": 4.0 * math.pi}, "180 deg, 2.00 turns"),
    ("not one axis", {"time": 12.34, "across": 0.31, "limit": 0.1}, "12.3 s: 0.31 rad/s"),
    ("lifted", {"time": 7.0, "change": 2.2, "limit": 0.5}, "7.0 s: specific force changed by 2.2 m/s^2"),
    ("saturated", {"time": 8.04, "channel": 5.0, "value": 4.363}, "gyroscope z is saturated at 4.363 rad/s"),
    ("floor too steep", {"tilt": math.radians(12.0), "limit": math.radians(10.0)}, "12.0 deg, 10.0 deg"),
    ("sample rate too low", {"rate": 5.0, "needed": 20.0}, "5 samples a second"),
    ("stream stopped", {"time": 9.5, "gap": 1.0}, "9.5 s"),
    ("samples missing", {"time": 9.5, "gap": 0.52}, "0.52 s at 9.5 s"),
    ("no rest", {}, "no rest"),
    ("no turn", {"turned": 0.0}, "did not turn"),
    ("unsolvable", {}, "not numbers"),
    ("no rest for long", {"duration": 700.4}, "700 s without a rest"),
    (
        "bias changed",
        {"start": 0.2, "end": 5.8, "axis": 2, "change": -0.023},
        "bias z differs by 0.023 rad/s from that of the other rests",
    ),
    ("moved first", {}, "before it had stood still"),
    ("drove", {"speed": 0.52, "named": 0.0}, "about 0.5 m/s"),
    ("drove a circle", {"radius": 2.04}, "2.0 m radius"),
    ("rested too shortly", {"longest": 1.31, "wanted": 2.0}, "1.3 s at most, 2 s"),
    ("degrees for radians", {"rate": 57.2}, "57 rad/s"),
    (
        "miscounted",
        {"turned": 6.0 * math.pi, "true": 8.0 * math.pi, "clockwise": 0.0},
        "3.00 times counter-c",
    ),
]
"""Failures with figures and a remedy, and what the line has to hold."""

WITHOUT_REMEDY = [
    ("vibrating", {}, "is not a rest: vibration"),
    ("drifting", {}, "is not a rest: gravity drifts"),
    ("turning", {}, "is not a rest: angular rate differs"),
    ("pushed", {"turned": math.radians(3.2), "duration": 3.14}, "turned only 3 deg in 3.1 s"),
    ("tipped", {"across": 0.234}, "0.23 rad/s across"),
]
"""Those of a part of a log: the remedy is given once for all of them."""


def failure(kind, figures):
    return SpinFailure(SpinFailureKind(kind), figures)


@pytest.mark.parametrize(("kind", "figures", "part"), WITH_REMEDY, ids=[kind for kind, *_ in WITH_REMEDY])
def test_every_failure_is_one_line_with_its_figures_and_a_remedy(kind, figures, part):
    line = explain(failure(kind, figures))
    assert "\n" not in line
    assert part in line
    assert ";" in line, "no remedy after the cause"
    assert not line.endswith("."), "the line goes on after the name of the log, it is no sentence of its own"


@pytest.mark.parametrize("channel", range(6))
def test_a_saturated_channel_goes_by_its_name_and_unit(channel):
    line = explain(failure("saturated", {"time": 1.0, "channel": float(channel), "value": 16.0}))
    assert line.startswith(CHANNELS[channel])
    assert ("m/s^2" in line) == CHANNELS[channel].startswith("accelerometer")


def test_an_angle_is_in_degrees_below_a_turn_and_in_turns_above():
    line = explain(failure("turned too little", {"turned": math.radians(359.0), "wanted": 2.0 * math.pi}))
    assert "359 deg" in line
    assert "1.00 turns" in line


@pytest.mark.parametrize(
    ("kind", "figures", "part"), WITHOUT_REMEDY, ids=[kind for kind, *_ in WITHOUT_REMEDY]
)
def test_fault_of_a_part_of_a_log_is_stated_without_own_remedy(kind, figures, part):
    assert part in explain(failure(kind, figures))
    assert remedy(failure(kind, figures)) == ""
    assert cause(failure(kind, figures)) == explain(failure(kind, figures))


def test_there_is_a_message_for_every_kind():
    explained = {kind for kind, *_ in WITH_REMEDY + WITHOUT_REMEDY}
    assert explained == {kind.value for kind in SpinFailureKind}


def test_unknown_word_of_the_core_is_a_bug_and_not_passed_over():
    with pytest.raises(ValueError, match="moon phase"):
        SpinFailure.of_core("moon phase", {})
