"""Simulated turntable sessions: recordings follow from the stated truth."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tumble.poses.pose_list import SIX_FACES
from tumble.tools.simulate import (
    FAULTS,
    Fault,
    Grade,
    TurntableScenario,
    grade_names,
    simulate_turntable,
)

EARTH_RATE = 7.292115e-5
QUICK = {"rest_seconds": 2.0, "bias_instability": False, "quantisation": False}
seeds = st.integers(0, 2**64 - 1)


def rows_at_rest(unit, rest):
    """Rows of a unit whose clock is the session's, while the table rests."""
    return (unit.samples.time >= rest.start) & (unit.samples.time <= rest.end)


def noiseless(name):
    grade = Grade.named(name)
    silent = {"noise_density": 0.0, "quantisation": 0.0}
    return replace(
        grade,
        accelerometer=replace(grade.accelerometer, **silent),
        gyroscope=replace(grade.gyroscope, **silent),
    )


def rotation(vector):
    """Rodrigues."""
    angle = np.linalg.norm(vector)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@given(seed=seeds, latitude=st.floats(-90, 90), heading=st.floats(-360, 360))
@settings(max_examples=20)
def test_at_rest_the_truth_is_gravity_and_the_rate_of_the_earth(seed, latitude, heading):
    session = simulate_turntable(
        seed=seed, latitude_deg=latitude, heading_turn_deg=heading, rest_seconds=0.2, grades=()
    )
    for rest in session.rests:
        assert np.linalg.norm(rest.specific_force) == pytest.approx(9.80665, rel=1e-12)
        assert np.linalg.norm(rest.angular_rate) == pytest.approx(EARTH_RATE, rel=1e-12)
        up = rest.specific_force / 9.80665
        assert up @ rest.angular_rate == pytest.approx(EARTH_RATE * np.sin(np.radians(latitude)), abs=1e-16)


@given(seed=seeds)
@settings(max_examples=10)
def test_unit_at_rest_reads_m_u_plus_b_plus_g_f_within_its_noise(seed):
    session = simulate_turntable(seed=seed, **QUICK)
    for unit in session.units:
        for rest in session.rests:
            rows = rows_at_rest(unit, rest)
            count = np.count_nonzero(rows)
            for triad, u, readings in (
                (unit.accelerometer, rest.specific_force, unit.samples.accelerometer),
                (unit.gyroscope, rest.angular_rate, unit.samples.gyroscope),
            ):
                expected = triad.M @ u + triad.b + triad.g_sensitivity @ rest.specific_force
                sigma = triad.noise_density * np.sqrt(200.0 / count)
                assert np.abs(readings[rows].mean(axis=0) - expected).max() < 6 * sigma


def test_a_sample_scatters_by_noise_density_times_root_of_rate():
    session = simulate_turntable(grades=("consumer",), **{**QUICK, "rest_seconds": 60.0})
    unit = session["target_1"]
    rows = rows_at_rest(unit, session.rests[0])
    expected = unit.grade.accelerometer.noise_density * np.sqrt(200.0)
    found = unit.samples.accelerometer[rows].std(axis=0)
    assert found == pytest.approx(expected, rel=4 / np.sqrt(2 * np.count_nonzero(rows)))


def test_the_reference_scatters_by_3_mm_s2_a_sample_at_200_hz():
    assert Grade.named("reference").accelerometer.noise_density * np.sqrt(200) == pytest.approx(0.003)


@pytest.mark.parametrize("profile", ["smooth", "trapezoid"])
@pytest.mark.parametrize("heading", [0.0, 50.0])
def test_corrected_gyroscope_carries_gravity_between_rests(profile, heading):
    session = simulate_turntable(
        grades=(noiseless("tactical"),),
        g_sensitivity=False,
        latitude_deg=None,
        turn_profile=profile,
        heading_turn_deg=heading,
        table_error_deg=0.5,
        rate_hz=500.0,
        **QUICK,
    )
    unit = session["target_1"]
    rates = (unit.samples.gyroscope - unit.gyroscope.b) @ np.linalg.inv(unit.gyroscope.M).T
    for before, after in zip(session.rests, session.rests[1:], strict=False):
        moving = (unit.samples.time > before.start + 1.0) & (unit.samples.time < after.end - 1.0)
        up = before.specific_force
        for rate in rates[moving]:
            up = rotation(-rate / 500.0) @ up
        # The sum of samples is good to the second order of the sample period.
        assert np.linalg.norm(up - after.specific_force) < 2e-4 * 9.80665


def test_twelve_parameters_fitted_to_rest_means_are_the_truth():
    session = simulate_turntable(grades=("tactical",), **{**QUICK, "rest_seconds": 20.0})
    unit = session["target_1"]
    truth = np.array([[*rest.specific_force, 1.0] for rest in session.rests])
    rests = [unit.samples.accelerometer[rows_at_rest(unit, rest)] for rest in session.rests]
    means = np.array([rows.mean(axis=0) for rows in rests])
    found = np.linalg.lstsq(truth, means, rcond=None)[0].T
    sigma = unit.accelerometer.noise_density / np.sqrt(20.0)
    assert np.abs(found[:, :3] - unit.accelerometer.M).max() < 6 * sigma / 9.8
    assert np.abs(found[:, 3] - unit.accelerometer.b).max() < 6 * sigma


@given(seed=seeds)
@settings(max_examples=10)
def test_the_parts_of_a_matrix_make_the_matrix(seed):
    for unit in simulate_turntable(seed=seed, rest_seconds=0.1).units:
        for triad in (unit.accelerometer, unit.gyroscope):
            assert np.abs(triad.K @ triad.L @ triad.Q - triad.M).max() < 1e-14
            assert np.abs(rotation(triad.mounting) - triad.Q).max() < 1e-12
            axes = triad.L @ triad.L.T
            sines = [axes[0, 1], axes[1, 2], axes[2, 0]]
            assert np.arcsin(sines) == pytest.approx(triad.non_orthogonality, abs=1e-15)


def test_bias_instability_adds_its_drift_to_the_same_white_noise():
    white = simulate_turntable(**QUICK)
    both = simulate_turntable(**{**QUICK, "bias_instability": True})
    for unit, moved in zip(white.units, both.units, strict=True):
        shift = moved.samples.gyroscope.mean(axis=0) - unit.samples.gyroscope.mean(axis=0)
        assert shift == pytest.approx(moved.gyroscope.drift, rel=1e-6, abs=1e-14)
        assert np.all(unit.gyroscope.drift == 0.0)


def test_outputs_come_in_the_steps_of_their_grade_within_its_range():
    unit = simulate_turntable(grades=("consumer",), rest_seconds=1.0)["target_1"]
    grade = unit.grade.accelerometer
    steps = unit.samples.accelerometer / grade.quantisation
    assert np.abs(steps - np.round(steps)).max() < 1e-6
    assert np.abs(unit.samples.accelerometer).max() <= grade.range


def test_a_mounting_has_the_angle_or_the_rotation_vector_asked_for():
    drawn = simulate_turntable(mounting_angle_deg=3.0, rest_seconds=0.1)
    assert np.degrees(np.linalg.norm(drawn.mounting)) == pytest.approx(3.0)
    vector = (0.5, -0.25, 90.0)
    given_vector = simulate_turntable(
        mounting_angle_deg=vector,
        target_mounting_deg={"target_2": vector},
        grades=("tactical", replace(Grade.named("tactical"), name="square")),
        rest_seconds=0.1,
    )
    assert np.degrees(given_vector.mounting) == pytest.approx(vector)
    assert np.abs(rotation(given_vector.mounting) - given_vector.R_e).max() < 1e-12
    # The triads sit in their package within 0.25/3 deg, 1 sigma about each axis.
    target = np.degrees(given_vector["target_2"].accelerometer.mounting)
    assert target == pytest.approx(vector, abs=6 * 0.25 / 3)


def test_a_perfect_reference_has_bias_and_noise_only():
    unit = simulate_turntable(perfect_reference=True, rest_seconds=0.1).reference_unit
    assert np.array_equal(unit.accelerometer.M, np.eye(3))
    assert np.array_equal(unit.gyroscope.M, np.eye(3))
    assert np.any(unit.accelerometer.b != 0.0)


def test_shared_clock_stamps_units_alike_and_separate_ones_do_not():
    shared = simulate_turntable(**QUICK)
    assert all(np.array_equal(unit.samples.time, shared.units[0].samples.time) for unit in shared.units)
    assert len({recording.metadata.clock for recording in (shared.reference, *shared.targets)}) == 1
    assert shared.reference.metadata.clock
    apart = simulate_turntable(clocks="apart", **QUICK)
    assert apart.reference_unit.clock.offset == 0.0
    for unit in apart.target_units:
        assert 0.0 < abs(unit.clock.offset) <= 5.0
        assert 0.0 < abs(unit.clock.skew) < 6 * 50.0
        assert unit.recording.metadata.clock == ""
        # First sample: a part of a period after the start.
        first = (unit.samples.time[0] - unit.clock.offset) / (1 + unit.clock.skew * 1e-6)
        assert first == pytest.approx(unit.clock.phase / 200.0, abs=1e-12)


def test_a_lever_arm_is_felt_while_the_table_turns_only():
    options = {"grades": (noiseless("tactical"),), "latitude_deg": None, "seed": 5, **QUICK}
    centre = simulate_turntable(**options)
    away = simulate_turntable(lever_arm_m={"target_1": (0.0, 0.3, 0.2)}, **options)
    difference = away["target_1"].samples.accelerometer - centre["target_1"].samples.accelerometer
    resting = np.any([rows_at_rest(away["target_1"], rest) for rest in away.rests], axis=0)
    assert np.abs(difference[resting]).max() < 1e-12
    # 60 deg/s at 0.36 m pulls by 0.4 m/s^2.
    assert 0.2 < np.abs(difference[~resting]).max() < 1.5


def test_poses_come_in_the_requested_order_and_tipped_ones_miss():
    visits = ("Z up", "X up", "Z up", "Y down")
    session = simulate_turntable(
        visits=visits, tipped_deg={"X up": 2.0}, table_error_deg=0.0, mounting_angle_deg=0.0, rest_seconds=0.5
    )
    assert tuple(rest.pose for rest in session.rests) == visits
    ups = {pose.name: pose.up for pose in SIX_FACES}
    for rest in session.rests:
        angle = np.degrees(np.arccos(np.clip(rest.specific_force @ ups[rest.pose] / 9.80665, -1.0, 1.0)))
        assert angle == pytest.approx(2.0 if rest.pose == "X up" else 0.0, abs=1e-5)


def test_temperature_warms_up_and_takes_the_bias_with_it():
    session = simulate_turntable(
        grades=(noiseless("consumer"),), warm_up_kelvin=10.0, warm_up_seconds=20.0, **QUICK
    )
    unit = session["target_1"]
    assert unit.samples.temperature[0] == pytest.approx(25.0, abs=0.01)
    assert unit.samples.temperature[-1] > 30.0
    warmth = unit.samples.temperature.mean() - 25.0
    expected = unit.accelerometer.temperature_coefficient * warmth
    assert unit.accelerometer.drift == pytest.approx(expected, rel=1e-2)


def test_every_kind_of_fault_shows_as_it_is_described():
    plain = simulate_turntable(grades=("tactical",), **QUICK)["target_1"]

    def corrupted(kind, **what):
        fault = Fault(kind, **what)
        unit = simulate_turntable(grades=("tactical",), faults={"target_1": fault}, **QUICK)["target_1"]
        assert unit.faults == (fault,)
        return unit

    before = plain.samples.time < 1.0
    forces, rates = plain.samples.accelerometer, plain.samples.gyroscope

    assert corrupted("scale", axis="z").accelerometer.K[2, 2] == pytest.approx(
        1.2 * plain.accelerometer.K[2, 2]
    )
    stuck = corrupted("stuck", triad="gyroscope", axis="y").samples.gyroscope
    assert np.ptp(stuck[~before, 1]) == 0.0
    assert np.array_equal(stuck[before], rates[before])
    moved = corrupted("moved", axis="y", size=5.0).samples.accelerometer
    assert np.array_equal(moved[before], forces[before])
    turned = np.degrees(np.linalg.norm(moved[250] - forces[250]) / 9.80665)
    assert turned == pytest.approx(5.0, abs=0.1)
    saturated = corrupted("saturated").samples.accelerometer
    assert np.abs(saturated).max() == pytest.approx(0.8 * 9.80665)
    missing = np.isnan(corrupted("nan", axis="y", start=1.0, end=1.5).samples.accelerometer)
    assert missing[:, 1].sum() == 100
    assert missing.sum() == 100
    swapped = corrupted("swapped-axes", axis="y").samples
    assert np.array_equal(swapped.accelerometer, forces[:, [0, 2, 1]])
    assert np.array_equal(swapped.gyroscope, rates[:, [0, 2, 1]])
    assert np.array_equal(corrupted("left-handed", axis="z").samples.gyroscope, rates * [1, 1, -1])
    in_g = corrupted("wrong-unit").samples.accelerometer
    assert in_g == pytest.approx(forces / 9.80665)
    in_degrees = corrupted("wrong-unit", triad="gyroscope").samples.gyroscope
    assert in_degrees == pytest.approx(np.degrees(rates))
    gap = corrupted("gap", start=3.0, end=4.0).samples.time
    assert np.diff(gap).max() == pytest.approx(1.0, abs=0.011)
    doubled = corrupted("doubled", start=3.0, end=4.0).samples.time
    assert np.count_nonzero(np.diff(doubled) == 0.0) == pytest.approx(200, abs=1)
    backwards = corrupted("time-backwards").samples.time
    assert np.diff(backwards).min() == pytest.approx(-1.0 + 1 / 200)


def test_the_faults_of_one_unit_leave_the_others_alone():
    faults = {"target_2": [Fault("gap"), Fault("left-handed")]}
    plain, faulty = simulate_turntable(**QUICK), simulate_turntable(faults=faults, **QUICK)
    for name in ("reference", "target_1", "target_3"):
        assert np.array_equal(plain[name].samples.gyroscope, faulty[name].samples.gyroscope)
    assert len(faulty["target_2"].samples) < len(plain["target_2"].samples)


def test_recordings_hold_what_the_units_measured():
    session = simulate_turntable(**QUICK)
    assert [recording.name for recording in session.targets] == ["target_1", "target_2", "target_3"]
    for unit in session.units:
        (chunk,) = unit.recording.chunks()
        assert np.array_equal(chunk.accelerometer, unit.samples.accelerometer)
        assert np.array_equal(chunk.time, unit.samples.time)
    with pytest.raises(KeyError):
        session["target_9"]


def test_every_grade_names_figures_that_are_not_negative():
    assert grade_names() == ("consumer", "industrial", "tactical", "reference")
    for name in grade_names():
        grade = Grade.named(name)
        for triad in (grade.accelerometer, grade.gyroscope):
            assert all(value >= 0.0 for value in asdict(triad).values())
    with pytest.raises(ValueError, match="navigation"):
        Grade.named("navigation")


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ({"kind": "broken"}, "unknown fault 'broken'"),
        ({"kind": "gap", "axis": "w"}, "axis needs to be x, y or z, found 'w'"),
        ({"kind": "gap", "triad": "magnetometer"}, "found 'magnetometer'"),
    ],
)
def test_a_fault_that_does_not_exist_is_refused(what, words):
    with pytest.raises(ValueError, match=words):
        Fault(**what)


def test_every_fault_is_described():
    assert all(text and "\n" not in text for text in FAULTS.values())


def test_a_scenario_can_be_given_whole_or_in_changes():
    scenario = TurntableScenario(seed=8, rest_seconds=0.2)
    assert simulate_turntable(scenario).scenario == scenario
    assert simulate_turntable(scenario, seed=9).scenario == replace(scenario, seed=9)
