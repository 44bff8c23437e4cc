"""Simulated sessions by hand: what was put in comes out, within its sigmas."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas
import pytest
import yaml
from scipy.stats import chi2

import tumble
from tumble import Calibration
from tumble.procedures.multipose.report.text import next_sentences
from tumble.procedures.multipose.result import NextOrientation, NextTurn
from tumble.tools.simulate import simulate_multipose, write_multipose
from turntable_sessions import contents, one_line, typed

QUIET = {"bias_instability": False, "g_sensitivity": False, "latitude_deg": None}
OWN = [0, 3, 4, 6, 7, 8, 9, 10, 11]
"""Free elements of [M, b] of an accelerometer in its own axes."""
UNLIKELY = 1e-5


def session(seed, **changes):
    print(f"seed {seed}")
    return simulate_multipose(seed=seed, **{**QUIET, **changes})


def misfit(triad, matrix, bias, free):
    """Chi-square of the errors over the covariance."""
    error = np.concatenate([(triad.M - matrix).ravel(), triad.b - bias])[free]
    return float(error @ np.linalg.solve(triad.covariance[np.ix_(free, free)], error))


@pytest.fixture(scope="module")
def hand():
    return session(11)


@pytest.fixture(scope="module")
def found(hand):
    return tumble.multipose(hand.recording)


def test_both_sensors_come_out_as_they_were_within_their_covariance(hand, found):
    unit = hand.unit
    force = misfit(found.accelerometer, hand.force_matrix, unit.accelerometer.b, OWN)
    rate = misfit(found.gyroscope, hand.rate_matrix, unit.gyroscope.b, range(12))
    assert found.verdict == "calibrated"
    assert force < chi2.isf(UNLIKELY, len(OWN))
    assert rate < chi2.isf(UNLIKELY, 12)


def test_gravity_is_found_at_rests_and_after_turns(found):
    assert found.norm_after < 0.02 * found.norm_before
    assert found.norm_after < found.norm_held_out < 5 * found.norm_after
    assert found.angle_after < 0.2 * found.angle_before


def test_nothing_shows_how_the_accelerometer_sits_in_its_case(found):
    mounting = [each for each in found.accelerometer.parameters if each.name.startswith("mounting")]
    assert len(mounting) == 3
    assert not any(each.observable for each in mounting)
    assert all(math.isnan(each.value) and "own axes" in each.reason for each in mounting)
    assert np.allclose(np.triu(found.accelerometer.M, 1), 0.0)


@pytest.mark.parametrize("scale", [0.82, 1.22])
def test_scales_a_quarter_off_do_no_harm(hand, scale):
    samples = hand.unit.samples
    recording = tumble.Recording.from_arrays(
        "off", samples.time, scale * samples.accelerometer, scale * samples.gyroscope
    )
    found = tumble.multipose(recording)
    assert np.allclose(found.accelerometer.M / scale, hand.force_matrix, atol=2e-3)
    assert np.allclose(found.gyroscope.M / scale, hand.rate_matrix, atol=5e-3)


def test_counts_whose_scale_nobody_states_are_calibrated(hand):
    samples = hand.unit.samples
    counts = 32768.0 + np.round(413.0 * samples.accelerometer), 32700.0 + np.round(4770.0 * samples.gyroscope)
    recording = tumble.Recording.from_arrays("counts", samples.time, *counts)
    found = tumble.multipose(recording, raw=True)
    scale = found.nominal_scale
    assert np.allclose(found.accelerometer.M * scale.accelerometer / 413.0, hand.force_matrix, atol=2e-3)
    assert np.allclose(found.gyroscope.M * scale.gyroscope / 4770.0, hand.rate_matrix, atol=5e-3)
    assert any("--accelerometer-scale" in line for line in found.warnings)
    corrected = found.calibration.correct(counts[0] / scale.accelerometer, counts[1] / scale.gyroscope)[0]
    rest = (samples.time > found.rests[3].start) & (samples.time < found.rests[3].end)
    assert abs(np.linalg.norm(corrected[rest].mean(axis=0)) - found.gravity) < 0.01


def test_unstated_counts_are_refused(hand):
    samples = hand.unit.samples
    recording = tumble.Recording.from_arrays(
        "counts", samples.time, 16384 * samples.accelerometer, samples.gyroscope
    )
    with pytest.raises(tumble.ProcedureError, match="or take readings for counts, with --raw"):
        tumble.multipose(recording)


def test_attitude_dependent_bias_is_detected_and_fitted_on_request():
    hand = session(5, g_sensitivity=True)
    samples = hand.unit.samples
    response = np.array([[2e-4, 0.0, 1e-4], [-3e-4, 1e-4, 0.0], [0.0, -1e-4, 2e-4]])
    felt = samples.accelerometer @ response.T
    recording = tumble.Recording.from_arrays(
        "felt", samples.time, samples.accelerometer, samples.gyroscope + felt
    )
    without = tumble.multipose(recording)
    assert any("--g-sensitivity" in line for line in without.warnings)
    found = tumble.multipose(recording, g_sensitivity=True)
    truth = response + hand.unit.gyroscope.g_sensitivity @ hand.unit.accelerometer.Q.T
    error = np.abs(found.gyroscope.g_sensitivity - truth)
    assert (error < 5 * found.gyroscope.g_sensitivity_sigma + 1e-5).all()
    assert found.angle_after < 0.7 * without.angle_after


def lying():
    """A unit that lies on a table for half a minute."""
    random = np.random.default_rng(2)
    time = np.arange(3000) / 100.0
    force = np.array([0.1, 0.2, 9.8]) + 0.02 * random.normal(size=(3000, 3))
    return tumble.Recording.from_arrays("lying", time, force, 0.002 * random.normal(size=(3000, 3)))


def test_one_orientation_is_refused():
    with pytest.raises(tumble.ProcedureError, match="one orientation only"):
        tumble.multipose(lying())


def test_nine_orientations_for_nine_unknowns_are_refused():
    with pytest.raises(tumble.ProcedureError, match="shows 9 orientations, in 9 rests"):
        tumble.multipose(session(4, orientations=9).recording)


def test_without_turns_the_accelerometer_is_calibrated_alone(hand):
    samples = hand.unit.samples
    recording = tumble.Recording.from_arrays("half", samples.time, samples.accelerometer, None)
    found = tumble.multipose(recording)
    assert found.verdict == "partly calibrated"
    assert found.gyroscope is None
    assert found.gyroscope_reason == "no gyroscope was read"


def test_gaps_in_every_turn_refuse_the_gyroscope_with_the_reason(hand):
    samples = hand.unit.samples
    keep = np.zeros(len(samples), dtype=bool)
    for rest in hand.session.rests:
        keep |= (samples.time >= rest.start) & (samples.time <= rest.end)
    recording = tumble.Recording.from_arrays(
        "rests", samples.time[keep], samples.accelerometer[keep], samples.gyroscope[keep]
    )
    found = tumble.multipose(recording)
    assert found.gyroscope is None
    assert "no turn between two rests was recorded whole" in found.gyroscope_reason


@pytest.fixture(scope="module")
def written(tmp_path_factory, hand):
    folder = tmp_path_factory.mktemp("hand")
    return write_multipose(hand, folder)["log"]


def test_the_command_writes_what_python_writes(written, tmp_path):
    done = typed("multipose", written, "-o", tmp_path / "typed", "--operator", "A")
    assert done.code == 0, done.err
    assert "18 rests in 18 orientations, 17 turns between them" in done.text
    files = contents(tmp_path / "typed")
    assert set(files) == {"multipose.html", "multipose.yaml"}
    tumble.multipose(written, operator="A").save(tmp_path / "python")
    loaded = [Calibration.load(tmp_path / each / "multipose.yaml") for each in ("typed", "python")]
    assert np.array_equal(loaded[0].accelerometer.M, loaded[1].accelerometer.M)
    assert loaded[0].method.procedure == "multipose"
    assert loaded[0].operator == "A"
    assert loaded[0].log.sha256
    text = yaml.safe_load((tmp_path / "typed" / "multipose.yaml").read_text())
    assert text["accelerometer"]["sigma"]["mounting"] == [None] * 3


def in_files(samples, folder, edges, pause=0.0):
    """Writes samples into files that end at the numbers of samples, with s between them."""
    folder.mkdir()
    table = np.column_stack([samples.time, samples.accelerometer, samples.gyroscope])
    for number, rows in enumerate(np.split(table, edges)):
        rows[:, 0] += number * pause
        header = "time_s,ax_m/s^2,ay_m/s^2,az_m/s^2,gx_rad/s,gy_rad/s,gz_rad/s"
        place = folder / f"{number}.csv"
        np.savetxt(place, rows, delimiter=",", header=header, comments="", fmt="%.9f")
    return folder


def between(hand, rest):
    """The number of the sample in the middle of the turn after a rest."""
    before, after = hand.session.rests[rest : rest + 2]
    return int(np.searchsorted(hand.unit.samples.time, (before.end + after.start) / 2))


def test_a_split_log_is_calibrated_as_the_whole_is(hand, tmp_path):
    samples = hand.unit.samples
    whole = tumble.multipose(in_files(samples, tmp_path / "whole", []))
    found = tumble.multipose(in_files(samples, tmp_path / "split", range(700, len(samples), 700)))
    assert (len(found.rests), len(found.turns)) == (18, 17)
    assert np.array_equal(found.accelerometer.M, whole.accelerometer.M)
    assert np.array_equal(found.gyroscope.M, whole.gyroscope.M)


def test_all_rests_of_two_logs_of_a_folder_serve(hand, tmp_path):
    folder = in_files(hand.unit.samples, tmp_path / "two", [between(hand, 7)], pause=90.0)
    found = tumble.multipose(folder)
    assert (len(found.rests), len(found.turns)) == (18, 16)
    assert misfit(found.accelerometer, hand.force_matrix, hand.unit.accelerometer.b, OWN) < 40.0


def test_json_holds_poses_turns_and_the_orientation_to_add(written, tmp_path):
    import json

    done = typed("multipose", written, "-o", tmp_path, "--json")
    content = json.loads(done.out)
    assert content["verdict"] == "calibrated"
    assert len(content["poses"]) == 18
    assert len(content["turns"]) == 17
    assert math.isclose(np.linalg.norm(content["next_orientation"]["up"]), 1.0)
    assert content["norm"]["held_out"] > content["norm"]["after"]


def test_the_page_shows_sphere_norms_influence_and_turns(found):
    from tumble.procedures.multipose.report.page import MULTIPOSE_REPORT

    html = MULTIPOSE_REPORT.render(found)
    for heading in ("On the sphere", "Influence of each rest", "At the rests", "After the turns", "Model"):
        assert heading in html
    assert "nan" not in html.lower().replace("nanm", "")


@pytest.mark.parametrize(("left", "is_given"), [(0.5, True), (0.95, False), (1.0, False)])
def test_a_tip_that_gains_nothing_is_not_given(found, left, is_given):
    """Neither on screen and page nor in the picture."""
    from tumble.procedures.multipose.report.figures import sphere_figure

    up = np.array([0.0, 0.6, 0.8])
    orientation = NextOrientation(up, "bias x", 1e-3, left * 1e-3)
    turn = NextTurn(np.array([1.0, 0.0, 0.0]), up, "scale x", 1e-3, left * 1e-3)
    tipped = replace(found, next_orientation=orientation, next_turn=turn)
    assert len(list(next_sentences(tipped))) == (2 if is_given else 0)
    untipped = replace(found, next_orientation=None)
    assert (sphere_figure(tipped, "s") != sphere_figure(untipped, "s")) == is_given


def test_a_folder_that_cannot_be_written_loses_nothing(written, tmp_path):
    (tmp_path / "file").write_text("mine")
    done = typed("multipose", written, "-o", tmp_path / "file")
    assert done.code == 2
    one_line(done.err)
    assert (tmp_path / "file").read_text() == "mine"


def test_the_rotation_of_the_earth_needs_a_latitude(written, tmp_path):
    done = typed("multipose", written, "-o", tmp_path, "--earth-rate")
    assert done.code == 2
    assert "--latitude" in one_line(done.err)


def test_lists_and_data_frames_will_do_in_place_of_a_log(hand, found):
    samples = hand.unit.samples
    columns = {"time": samples.time}
    columns |= {f"a{axis}": samples.accelerometer[:, k] for k, axis in enumerate("xyz")}
    columns |= {f"g{axis}": samples.gyroscope[:, k] for k, axis in enumerate("xyz")}
    again = tumble.multipose(pandas.DataFrame(columns))
    assert np.allclose(again.accelerometer.M, found.accelerometer.M)
    assert len(list(found.to_pandas()["parameter"])) == 24
