"""Missions with drawn faults and settings: nothing adopted makes a unit worse, and the judge detects it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]

from benchmarks import redundancy_adoptions, redundancy_fit_models  # noqa: E402
from benchmarks.redundancy_flown import error_left, replayed, root_mean_square  # noqa: E402
from benchmarks.redundancy_mission import draw  # noqa: E402
from benchmarks.redundancy_truth import reference  # noqa: E402

from repetitions import repetitions  # noqa: E402
from tumble.tools.simulate.flight.procedure import simulate_flight  # noqa: E402

SEEDS = range(5000, 5000 + repetitions(80))


@pytest.fixture(scope="module")
def figures():
    print(f"seeds {SEEDS.start} to {SEEDS.stop - 1}")
    return redundancy_adoptions.summary([redundancy_adoptions.flown(seed) for seed in SEEDS])


@pytest.mark.parametrize("failure", ["crashes", "wrongly adopted", "false triggers", "missed triggers"])
def test_no_mission_of_a_small_campaign_has_one(figures, failure):
    assert figures["counts"][failure] == 0, figures["failed"]


def test_a_small_campaign_adopts_and_its_figures_are_finite(figures):
    assert figures["counts"]["adopted"] > len(SEEDS) / 4
    for of in figures["adoptions"].values():
        assert of["share"]["number"] > 0
        assert np.isfinite(list(of["share"].values())).all()
        assert 0.0 < of["share"]["median"] < 1.0


def test_a_mission_is_drawn_alike_every_time_and_others_differ():
    assert draw(7) == draw(7)
    assert draw(7) != draw(8)


def test_a_faultless_primary_says_what_the_judge_measures_by():
    mission = draw(3)
    scenario = replace(mission.scenario, units=[replace(u, faults=()) for u in mission.scenario.units])
    flight = simulate_flight(scenario)
    rest = (flight.units[0].time > 1.0) & (flight.units[0].time < scenario.rest_seconds - 1.0)
    time = flight.units[0].time[rest]
    uncalibrated = replace(mission, calibrated=False, scenario=scenario)
    said = reference(uncalibrated, flight, time, 0.0)
    left = flight.units[0].specific_force[rest].mean(axis=0) - said["accelerometer"].mean(axis=0)
    np.testing.assert_allclose(left, 0.0, atol=0.005)
    left = flight.units[0].angular_rate[rest].mean(axis=0) - said["gyroscope"].mean(axis=0)
    np.testing.assert_allclose(left, 0.0, atol=0.0005)


def test_the_judge_sees_an_error_that_is_made_worse():
    flown = replayed(next(mission for mission in map(draw, SEEDS) if not mission.faults))
    time = flown.joined("window_time")
    truth = flown.flight.truth(time, flown.window)
    measure = reference(flown.mission, flown.flight, time, flown.window)["accelerometer"]
    unit = flown.flight.units[1]
    true = {"matrix": unit.accelerometer.M, "bias": unit.accelerometer.b, "lever_arm": unit.lever_arm}
    worse = true | {"bias": unit.accelerometer.b + 0.5}
    as_read = flown.of_units("specific_force")[1] @ unit.nominal_mounting.T
    well, badly = (
        root_mean_square(
            error_left(flown, 1, "accelerometer", record, as_read, truth, measure)[10:-10], flown.window
        )
        for record in (true, worse)
    )
    assert badly > 0.5 > 2.0 * well


def test_only_the_top_model_of_the_ladder_estimates_a_lever_arm():
    pair = redundancy_fit_models.draw_pair(np.random.default_rng(11), 0.1)
    top = redundancy_fit_models.calibrate(pair, "affine and lever arm")
    below = redundancy_fit_models.calibrate(pair, "affine")
    np.testing.assert_allclose(top["lever_arm"], pair.arm, atol=0.003)
    left = [pair.left(each["matrix"], each["bias"], each["lever_arm"]) for each in (top, below)]
    assert left[0] < 0.002 < 0.1 < left[1]
