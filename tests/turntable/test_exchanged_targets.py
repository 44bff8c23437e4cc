"""Units that are exchanged in mid-session: each log then holds two units, and no calibration is of one."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from repetitions import repetitions
from tumble.foundation.recording import Recording
from turntable_sessions import calibrate, simulate, typed, write

SEED = 8100
VISITS = ("X up", "X down", "Y up", "Y down", "Z up", "Z down", "X up", "Y up")
ANOTHER = "another unit or another state"


def session(seed, **changes):
    return simulate(seed, grades=("consumer", "consumer"), visits=VISITS, **changes)


def recording(name, *parts):
    """The recording of parts, each of a unit and a span of time, s."""
    kept = [
        (samples, (samples.time >= start) & (samples.time < end))
        for samples, start, end in ((unit.samples, *span) for unit, *span in parts)
    ]
    return Recording.from_arrays(
        name,
        *(
            np.concatenate([getattr(samples, each)[rows] for samples, rows in kept])
            for each in ("time", "accelerometer", "gyroscope")
        ),
        clock="turntable",
    )


def exchanged(made, at):
    """Logs of two targets whose plugs were exchanged at a time, s."""
    one, other = made.target_units
    return [
        recording(first.name, (first, -np.inf, at), (then, at, np.inf))
        for first, then in ((one, other), (other, one))
    ]


def turned_beside(made, rest, rate):
    """Log of a target that turned about the vertical in one rest by a rate (3,), rad/s."""
    unit = made.target_units[0]
    samples, span = unit.samples, made.rests[rest]
    within = (samples.time >= span.start) & (samples.time < span.end)
    angular = samples.gyroscope.copy()
    angular[within] += rate
    return Recording.from_arrays(unit.name, samples.time, samples.accelerometer, angular, clock="turntable")


@pytest.mark.parametrize("before", [2, 4, 5])
def test_units_exchanged_in_mid_session_are_no_calibration(before):
    """Without the law half of the logs of four rests each were calibrated, with numbers of either unit."""
    named = 0
    for seed in range(SEED, SEED + repetitions(48)):
        made = session(seed)
        at = 0.5 * (made.rests[before - 1].end + made.rests[before].start)
        try:
            targets = tumble.turntable(made.reference, exchanged(made, at)).targets
        except tumble.TumbleError as error:
            print(error)
            continue
        for target in targets:
            assert target.verdict in ("model not met", "not calibrated"), target.warnings
            named += ANOTHER in " ".join(target.warnings)
    assert named


def test_command_on_exchanged_units_names_them_and_ends_with_3(tmp_path):
    made = session(SEED + 1)
    at = 0.5 * (made.rests[3].end + made.rests[4].start)
    reference, *paths = write(made, tmp_path)
    for path, log in zip(paths, exchanged(made, at), strict=True):
        with tumble.open_writer(path) as writer:
            for chunk in log.chunks():
                writer.write(chunk)
    done = typed("turntable", reference, *paths, "-o", tmp_path / "out")
    assert done.code == 3, done.out + done.err
    assert "were units exchanged, or two sessions joined?" in " ".join(done.out.split())


@pytest.mark.parametrize("rest", [0, 7])
def test_bias_that_differs_at_an_end_alone_is_no_calibration(rest):
    made = session(SEED)
    (target,) = tumble.turntable(
        made.reference, [turned_beside(made, rest, np.array([0.03, 0.02, -0.02]))]
    ).targets
    assert target.verdict == "model not met", target.warnings
    assert ANOTHER in " ".join(target.warnings)


def test_one_rest_that_a_target_alone_turned_in_is_a_remark():
    made = session(SEED)
    (target,) = tumble.turntable(
        made.reference, [turned_beside(made, 4, np.array([0.03, 0.02, -0.02]))]
    ).targets
    assert target.verdict == "calibrated", target.warnings
    assert any("rest 5 of the reference is not a rest" in line for line in target.warnings)


def test_sound_sessions_hold_one_unit_and_one_clock():
    for seed in range(SEED, SEED + 20):
        for target in calibrate(session(seed)).targets:
            assert target.verdict == "calibrated", target.warnings
            text = " ".join(target.warnings)
            assert ANOTHER not in text, text
            assert "clock" not in text, text


@pytest.mark.parametrize(("first", "last"), [(2, 8), (0, 6), (2, 7)])
def test_log_that_begins_later_or_ends_earlier_keeps_its_verdict(first, last):
    for seed in range(SEED, SEED + repetitions(24)):
        made = session(seed)
        span = made.rests[first].start - 0.5, made.rests[last - 1].end + 0.5
        logs = [recording(unit.name, (unit, *span)) for unit in made.target_units]
        for target in tumble.turntable(made.reference, logs).targets:
            assert target.verdict == "calibrated", target.warnings


def test_log_with_a_pause_over_rests_keeps_its_verdict():
    made = session(SEED)
    unit = made.target_units[0]
    pause = made.rests[2].start - 0.5, made.rests[3].end + 0.5
    log = recording(unit.name, (unit, -np.inf, pause[0]), (unit, pause[1], np.inf))
    (target,) = tumble.turntable(made.reference, [log]).targets
    assert target.verdict == "calibrated", target.warnings


@pytest.mark.parametrize("rest", [1, 4])
def test_clock_set_by_an_hour_is_no_calibration(rest):
    """Rests on one side of the change alone met the reference, and the loss of the others was a remark."""
    made = session(SEED)
    unit = made.target_units[0]
    samples = unit.samples
    time = samples.time + 3600.0 * (samples.time > made.rests[rest].end + 0.2)
    log = Recording.from_arrays(unit.name, time, samples.accelerometer, samples.gyroscope)
    (target,) = tumble.turntable(made.reference, [log]).targets
    assert target.verdict == "model not met", target.warnings
    assert "meet none of the reference" in " ".join(target.warnings)
