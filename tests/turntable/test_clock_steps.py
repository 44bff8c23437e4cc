"""Clocks that are set within a session: a step between turns is no skew."""

from __future__ import annotations

import re

import numpy as np
import pytest

import tumble
from repetitions import repetitions
from tumble.foundation.recording import Recording
from turntable_sessions import calibrate, chi_square, simulate, typed, write

SEED = 8300
VISITS = ("X up", "X down", "Y up", "Y down", "Z up", "Z down", "X up", "Y up")


def session(seed, visits=VISITS, **changes):
    return simulate(seed, grades=("industrial",), visits=visits, **changes)


def stamped(made, stamps):
    """Log of the target with its stamps changed by a function."""
    unit = made.target_units[0]
    samples = unit.samples
    return Recording.from_arrays(unit.name, stamps(samples.time), samples.accelerometer, samples.gyroscope)


def set_in(made, rest, size):
    """Log of the target whose clock was set by so many seconds in the middle of a rest."""
    span = made.rests[rest]
    middle = 0.5 * (span.start + span.end)
    return stamped(made, lambda time: time + size * (time > middle))


def only(made, log, **options):
    (target,) = tumble.turntable(made.reference, [log], **options).targets
    return target


def step_of(target):
    """Step of the clock as it is reported, s."""
    found = re.search(r"its clock was set by ([+-][\d.]+) ms", " ".join(target.warnings))
    assert found, target.warnings
    return 1e-3 * float(found[1])


@pytest.mark.parametrize("size", [0.03, 0.05, 0.2])
def test_clock_that_was_set_in_a_rest_is_no_calibration(size):
    """Such a step was a skew of 700 to 5000 ppm, and as much in the scale of the gyroscope."""
    for seed in range(SEED, SEED + repetitions(48)):
        made = session(seed)
        rest = 1 + seed % 6
        target = only(made, set_in(made, rest, size))
        assert target.verdict == "model not met", (rest, target.warnings)
        assert step_of(target) == pytest.approx(size, abs=0.005)


@pytest.mark.parametrize("visits", [6, 8])
def test_clock_that_was_set_within_a_turn_is_no_calibration(visits):
    for seed in range(SEED, SEED + repetitions(48)):
        made = session(seed, VISITS[:visits])
        middle = 0.5 * (made.rests[2].end + made.rests[3].start)
        target = only(made, stamped(made, lambda time, middle=middle: time + 0.2 * (time > middle)))
        assert target.verdict == "model not met", target.warnings


def test_six_faces_show_a_clock_that_was_set():
    for seed in range(SEED, SEED + repetitions(48)):
        made = session(seed, VISITS[:6])
        target = only(made, set_in(made, 1 + seed % 4, 0.03 if seed % 2 else 0.05))
        assert target.verdict == "model not met", target.warnings
        assert "its clock was set by" in " ".join(target.warnings)


def test_step_of_a_clock_that_is_stated_to_be_shared_is_named():
    made = session(SEED)
    target = only(made, set_in(made, 3, 0.05), clock="shared")
    assert target.verdict == "model not met", target.warnings
    assert step_of(target) == pytest.approx(0.05, abs=0.005)


def test_command_on_a_clock_that_was_set_ends_with_3(tmp_path):
    made = session(SEED)
    reference, path = write(made, tmp_path)
    with tumble.open_writer(path) as writer:
        for chunk in set_in(made, 3, 0.05).chunks():
            writer.write(chunk)
    done = typed("turntable", reference, path, "-o", tmp_path / "out")
    assert done.code == 3, done.out + done.err
    assert "its clock was set by" in " ".join(done.out.split())


def test_even_pace_beyond_that_of_oscillators_is_named_and_right():
    for seed in range(SEED, SEED + repetitions(24)):
        made = session(seed)
        target = only(made, stamped(made, lambda time: 1.003 * time))
        assert target.verdict == "calibrated", target.warnings
        assert any("ppm apart from that of the reference" in line for line in target.warnings)
        assert chi_square(made.target_units[0], target, "gyroscope") < 50.0


def test_pace_that_turns_deny_is_no_calibration():
    """Samples that are missing where stamps are counted: each pause is a step of its own."""
    made = session(SEED)
    samples = made.target_units[0].samples
    random = np.random.default_rng(SEED)
    kept = random.random(len(samples.time)) > 0.03 * (samples.time > samples.time.mean())
    log = Recording.from_arrays(
        "target_1", samples.time[: kept.sum()], samples.accelerometer[kept], samples.gyroscope[kept]
    )
    target = only(made, log)
    assert target.verdict == "model not met", target.warnings
    assert "turns do not confirm" in " ".join(target.warnings)


@pytest.mark.parametrize("grade", ["consumer", "industrial", "tactical"])
def test_sound_clocks_of_their_own_show_no_step(grade):
    for seed in range(SEED, SEED + repetitions(64)):
        made = simulate(seed, grades=(grade,), visits=VISITS, clocks="apart")
        (target,) = calibrate(made).targets
        assert target.verdict == "calibrated", target.warnings
        assert not any("clock" in line for line in target.warnings), target.warnings


def test_unit_that_responds_to_specific_force_shows_no_step():
    for seed in range(SEED, SEED + repetitions(48)):
        made = session(seed, g_sensitivity=True, bias_instability=True)
        (target,) = calibrate(made).targets
        assert not any("clock was set" in line for line in target.warnings), target.warnings
