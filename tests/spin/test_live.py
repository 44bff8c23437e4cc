"""The device's state machine, driven from a stream: what it asks for, what it finds, why it gives up."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from live_fixtures import pieces_of, scripted, serial_device, text_lines
from spin_sessions import drive, record, still, turn
from tumble.foundation import clock
from tumble.foundation.errors import LogError, ProcedureError
from tumble.live import LiveChunk, open_source
from tumble.procedures.spin.live import PATIENCE, LiveSpin, LiveSpinOptions

NOTHING = LiveChunk(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))


class Fed:
    """A source of samples that are there already; None among its pieces is a silence."""

    name = "robot"
    remarks = ()

    def __init__(self, session, size=10, moving=None, assumed=False):
        self.gyroscope_unit_is_assumed = assumed
        self._session = session
        self._edges = range(0, len(session.time), size)
        self._size = size
        self._moving = moving

    def __enter__(self):
        return self

    def __exit__(self, *error): ...

    def __iter__(self):
        for first in self._edges:
            part = slice(first, first + self._size)
            session = self._session
            moving = None if self._moving is None else self._moving[part]
            yield LiveChunk(
                session.time[part],
                session.accelerometer[part],
                session.gyroscope[part],
                moving=moving,
            )


class Silence:
    """Samples of another source, and after them nothing, for ever."""

    name = "robot"
    remarks = ()
    gyroscope_unit_is_assumed = False

    def __init__(self, chunks):
        self._chunks = list(chunks)

    def __enter__(self):
        return self

    def __exit__(self, *error): ...

    def __iter__(self):
        for chunk in itertools.chain(self._chunks, itertools.repeat(NOTHING)):
            if not len(chunk):
                clock.sleep(PATIENCE / 8.0)
            yield chunk


def run(source, asked=None, **options):
    """Runs the procedure to its end; returns its steps and its result."""
    live = LiveSpin(source, asked, **options)
    with source:
        steps = list(live.steps())
    return steps, live.result()


def refusal(source, asked=None, error=ProcedureError, **options):
    """The line with which the procedure gives up."""
    with pytest.raises(error) as caught:
        run(source, asked, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message


def events(steps):
    return [step.kind for step in steps if step.kind != "progress"]


def off(result, session):
    """Errors of both biases in sigmas."""
    found = (result.accelerometer_bias, result.gyroscope_bias)
    truth = (session.robot.accelerometer_bias, session.robot.gyroscope_bias)
    return np.concatenate([(each.value - t) / each.sigma for each, t in zip(found, truth, strict=True)])


def test_a_robot_on_a_serial_line_is_calibrated(simulated_clock):
    session = record([still(6.0), turn(2.5)], seed=1)
    with serial_device() as device:
        source = open_source(f"serial:{device.path}?baud=921600")
        live = LiveSpin(source, typed="serial:robot", serial="0815")
        with source:
            device.write(text_lines(session.table, header="time_s,ax,ay,az,gx_rad/s,gy_rad/s,gz_rad/s"))
            steps = list(live.steps())
    result = live.result()
    assert events(steps) == ["listening", "still began", "still done", "spin began", "done"]
    assert (np.abs(off(result, session)) < 4.0).all()
    assert (result.source, result.serial) == ("serial:robot", "0815")
    assert 2.0 <= result.spins[0].turns < 2.2


@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_it_may_turn_either_way(direction):
    session = record([still(6.0), turn(2.5 * direction)], seed=2)
    _, result = run(Fed(session))
    spin = result.spins[0]
    turned = spin.turned_clockwise if direction < 0.0 else spin.turned_counter_clockwise
    assert turned > 4.0 * np.pi
    assert (np.abs(off(result, session)) < 4.0).all()


def test_both_directions_count():
    session = record([still(6.0), turn(1.3), still(1.0), turn(-1.3)], seed=3)
    _, result = run(Fed(session))
    assert result.spins[0].turned_clockwise > 0.5 * np.pi
    assert result.spins[0].turned_counter_clockwise > 2.0 * np.pi


def test_device_in_f32_finds_the_result_of_a_workstation():
    session = record([still(6.0), turn(2.5)], seed=4)
    _, fine = run(Fed(session), precision="f64")
    _, coarse = run(Fed(session), precision="f32")
    for one, other in (
        (fine.accelerometer_bias, coarse.accelerometer_bias),
        (fine.gyroscope_bias, coarse.gyroscope_bias),
    ):
        assert (np.abs(one.value - other.value) < 0.01 * one.sigma).all()
        assert (one.value != other.value).any()
    assert coarse.options["precision"] == "f32"


def test_result_does_not_depend_on_how_samples_are_grouped():
    session = record([still(6.0), turn(2.5)], seed=5)
    results = [run(Fed(session, size))[1] for size in (1, 7, 500, 100_000)]
    for each in results[1:]:
        assert np.array_equal(each.accelerometer_bias.value, results[0].accelerometer_bias.value)
        assert np.array_equal(each.gyroscope_bias.value, results[0].gyroscope_bias.value)


def test_a_clock_that_has_counted_for_years_loses_nothing():
    session = record([still(6.0), turn(2.5)], seed=6)
    _, fresh = run(Fed(session))
    _, old = run(Fed(replace(session, time=session.time + 1.7e9)))
    assert (np.abs(fresh.accelerometer_bias.value - old.accelerometer_bias.value) < 0.01 * 2e-3).all()


def test_progress_only_grows_and_comes_at_most_ten_times_a_second():
    session = record([still(6.0), turn(2.5)], seed=7)
    steps, _ = run(Fed(session))
    progress = [step for step in steps if step.kind == "progress"]
    turned = [step.progress["turned"] for step in progress]
    assert np.all(np.diff(turned) >= 0.0)
    assert turned[-1] > 3.9 * np.pi
    between = np.diff([step.time for step in progress])
    assert (between > 0.1 - 1e-9).all()
    assert (between < 0.2 + 1e-9).all()
    stood = [step.progress["still"] for step in progress if step.state == "still"]
    assert max(stood) > 4.0
    assert all(step.progress["turned_wanted"] == pytest.approx(4.0 * np.pi) for step in progress)


@pytest.mark.parametrize(("rate", "pace"), [(0.3, "too slow"), (1.0, "good"), (2.0, "too fast")])
def test_the_pace_of_the_turn_is_judged_against_what_was_asked(rate, pace):
    session = record([still(6.0), turn(2.5, rate=rate)], seed=8)
    steps, _ = run(Fed(session))
    paces = [step.pace for step in steps if step.kind == "progress" and step.state == "spin"]
    assert max(set(paces), key=paces.count) == pace
    assert {step.pace for step in steps if step.state == "still"} == {"none"}


def test_the_robot_does_what_the_options_ask_for():
    session = record([still(12.0), turn(5.0)], seed=9)
    _, little = run(Fed(session), LiveSpinOptions(still=3.0, turns=1.0))
    _, much = run(Fed(session), LiveSpinOptions(still=10.0, turns=4.0))
    assert little.spins[0].turns < 1.3
    assert much.spins[0].turns > 3.9
    assert (much.accelerometer_bias.sigma < little.accelerometer_bias.sigma).all()
    assert much.options["still"] == 10.0


def test_a_robot_that_moves_while_it_is_to_stand_has_to_stand_again():
    session = record([still(2.0), drive(4.0), still(8.0), turn(2.5)], seed=10)
    steps, result = run(Fed(session))
    assert "still broken" in events(steps)
    begun = [step.time for step in steps if step.kind == "still began"]
    assert begun[-1] > 5.5
    assert (np.abs(off(result, session)) < 4.0).all()


def test_the_state_of_the_wheels_tells_a_slow_turn_from_rest():
    session = record([turn(0.25, rate=0.08), still(8.0), turn(2.5)], seed=11, floor_tilt=0.0)
    moving = np.where(session.during(1), 0.0, 1.0)
    steps, result = run(Fed(session, moving=moving))
    began = [step.time for step in steps if step.kind == "still began"]
    assert began[-1] >= session.spans[1][0] - 0.5
    assert (np.abs(off(result, session)) < 4.0).all()
    # On a level floor only the wheels show it.
    blind, fooled = run(Fed(session))
    assert min(step.time for step in blind if step.kind == "still began") < 5.0
    assert np.abs(off(fooled, session)[3:]).max() > 20.0


def test_a_calibration_from_before_is_applied_first():

    session = record([still(6.0), turn(2.5)], seed=12)
    _, first = run(Fed(session))
    before = first.calibration
    _, again = run(Fed(session), calibration=before)
    assert (np.abs(again.accelerometer_bias.value) < 0.1 * again.accelerometer_bias.sigma).all()
    after = again.calibration
    assert np.allclose(after.accelerometer.b, before.accelerometer.b, atol=1e-4)


def test_a_stream_that_stops_half_way_fails(simulated_clock):
    session = record([still(6.0), turn(2.5)], seed=13).part(12.0)
    assert "samples stopped at 12.0 s" in refusal(Silence(Fed(session)))


def test_a_stream_that_ends_half_way_fails():
    session = record([still(6.0), turn(2.5)], seed=13).part(12.0)
    assert "samples stopped at 12.0 s" in refusal(Fed(session))


def test_a_stall_that_is_made_up_for_does_no_harm(simulated_clock):
    session = record([still(6.0), turn(2.5)], seed=14)
    chunks = list(Fed(session))
    stalled = [*chunks[:100], *[NOTHING] * 5, *chunks[100:110], *[NOTHING] * 5, *chunks[110:]]
    steps, _ = run(Silence(stalled))
    assert events(steps)[-1] == "done"


def test_a_source_that_never_says_anything_is_given_up(simulated_clock):
    message = refusal(Silence([]), error=LogError)
    assert "no sample came in 15 s" in message


def test_a_source_that_ends_at_once_holds_no_samples():
    empty = record([still(1.0)], seed=15).part(-1.0)
    assert "holds no samples" in refusal(Fed(empty), error=LogError)


def test_samples_lost_while_it_turns_fail():
    session = record([still(6.0), turn(2.5)], seed=16)
    kept = ~((session.time > 10.0) & (session.time < 11.0))
    torn = replace(
        session,
        time=session.time[kept],
        accelerometer=session.accelerometer[kept],
        gyroscope=session.gyroscope[kept],
    )
    assert "samples are missing for 1" in refusal(Fed(torn))


def test_a_robot_that_never_stands_fails():
    session = record([drive(2.0), still(2.0)] * 18, seed=17)
    assert "did not stand still" in refusal(Fed(session))
    assert "nobody stated" not in refusal(Fed(session))
    assert "give --gyroscope-unit deg/s" in refusal(Fed(session, assumed=True))


def test_a_robot_that_turns_too_little_fails():
    session = record([still(6.0), turn(1.0), still(130.0)], seed=18)
    message = refusal(Fed(session))
    assert "turned only" in message
    assert "2.00 turns were asked for" in message


def test_a_robot_that_is_lifted_fails():
    session = record([still(6.0), turn(2.5)], seed=19)
    lifted = session.during(1, 0.4, 0.5)
    session.accelerometer[lifted, 2] += 4.0
    session.gyroscope[lifted, 1] += 1.0
    assert refusal(Fed(session))


@pytest.mark.parametrize("stated", [{}, {"gyroscope_unit": "deg/s"}])
def test_degrees_without_a_stated_unit_are_known_at_rest(stated):
    session = record([still(6.0), turn(2.5, rate=0.5)], seed=20)
    degrees = session.table * np.array([1, 1, 1, 1, *[180.0 / np.pi] * 3])
    _, result = run(scripted(pieces_of(text_lines(degrees), 2048), **stated))
    assert (np.abs(off(result, session)) < 4.0).all()


def test_degrees_taken_for_radians_are_noticed_when_it_turns():
    session = record([still(6.0), turn(2.5, rate=0.5)], seed=20, gyroscope_bias=(0.0, 0.0, 0.0))
    degrees = session.table * np.array([1, 1, 1, 1, *[180.0 / np.pi] * 3])
    assert "--gyroscope-unit (deg/s?)" in refusal(scripted(pieces_of(text_lines(degrees), 2048)))


def test_a_wrong_accelerometer_scale_is_noticed():
    session = record([still(6.0), turn(2.5)], seed=21)
    doubled = session.table * np.array([1, 1.4, 1.4, 1.4, 1, 1, 1])
    data = pieces_of(text_lines(doubled), 2048)
    source = scripted(data, accelerometer_scale=1.0, accelerometer_unit="m/s^2")
    assert "accelerometer reads" in refusal(source)


def test_remarks_on_the_stream_are_warnings_of_the_result():
    session = record([still(6.0), turn(2.5)], seed=22)
    lines = text_lines(session.table).splitlines(keepends=True)
    data = pieces_of(b"".join([*lines[:300], b"torn,line\r\n", *lines[300:]]), 2048)
    _, result = run(scripted(data))
    assert "left out 1 line without a sample" in result.warnings


def test_device_without_a_clock_is_calibrated_by_arrival_times(simulated_clock):
    session = record([still(6.0), turn(2.5)], seed=23)
    delays = np.random.default_rng(23).uniform(0.0, 0.008, len(session.time))
    arrivals = np.concatenate([[0.0], session.time + delays])
    lines = text_lines(session.table[:, 1:], header="ax,ay,az,gx,gy,gz").splitlines(keepends=True)
    _, result = run(scripted(lines, whole=True, arrivals=arrivals))
    assert any("that of their arrival is used" in warning for warning in result.warnings)
    assert np.allclose(result.accelerometer_bias.value, session.robot.accelerometer_bias, atol=0.02)
    assert np.allclose(result.gyroscope_bias.value, session.robot.gyroscope_bias, atol=1e-3)


def test_limits_of_a_spin_are_warnings_as_for_a_log():
    session = record([still(6.0), turn(2.5)], seed=24)
    _, result = run(Fed(session))
    assert any("a scale error of the accelerometer" in warning for warning in result.warnings)


def samples_of(table):
    return SimpleNamespace(time=table[:, 0], accelerometer=table[:, 1:4], gyroscope=table[:, 4:])


@pytest.mark.parametrize("start", [2.0, 5.8, 8.0])
def test_a_sensor_that_freezes_for_a_while_is_refused(start):
    session = record([still(6.0), turn(2.5), still(3.0)], seed=31)
    table = session.table.copy()
    frozen = (table[:, 0] >= table[0, 0] + start) & (table[:, 0] < table[0, 0] + start + 0.5)
    table[frozen, 1:] = table[frozen, 1:][0]
    assert re.search(
        r"all readings stood still from \d+\.\d\d s on for 0\.\d\d s", refusal(Fed(samples_of(table)))
    )


def test_coarse_sensor_that_repeats_itself_is_not_called_frozen():
    session = record([still(6.0), turn(2.5), still(3.0)], seed=31)
    table = session.table.copy()
    table[:, 1:4] = np.round(table[:, 1:4] / 0.2) * 0.2
    table[:, 4:] = np.round(table[:, 4:] / 0.02) * 0.02
    _, result = run(Fed(samples_of(table)))
    assert result.spins
