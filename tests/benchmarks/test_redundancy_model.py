"""The model of a redundant set obeys its laws; faults of real flights are drawn and judged by theirs."""

from dataclasses import fields, replace

import numpy as np
import pytest
from benchmarks.flights import folder as flight_folder
from benchmarks.flights import px4_voter, recorded
from benchmarks.flights.body import GRID_HZ, attitudes, fly, turned_back
from benchmarks.flights.classes import CLASSES
from benchmarks.flights.model.aiding import Navigation
from benchmarks.flights.model.clock import synchronised
from benchmarks.flights.model.core import flown_by_core, triangles
from benchmarks.flights.model.error import (
    ACCELEROMETER_SIGMA,
    GYROSCOPE_SIGMA,
    UNCALIBRATED,
    Grade,
    Information,
    force_design,
    levers,
    nothing_known,
)
from benchmarks.flights.model.hypotheses import Vote
from benchmarks.flights.model.limits import Limits
from benchmarks.flights.model.monitor import flown
from benchmarks.flights.model.output import fused
from benchmarks.flights.model.rest import Rests
from benchmarks.flights.model.statement import Statement
from benchmarks.flights.model.vibration import of_set
from benchmarks.flights.model.window import HOP, averaged, grid
from benchmarks.flights.stored_errors import corrected, learnt, records
from benchmarks.flights.wilson import wilson
from benchmarks.redundancy_set import Samples

from tumble import _core
from tumble.foundation.constants import STANDARD_GRAVITY

MOTIONS = np.array([[1.0, 40.0]])
RATE = 120.0


def samples_of(body, arm, delay=0.0, noise=(0.02, 0.002), seed=0):
    """Samples of a perfect unit at a place, whose clock is late."""
    time = np.arange(0.1, body.time[-1] - 0.2, 1.0 / RATE)
    random = np.random.default_rng(seed)
    force, rate = body.at(time - delay, np.asarray(arm))
    return Samples(
        time,
        time,
        force + noise[0] * random.standard_normal(force.shape),
        rate + noise[1] * random.standard_normal(rate.shape),
    )


@pytest.fixture(scope="module")
def body():
    """A body that moves for nearly all of 42 s."""
    print("seed 5")
    return fly(np.random.default_rng(5), MOTIONS, 42.0, 0.1)


@pytest.fixture(scope="module")
def three(body):
    """Three sound units at three places."""
    return [samples_of(body, arm, seed=n) for n, arm in enumerate([(0, 0, 0), (0.05, 0, 0), (0, 0.04, 0.02)])]


@pytest.fixture(scope="module")
def flown_alone(three):
    """Run of the three sound units by the model."""
    (run,) = flown([three])
    return run


def test_information_in_blocks_is_batch_least_squares_of_rates():
    random = np.random.default_rng(3)
    print("seed 3")
    rate, difference = random.standard_normal((40, 3)), 0.1 * random.standard_normal((40, 3))
    errors = nothing_known(1, 2)
    for part in (slice(0, 15), slice(15, 40)):
        block = Information.none(1, 2)
        for x, d in zip(rate[part], difference[part], strict=True):
            block.add_rate(x[None], np.array([[np.zeros(3), d]]), np.ones((1, 2)))
        errors = errors.informed(block, np.ones((1, 2)))
    phi = np.column_stack([rate, np.ones(40)]) / GYROSCOPE_SIGMA
    prior = np.diag([UNCALIBRATED.matrix**-2] * 3 + [UNCALIBRATED.gyroscope_bias**-2])
    covariance = np.linalg.inv(prior + phi.T @ phi)
    np.testing.assert_allclose(errors.rate_covariance[0, 1], covariance, rtol=1e-7, atol=1e-15)
    np.testing.assert_allclose(
        errors.rate[0, 1], (covariance @ phi.T @ difference / GYROSCOPE_SIGMA).T, rtol=1e-7, atol=1e-12
    )
    assert not errors.rate[0, 0].any()
    assert not errors.rate_covariance[0, 0].any()


def test_information_of_forces_is_batch_least_squares():
    random = np.random.default_rng(4)
    print("seed 4")
    force, lever = random.standard_normal((60, 3)) * 5.0, random.standard_normal((60, 3, 3)) * 3.0
    difference = random.standard_normal((60, 3))
    block = Information.none(1, 2)
    for x, w, d in zip(force, lever, difference, strict=True):
        block.add_force(x[None], w[None], np.array([[np.zeros(3), d]]), np.ones((1, 2)))
    errors = nothing_known(1, 2).informed(block, np.ones((1, 2)))
    design = force_design(force, lever).reshape(-1, 15) / ACCELEROMETER_SIGMA
    sigmas = [UNCALIBRATED.matrix] * 9 + [UNCALIBRATED.accelerometer_bias] * 3 + [UNCALIBRATED.arm] * 3
    covariance = np.linalg.inv(np.diag(np.array(sigmas) ** -2) + design.T @ design)
    np.testing.assert_allclose(errors.force_covariance[0, 1], covariance, rtol=1e-6, atol=1e-14)
    np.testing.assert_allclose(
        errors.force[0, 1],
        covariance @ design.T @ difference.ravel() / ACCELEROMETER_SIGMA,
        rtol=1e-6,
        atol=1e-10,
    )


def test_information_that_is_not_chosen_changes_nothing():
    block = Information.none(1, 2)
    block.add_rate(np.ones((1, 3)), np.ones((1, 2, 3)), np.ones((1, 2)))
    before = nothing_known(1, 2)
    after = before.informed(block, np.zeros((1, 2)))
    for each in fields(before):
        np.testing.assert_array_equal(getattr(after, each.name), getattr(before, each.name))


def test_levers_are_those_of_a_rigid_body():
    random = np.random.default_rng(6)
    print("seed 6")
    w, change, arm = random.standard_normal((3, 3))
    product = [*w**2, w[0] * w[1], w[0] * w[2], w[1] * w[2]]
    expected = np.cross(change, arm) + np.cross(w, np.cross(w, arm))
    np.testing.assert_allclose(levers(change, np.array(product)) @ arm, expected, atol=1e-12)


def test_a_triangle_is_exact_for_a_parabola_of_samples():
    time = np.arange(0.0, 3.0, 0.001)
    force = np.column_stack([time, time**2, np.ones_like(time)])
    at = HOP * np.arange(20, 41)
    reading, change, *_ = averaged(Samples(time, time, force, force), at)
    # The mean of t^2 under a triangle of half width h is t^2 + h^2 / 6.
    np.testing.assert_allclose(reading[:, 1], at**2 + HOP**2 / 6.0, atol=1e-6)
    np.testing.assert_allclose(change[:, 1], 2.0 * at, atol=1e-6)
    np.testing.assert_allclose(reading[:, 0], at, atol=1e-9)


def test_a_window_with_a_missing_sample_is_not_whole():
    time = np.delete(np.arange(0.0, 4.0, 0.01), 200)
    samples = Samples(time, time, np.zeros((len(time), 3)), np.zeros((len(time), 3)))
    at = grid([samples])
    whole = averaged(samples, at)[4]
    assert not whole[np.abs(at - 2.0) < 0.04].any()
    assert not whole[at < 0.5].any()
    assert whole[(np.abs(at - 2.0) > 0.08) & (at > 0.6) & (at < 3.9)].all()


def corrected_stamps(primary, unit):
    """Stamps of a unit by the clock of the primary, as the model knows it."""
    at = grid([primary, unit])
    return synchronised(averaged(primary, at), unit, at)[2].corrected(unit.time)


def test_the_delay_of_a_clock_is_found_within_a_millisecond(body):
    primary = samples_of(body, (0, 0, 0))
    for delay in (-0.098, -0.02, 0.0, 0.0331, 0.12):
        late = samples_of(body, (0.05, 0, 0), delay, seed=1)
        left = late.time - corrected_stamps(primary, late)
        assert left[late.time > 7.0] == pytest.approx(delay, abs=1.5e-3)


def test_a_crystal_of_its_own_is_followed_and_a_jump_is_not(body):
    primary, late = samples_of(body, (0, 0, 0)), samples_of(body, (0.05, 0, 0), 0.01, seed=1)
    fast = replace(late, time=late.time * (1.0 + 2e-4))
    left = corrected_stamps(primary, fast) - late.time + 0.01
    assert np.abs(left[late.time > 20.0]).max() < 3e-3
    jumped = replace(late, time=late.time + np.where(late.time > 20.0, 0.1, 0.0))
    found = (jumped.time - corrected_stamps(primary, jumped))[jumped.time > 30.0]
    assert found == pytest.approx(0.01, abs=5e-3)


def test_an_axis_that_is_turned_is_no_delay_in_motion_that_goes_round():
    """Both change rates by the same there: 0.01 rad at 0.1 turns a second are 16 ms."""
    time = np.arange(0.1, 60.0, 1.0 / RATE)
    random = np.random.default_rng(7)
    print("seed 7")

    def read(at, turn):
        rate = np.column_stack([np.cos(0.63 * at), np.sin(0.63 * at), 0.3 * np.sin(3.0 * at)])
        turned = rate + turn * np.column_stack([-rate[:, 1], rate[:, 0], np.zeros(len(at))])
        return Samples(time, time, np.zeros_like(rate), turned + 0.002 * random.standard_normal(rate.shape))

    primary, late = read(time, 0.0), read(time - 0.003, 0.01)
    left = late.time - corrected_stamps(primary, late)
    assert left[late.time > 20.0] == pytest.approx(0.003, abs=1.5e-3)


def test_the_vote_names_the_unit_without_which_others_agree():
    ratio = np.zeros((7, 2, 3, 2))
    ratio[0, 0, [0, 2], 0], ratio[0, 0, 1, 0] = 2.0, 0.2
    ratio[0, 1, :, 0] = 1.5
    deviation = np.ones((7, 2, 3, 2, 3)) * ratio[..., None]
    vote = Vote(((0, 1), (0, 2), (1, 2)), 3, ratio.shape)
    both = np.ones((2, 3), dtype=bool)
    assert vote.found(ratio, deviation, both).tolist() == [0, 0]
    assert vote.found(ratio, deviation, both).tolist() == [1 << 1, 0]


@pytest.mark.parametrize(("against", "named"), [(2.0, 0b01010), (0.9, 0)])
def test_the_most_that_agree_name_those_that_each_contradicts(against, named):
    pairs = tuple((i, j) for j in range(5) for i in range(j))
    apart = [3.0 if 1 in pair else against if 3 in pair else 0.2 for pair in pairs]
    ratio = np.zeros((7, 1, 10, 2))
    ratio[0, 0, :, 0] = apart
    deviation = np.ones((7, 1, 10, 2, 3)) * ratio[..., None]
    vote = Vote(pairs, 5, ratio.shape)
    all_pairs = np.ones((1, 10), dtype=bool)
    # Unit 1 alone is named once the others agree well enough.
    assert vote.found(ratio, deviation, all_pairs).tolist() == [0]
    assert vote.found(ratio, deviation, all_pairs).tolist() == [named]


def test_no_unit_raises_the_vibration_of_the_set_alone():
    ratio = np.ones((1, 3, 2))
    ratio[0, 1] = 100.0
    assert of_set(ratio, np.ones((1, 3), dtype=bool)).max() == 1.0
    assert of_set(ratio[:, :2], np.ones((1, 2), dtype=bool)).max() == 1.0


def test_sound_units_learn_each_other_and_none_is_named(flown_alone):
    assert {event[2] for event in flown_alone.events} == {"selected"}
    errors = flown_alone.errors
    sigma = np.sqrt(errors.force_covariance[0, 1, 12, 12])
    np.testing.assert_allclose(errors.force[0, 1, 12:], [0.05, 0.0, 0.0], atol=4.0 * sigma)


def test_runs_of_a_batch_are_those_flown_alone(three, flown_alone):
    faulty = CLASSES["gyroscope step 0.2 rad/s"].inject(three[1], 20.0, np.random.default_rng(2))
    faulty_run = [three[0], faulty, three[2]]
    together = flown([three, faulty_run])
    assert [each.events for each in together] == [flown_alone.events, flown([faulty_run])[0].events]
    named = [event for event in together[1].events if event[2] == "unhealthy"]
    assert [event[1] for event in named] == [1]
    assert 20.0 < named[0][0] < 20.3


def reported(events):
    """Events in the precision in which both report them, with the figures that both have."""
    both = ("reason", "other")
    return [
        (round(time, 3), unit, name, {key: each for key, each in figures.items() if key in both})
        for time, unit, name, figures in events
    ]


@pytest.mark.parametrize("find_delays", [True, False])
def test_the_core_takes_the_steps_of_the_model(find_delays, three):
    random = np.random.default_rng(2)
    names = ("gyroscope step 0.2 rad/s", "accelerometer noise 10 m/s^2", "unit loses 60 % of its samples")
    runs = [[three[0], CLASSES[name].inject(three[1], 20.0, random), three[2]] for name in names]
    for run, expected in zip([three, *runs], flown([three, *runs], find_delays=find_delays), strict=True):
        for precision in ("f64", "f32"):
            events, errors = flown_by_core(run, find_delays=find_delays, precision=precision)
            assert reported(events) == reported(expected.events)
        errors = flown_by_core(run, find_delays=find_delays)[1]
        for each in fields(errors):
            # A millionth of the least sigma that is ever learnt; normal equations lose as many digits.
            np.testing.assert_allclose(
                getattr(errors, each.name), getattr(expected.errors, each.name), rtol=0.0, atol=1e-10
            )


def test_the_core_takes_stored_errors_and_gives_them_back(flown_alone):
    rate, force = triangles(flown_alone.errors, 1)
    monitor = _core.SetMonitor(2)
    monitor.set_errors(1, rate, force)
    known = monitor.errors(1)
    np.testing.assert_allclose(known[0], rate)
    np.testing.assert_allclose(known[1], force)
    assert monitor.errors(0) is None
    with pytest.raises(ValueError, match="2 to 8 units"):
        _core.SetMonitor(9)
    with pytest.raises(ValueError, match="arrays of 2 units"):
        monitor.replay([np.zeros(1)], [np.zeros((1, 3))], [np.zeros((1, 3))])


def test_a_filter_explains_the_velocity_of_a_sound_unit_alone():
    time = np.arange(0.0, 30.0, 1.0 / GRID_HZ)
    rate = 0.3 * np.column_stack([np.sin(0.7 * time), np.cos(0.5 * time), 0.5 * np.sin(0.2 * time)])
    level = attitudes(rate, np.array([1.0, 0.0, 0.0, 0.0]))
    acceleration = 2.0 * np.column_stack([np.sin(time), np.cos(1.3 * time), 0.3 * np.sin(0.4 * time)])
    velocity = np.cumsum(acceleration, axis=0) / GRID_HZ
    force = turned_back(level, acceleration + np.array([0.0, 0.0, STANDARD_GRAVITY]))
    step, span = 25, 250
    filters = Navigation(np.tile(force[:50].mean(axis=0), (2, 1)), np.tile(velocity[0], (2, 1)), np.zeros(2))
    squares = []
    for end in range(step, len(time), step):
        part = slice(end - step, end)
        read = np.tile(rate[part].mean(axis=0), (2, 1))
        read[1, 0] += 0.1 * (time[end] > 15.0)
        filters.advance(np.tile(force[part].mean(axis=0), (2, 1)), read, step / GRID_HZ)
        if end % span == 0:
            mean = velocity[end - span : end].mean(axis=0)
            squares.append(filters.measure(np.tile(mean, (2, 1)), span / GRID_HZ, 0.1))
    sound, faulty = np.array(squares).T
    assert sound.max() < 3.0
    assert faulty[35:].sum() > 20.0 > sound[35:].sum()


def test_the_fused_noise_is_the_bound_of_independent_units():
    random = np.random.default_rng(9)
    print("seed 9")
    noise = np.array([0.2, 0.4, 0.1])
    reading = noise[:, None] * random.standard_normal((4000, 3, 6))
    errors = nothing_known(4000, 3, Grade(0.0, 0.0, 0.0, 0.0))
    variances = np.broadcast_to(noise[:, None] ** 2, (4000, 3, 2))
    motion, active = np.zeros((4000, 18)), np.ones((4000, 3), dtype=bool)
    value, variance = fused(reading, motion, errors, variances, active)
    bound = 1.0 / np.sum(noise**-2.0)
    np.testing.assert_allclose(variance, bound, rtol=1e-12)
    assert np.var(value) == pytest.approx(bound, rel=0.05)
    active[:, 2] = False
    assert np.var(fused(reading, motion, errors, variances, active)[0]) > 2.0 * bound


def test_a_set_without_a_sound_unit_has_no_output():
    errors = nothing_known(1, 2)
    value, variance = fused(
        np.ones((1, 2, 6)), np.zeros((1, 18)), errors, np.ones((1, 2, 2)), np.zeros((1, 2)) > 0
    )
    assert np.isnan(value).all()
    assert np.isinf(variance).all()


def test_statements_turn_readings_and_leave_out_saturated_ones():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    true = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    time = np.arange(2.0)
    said = Statement(turn, None, 6.0, 50.0).turned(Samples(time, time, true @ turn.T, true @ turn.T))
    np.testing.assert_allclose(said.specific_force[0], true[0])
    assert np.isnan(said.specific_force[1]).all()
    np.testing.assert_allclose(said.angular_rate, true)


def test_physics_at_rest_shows_the_unit_that_changed():
    reading = np.tile(np.array([0.0, 0.0, STANDARD_GRAVITY, 0.0, 0.0, 0.0]), (1, 2, 1))
    whole, repeated = np.ones((1, 2), dtype=bool), np.zeros((1, 2, 6), dtype=int)
    rests = Rests(1, 2)
    for _ in range(60):
        rests.take(reading, whole, repeated)
    rests.learn(np.ones((1, 2), dtype=bool))
    reading[0, 1, 3] = 0.05
    for _ in range(60):
        rests.take(reading, whole, repeated)
    sound, changed = rests.evidence()[0]
    assert sound == pytest.approx(0.0, abs=1e-9)
    assert changed > 10.0


def test_a_primary_that_two_contradict_at_rest_is_out_of_limits():
    errors = nothing_known(1, 3, Grade(0.0, 0.0, 0.0, 0.0))
    errors.rate[0, 1:, 2, 3] = -0.15, -0.149
    motion = np.zeros((1, 18))
    for rest, expected in ((True, 0), (False, -1)):
        limits = Limits(((0, 1), (0, 2), (1, 2)), 3, 1)
        found = [
            int(limits.found(errors, motion, np.ones((1, 3), dtype=bool), np.array([rest]))[0])
            for _ in range(4)
        ]
        assert found == [-1, -1, expected, expected]


def test_the_interval_of_wilson_is_that_of_the_literature():
    # Newcombe (1998), table I: 81 of 263, and 0 of 20.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)
    assert wilson(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize("name", CLASSES)
def test_a_class_of_fault_is_the_same_for_a_seed(name, three):
    first, second = (CLASSES[name].inject(three[0], 20.0, np.random.default_rng(8)) for _ in range(2))
    for each in ("time", "specific_force", "angular_rate"):
        np.testing.assert_array_equal(getattr(first, each), getattr(second, each))
        before = three[0].time < 20.0
        np.testing.assert_array_equal(getattr(first, each)[: before.sum()], getattr(three[0], each)[before])
    changed = len(first.time) != len(three[0].time) or any(
        not np.array_equal(getattr(first, each), getattr(three[0], each))
        for each in ("specific_force", "angular_rate")
    )
    assert changed


def test_px4_integrates_what_exceeds_seven_degrees_a_second():
    time = np.arange(0.0, 60.0, 0.01)
    still = np.tile([0.0, 0.0, 9.8], (len(time), 1)) + 1e-3 * np.random.default_rng(0).standard_normal(
        (len(time), 3)
    )
    rate = 1e-4 * np.random.default_rng(1).standard_normal((len(time), 3))
    jumped = rate + np.where(time > 10.0, 0.2, 0.0)[:, None] * [1.0, 0.0, 0.0]
    units = [Samples(time, time, still, each) for each in (rate, jumped, rate)]
    named = [event for event in px4_voter.events(units) if event[2] == "unhealthy"]
    expected = 10.0 + np.radians(15.0) / (0.2 * 2.0 / 3.0 - np.radians(7.0))
    assert [event[1] for event in named] == [1]
    assert named[0][0] == pytest.approx(expected, abs=3.0)


def test_px4_finds_a_silent_unit_after_its_timeout():
    time = np.arange(0.0, 5.0, 0.01)
    noise = np.random.default_rng(0).standard_normal((len(time), 3))
    units = [Samples(time[:n], time[:n], noise[:n], noise[:n]) for n in (500, 200, 500)]
    named = [event for event in px4_voter.events(units) if event[2] == "unhealthy"]
    assert [(event[1], event[3]["reason"]) for event in named] == [(1, "timeout")]
    assert named[0][0] == pytest.approx(1.99 + 0.3)


def test_stored_errors_are_subtracted_and_taken_by_the_monitor(body):
    rate = samples_of(body, (0, 0, 0), seed=1)
    offset = Samples(
        rate.time, rate.time, rate.specific_force + 0.3, rate.angular_rate + np.array([0.02, 0.0, -0.01])
    )
    flight = flight_folder.RecordedFlight(
        "made", (samples_of(body, (0, 0, 0)), offset), np.zeros(0), np.zeros((0, 3))
    )
    errors = learnt([flight]).of_set((0, 1))
    np.testing.assert_allclose(errors.rate[0, 1, :, 3], [0.02, 0.0, -0.01], atol=2e-3)
    left = corrected(flight.units, errors)[1].angular_rate.mean(axis=0) - flight.units[0].angular_rate.mean(
        axis=0
    )
    assert np.abs(left).max() < 2e-3
    assert [record["sensor"] for record in records(errors)] == ["accelerometer", "gyroscope"]
    assert recorded.today(flight.units, errors)


def test_a_folder_that_is_absent_is_stated_and_no_failure(tmp_path, capsys):
    assert recorded.main([str(tmp_path / "none")]) == 0
    assert "holds no folder with imu_1.parquet" in capsys.readouterr().out


@pytest.mark.skipif(not recorded.FOLDER.is_dir(), reason="the recordings in ../shared/data are not here")
def test_a_recorded_flight_is_sound_and_its_faults_are_named(capsys):
    path = flight_folder.flights(recorded.FOLDER)[-1]
    flight = flight_folder.read(path)
    runs = recorded.drawn(
        flight, 1, True, {"units": (3, 4), "classes": "gyroscope step", "draws": 1, "seed": 0}
    )
    for size in (3, 4):
        those = [run for run in runs if len(run.numbers) == size]
        by_model = [each.events for each in flown([r.samples for r in those])]
        by_core = [flown_by_core(r.samples)[0] for r in those]
        assert [reported(each) for each in by_core] == [reported(each) for each in by_model]
        rows = [recorded._row(run, "core", each) for run, each in zip(those, by_core, strict=True)]
        assert not any(row["false"] for row in rows)
        assert all(row["outcome"] == "right" for row in rows if row["fault"])


@pytest.mark.skipif(not recorded.FOLDER.is_dir(), reason="the recordings in ../shared/data are not here")
def test_the_table_of_recorded_flights_names_every_monitor(capsys):
    options = ["--flights", "1", "--classes", "unit dead", "--units", "2", "--draws", "1", "--no-save"]
    assert recorded.main(options) == 0
    printed = capsys.readouterr().out
    assert all(name in printed for name in ("PX4", "today", "model", "core", "aided"))
    # The row of the class and the row of all classes, of eleven monitors.
    assert printed.count("1/0/0") == 2 * len(recorded.MONITORS)
