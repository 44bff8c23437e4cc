"""Flights obey physics, logs hold what units read, and the score holds events against the truth."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest
from benchmarks.flights import campaign as flight_campaign
from benchmarks.flights.body import GRID_HZ, attitudes, fly, interpolated
from benchmarks.flights.missions import CYCLE, PlacedFault, draw
from benchmarks.flights.replay import missing_output, replayed, write
from benchmarks.flights.score import error_of, judged, on_faulty, scored
from benchmarks.flights.units import (
    AMBIENT,
    THERMOMETER_NOISE,
    Line,
    Shaking,
    digitised,
    draw_thermometer,
    draw_unit,
    read,
    stalled,
)
from benchmarks.redundancy_fault import draw_fault
from benchmarks.redundancy_set import SENSORS, Samples
from scipy.spatial.transform import Rotation

from tumble.foundation.constants import STANDARD_GRAVITY

MOTIONS = np.array([[6.0, 26.0]])
STILL = Shaking((), 0.0)
NOWHERE = np.zeros(3)


@pytest.fixture(scope="module")
def body():
    """A body that moves for 20 s between two rests."""
    print("seed 11")
    return fly(np.random.default_rng(11), MOTIONS, 32.0, 0.1)


def test_a_body_at_rest_feels_gravity_and_the_earths_rate_alone(body):
    still = (body.time < 5.9) | ((body.time > 26.2) & (body.time < 31.0))
    np.testing.assert_allclose(
        np.linalg.norm(body.specific_force[still], axis=1), STANDARD_GRAVITY, atol=1e-6
    )
    np.testing.assert_allclose(np.linalg.norm(body.angular_rate[still], axis=1), 7.292e-5, rtol=1e-3)


def test_gravity_rotated_by_the_gyroscope_is_gravity_at_the_next_rest(body):
    moved = (body.time > 5.0) & (body.time < 27.0)
    rate = body.angular_rate[moved]
    turned = Rotation.identity()
    for step in Rotation.from_rotvec(0.5 * (rate[1:] + rate[:-1]) / GRID_HZ):
        turned = turned * step
    force = body.specific_force[moved]
    # 22 s of the Earth's rate are 1.6 mrad.
    np.testing.assert_allclose(turned.inv().apply(force[0]), force[-1], atol=0.03)


def test_attitudes_are_those_of_successive_rotations():
    rate = np.random.default_rng(1).standard_normal((37, 3))
    print("seed 1")
    found = attitudes(rate, np.array([1.0, 0.0, 0.0, 0.0]))
    turned = Rotation.identity()
    for step in Rotation.from_rotvec(0.5 * (rate[1:] + rate[:-1]) / GRID_HZ):
        turned = turned * step
    last = Rotation.from_quat(np.roll(found[-1], -1))
    assert (last.inv() * turned).magnitude() < 1e-12


def test_velocity_is_nil_again_where_a_motion_ends(body):
    attitude = attitudes(body.angular_rate, np.array([1.0, 0.0, 0.0, 0.0]))
    level = Rotation.from_quat(np.roll(attitude, -1, axis=1)).apply(body.specific_force)
    during = (body.time > 5.0) & (body.time < 27.0)
    gathered = (level - level[0])[during].sum(axis=0) / GRID_HZ
    # Attitude drifts with the Earth's rate that is taken for a turn: 1.6 mrad of gravity for 20 s.
    assert np.linalg.norm(gathered) < 0.2
    assert np.linalg.norm((level - level[0])[during], axis=1).max() > 1.0


def test_a_place_on_an_arm_feels_what_its_path_says(body):
    arm = np.array([0.1, -0.05, 0.08])
    time = np.arange(10.0, 12.0, 1.0 / GRID_HZ)
    near, _ = body.at(time, NOWHERE)
    far, _ = body.at(time, arm)
    attitude = attitudes(interpolated(time * GRID_HZ, body.angular_rate), np.array([1.0, 0.0, 0.0, 0.0]))
    turns = Rotation.from_quat(np.roll(attitude, -1, axis=1))
    path = turns.apply(arm)
    accelerated = (path[2:] - 2.0 * path[1:-1] + path[:-2]) * GRID_HZ**2
    np.testing.assert_allclose(turns[1:-1].apply((far - near)[1:-1]), accelerated, atol=2e-3)


def test_a_line_above_half_the_rate_is_aliased_not_lost(body):
    random = np.random.default_rng(3)
    unit = replace(draw_unit(random, 100.0, 0, 100.0), bandwidth=1e6, jitter=0.0)
    unit = replace(unit, triads={n: replace(t, density=0.0) for n, t in unit.triads.items()})
    line = Line(103.0, 0.0, 10.0, (np.array([5.0, 0.0, 0.0]), NOWHERE), (NOWHERE, NOWHERE))
    calm = read(np.random.default_rng(4), unit, body, STILL, 0.0)
    # With no line nothing is drawn for it: the units differ by the line alone.
    shaken = read(np.random.default_rng(4), unit, body, Shaking((line,), 0.0), 0.0)
    moving = (calm.arrival > 8.0) & (calm.arrival < 24.0)
    difference = (shaken.specific_force - calm.specific_force)[moving, 0]
    pace = 1.0 / np.diff(calm.arrival).mean()
    spectrum = np.abs(np.fft.rfft(difference * np.hanning(len(difference))))
    peak = np.fft.rfftfreq(len(difference), 1.0 / pace)[spectrum[5:].argmax() + 5]
    assert peak == pytest.approx(abs(103.0 - pace), abs=0.2)


def test_readings_come_in_steps_within_the_range():
    print("seed 5")
    unit = draw_unit(np.random.default_rng(5), 100.0, 1, 100.0)
    time = np.arange(50) / 100.0
    given = digitised(Samples(time, time, *(np.random.default_rng(6).normal(0.0, 500.0, (2, 50, 3)))), unit)
    for name, triad in unit.triads.items():
        steps = given.of(name) / triad.step
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
        assert np.abs(given.of(name)).max() == triad.range


def test_a_stall_leaves_out_the_samples_of_its_time():
    time = np.arange(100) / 10.0
    left = stalled(Samples(time, time, np.zeros((100, 3)), np.zeros((100, 3))), np.array([[2.0, 3.0]]))
    assert len(left.time) == 90
    assert not ((left.time >= 2.0) & (left.time < 3.0)).any()


def test_every_second_sample_is_a_copy_where_samples_are_duplicated():
    time = np.arange(20) / 10.0
    values = np.arange(60.0).reshape(20, 3)
    fault = draw_fault(np.random.default_rng(1), "duplicated", 0.95)
    found = fault.inject(Samples(time, time, values, values)).specific_force
    np.testing.assert_array_equal(found[:11], values[:11])
    np.testing.assert_array_equal(found[11::2], found[10:19:2])
    np.testing.assert_array_equal(found[10::2], values[10::2])


@pytest.mark.parametrize("seed", range(len(CYCLE)))
def test_a_seed_is_one_mission_and_no_line_is_aliased_to_a_standstill(seed):
    mission = draw(seed)
    assert mission.kind == CYCLE[seed]
    assert draw(seed).paces_hz == mission.paces_hz
    for line in mission.shaking.lines:
        for pace in mission.paces_hz:
            assert abs(line.frequency - round(line.frequency / pace) * pace) > min(0.8, pace / 6.0) - 1e-9
    if mission.kind == "two faults":
        first, second = mission.faults
        assert first.unit != second.unit
        assert second.fault.start == pytest.approx(first.fault.start + 30.0)


def test_logs_hold_what_the_units_read_to_the_microsecond(tmp_path):
    seed = next(seed for seed in range(200) if len(draw(seed).rates_hz) == 2 and not draw(seed).has_aged)
    print(f"seed {seed}")
    _, flight = draw(seed).fly()
    logs, _ = write(flight, tmp_path)
    table = pq.read_table(logs[1])
    np.testing.assert_allclose(1e-6 * table["time_us"].to_numpy(), flight.recorded[1].time, atol=5.1e-7)
    assert 1.0 / np.diff(flight.recorded[1].arrival).min() == pytest.approx(draw(seed).paces_hz[1])
    np.testing.assert_allclose(table["ay"].to_numpy(), flight.recorded[1].specific_force[:, 1], rtol=1e-6)


def test_a_log_holds_the_warming_where_its_unit_has_a_thermometer(tmp_path):
    _, flight = draw(9).fly()
    logs, _ = write(flight, tmp_path)
    tables = [pq.read_table(log) for log in logs]
    has = ["temperature" in table.column_names for table in tables]
    assert has == [unit.thermometer is not None for unit in flight.units] == [False, True]
    unit, logged = flight.units[1], tables[1]["temperature"].to_numpy()
    true = AMBIENT + unit.thermometer.offset + unit.warmth(flight.recorded[1].arrival, flight.warming)
    np.testing.assert_allclose(logged, true, atol=6.0 * THERMOMETER_NOISE + unit.thermometer.step)
    steps = logged / unit.thermometer.step
    np.testing.assert_allclose(steps, np.round(steps), atol=2e-3)


def test_half_of_the_units_have_a_thermometer():
    print("seed 5")
    random = np.random.default_rng(5)
    drawn = [draw_thermometer(random) for _ in range(400)]
    assert 160 < sum(each is not None for each in drawn) < 240


def test_the_true_errors_leave_nothing_of_a_secondary(body):
    seed = next(seed for seed in range(200) if len(draw(seed).rates_hz) == 2)
    print(f"seed {seed}")
    _, flight = draw(seed).fly()
    flight = replace(flight, warming=0.0)
    primary, unit = flight.units
    for name in SENSORS:
        own, other = primary.triads[name], unit.triads[name]
        matrix = other.matrix @ np.linalg.inv(own.matrix)
        stored = SimpleNamespace(matrix=matrix, bias=other.bias - matrix @ own.bias, lever_arm=None)
        stated = replace(unit, stated_arm=unit.arm)
        exact = replace(flight, units=(primary, stated))
        time = np.arange(1.0, 60.0, 0.05)
        assert error_of(exact, 1, name, stored, time) < 0.01
        wrong = SimpleNamespace(matrix=matrix, bias=stored.bias + np.array([0.5, 0.0, 0.0]), lever_arm=None)
        assert error_of(exact, 1, name, wrong, time) == pytest.approx(0.5, rel=0.1)


def _two_faults():
    mission = next(draw(seed) for seed in range(20) if draw(seed).kind == "two faults")
    faults = (
        PlacedFault(0, replace(mission.faults[0].fault, start=100.0)),
        PlacedFault(1, replace(mission.faults[1].fault, start=130.0)),
    )
    return replace(mission, faults=faults, duration=190.0)


START = (0.1, 0, "selected", {"reason": "start"})


def unhealthy(time, unit):
    return (time, unit, "unhealthy", {"reason": "out of family"})


@pytest.mark.parametrize(
    ("named", "outcome"),
    [
        ([(101.0, 0), (131.0, 1)], "right"),
        ([(101.0, 0)], "missed"),
        ([(131.0, 1)], "missed"),
        ([(101.0, 0), (131.0, 2)], "wrong"),
        ([(101.0, 0), (120.0, 0), (131.0, 0), (132.0, 1)], "right"),
        ([(50.0, 1), (101.0, 0), (131.0, 1)], "too early"),
    ],
)
def test_two_faults_have_to_be_named_each_in_its_time(named, outcome):
    assert judged(_two_faults(), [START, *(unhealthy(*each) for each in named)]).outcome == outcome


def test_faulty_source_is_counted_after_five_seconds():
    def selected(time, unit):
        return (time, unit, "selected", {"reason": "primary failed"})

    mission = _two_faults()
    assert on_faulty(mission, [selected(0.0, 0), selected(101.0, 2)]) == 0.0
    assert on_faulty(mission, [selected(0.0, 0), selected(108.0, 2)]) == pytest.approx(3.0)
    assert on_faulty(mission, [selected(0.0, 0), selected(101.0, 1)]) == pytest.approx(190.0 - 135.0)


def test_output_is_missing_only_where_a_unit_sends():
    time = np.arange(0.0, 10.0, 0.01)
    recorded = [Samples(time, time, np.zeros((1000, 3)), np.zeros((1000, 3)))]

    def result(gap):
        kept = time[(time < gap[0]) | (time >= gap[1])]
        return SimpleNamespace(output=SimpleNamespace(time=kept))

    assert missing_output(result((4.0, 4.0)), recorded, [], 9.99) == 0.0
    assert missing_output(result((4.0, 5.0)), recorded, [], 9.99) == pytest.approx(1.01)
    assert missing_output(result((4.0, 5.0)), recorded, [[4.0, 5.0]], 9.99) == 0.0
    assert missing_output(result((9.0, 10.0)), recorded, [], 9.99) == pytest.approx(1.0)


def test_dead_unit_of_three_is_isolated_at_once_through_logs():
    seed = next(
        seed
        for seed in range(2000)
        if (mission := draw(seed)).kind == "dead"
        and len(mission.rates_hz) == 3
        and min(mission.rates_hz) >= 100.0
        and not (mission.has_aged or mission.all_stall or mission.one_stalls)
    )
    print(f"seed {seed}")
    mission = draw(seed)
    found = scored(mission, replayed(mission))
    assert found["outcome"] == "right"
    assert found["isolated"] < 0.2
    assert (found["misled"], found["missing"]) == (0, 0.0)


def test_campaign_goes_on_where_its_results_end(tmp_path, monkeypatch):
    monkeypatch.setattr(flight_campaign, "save", lambda *_: pytest.fail("kept"))
    arguments = ["--missions", "1", "--seed", "16", "--jobs", "1", "--results", str(tmp_path)]
    assert flight_campaign.main(arguments) == 0
    parts = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.parquet")}
    assert len(parts) == 1
    assert flight_campaign.main(arguments) == 0
    assert parts == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.parquet")}


def test_missions_of_one_kind_have_the_seeds_of_the_whole_campaign():
    seeds = flight_campaign.chosen(4, 100, "two faults")
    assert seeds == [106, 119, 126, 139]
    assert {draw(seed).kind for seed in seeds} == {"two faults"}
    assert flight_campaign.chosen(3, 7, None) == [7, 8, 9]
