"""What a spin objects to, in words: one line each, with the place, the figures and the remedy."""

from __future__ import annotations

import math

import pytest

from tumble.spin.messages import CHANNELS, in_words

FAILURES = [
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
]
"""Every kind of the core, with figures, and what the line has to hold."""


@pytest.mark.parametrize(("kind", "figures", "part"), FAILURES, ids=[kind for kind, *_ in FAILURES])
def test_every_failure_is_one_line_that_names_its_figures_and_a_remedy(kind, figures, part):
    line = in_words(kind, figures)
    assert "\n" not in line
    assert part in line
    assert ";" in line, "no remedy after the cause"
    assert not line.endswith("."), "the line goes on after the name of the log, it is no sentence of its own"


@pytest.mark.parametrize("channel", range(6))
def test_a_saturated_channel_goes_by_its_name_and_unit(channel):
    line = in_words("saturated", {"time": 1.0, "channel": float(channel), "value": 16.0})
    assert line.startswith(CHANNELS[channel])
    assert ("m/s^2" in line) == CHANNELS[channel].startswith("accelerometer")


def test_an_angle_is_in_degrees_below_a_turn_and_in_turns_above():
    line = in_words("turned too little", {"turned": math.radians(359.0), "wanted": 2.0 * math.pi})
    assert "359 deg" in line
    assert "1.00 turns" in line


def test_an_unknown_kind_is_a_bug_of_ours_and_not_passed_over():
    with pytest.raises(KeyError):
        in_words("moon phase", {})
