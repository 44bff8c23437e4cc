"""Six faces: imucal's numbers to 1e-9, Tumble's own beside them, and sections as users label them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import imucal
import numpy as np
import pandas
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

import tumble
from tumble.procedures.multipose.sections import LABELS, Section
from tumble.tools.simulate import simulate_multipose, write_multipose
from turntable_sessions import one_line, typed

IMUCAL = Path(__file__).parents[3] / "shared" / "data" / "imucal"
DEG = 180.0 / np.pi
MADE_WITH_IMUCAL = {
    "accelerometer": {
        "K": [1.0190102693925662, 0.9690440048550889, 1.0489684140253495],
        "R": [
            [0.9999870876676811, 1.8077290589555934e-05, 0.005081748825076716],
            [0.005286378990369493, 0.9999860216950411, 0.00010301308076288443],
            [-8.47105370029448e-06, 0.004861172647816963, 0.9999881843945604],
        ],
        "b": [0.3002847817043328, -0.199890245181515, 0.10012472220546886],
    },
    "gyroscope": {
        "K": [1.01000394437093, 1.01000479786701, 1.0099971207424432],
        "R": [
            [0.9999982146091067, -0.001889645829232435, -4.151981617291133e-06],
            [-1.6772390439242225e-06, 0.9999981967679823, -0.0018990676582220222],
            [-0.001894890427452343, 1.884860725835875e-06, 0.9999982046917462],
        ],
        "b": [0.5741155707018206, -1.1452395494569712, 0.28605165480566846],
    },
}
"""Results of imucal 2.6.0, `FerrarisCalibration().compute`, for `readings()`: m/s^2 and deg/s, g = 9.81."""


def readings():
    """A made-up unit, 100 Hz, 60 samples a section: specific force, angular rate in rad/s, sections."""
    k = np.arange(60)
    force, rate, sections = [], [], []
    for n, label in enumerate(LABELS[:9]):
        axis = "xyz".index(label[0])
        up = np.zeros(3)
        up[axis] = -1.0 if label.endswith("_a") else 1.0
        wave = np.column_stack([np.sin((n + 1) * k + j) for j in range(6)])
        true = up * 9.8 * np.array([1.02, 0.97, 1.05]) + [0.3, -0.2, 0.1] + 0.05 * np.roll(up, 1)
        turn = np.zeros(3)
        if label.endswith("rot"):
            turn[axis] = -2 * np.pi / 0.6 * 1.01
            turn[axis - 1] += 0.02
        force.append(true + 0.02 * wave[:, :3])
        rate.append(turn + [0.01, -0.02, 0.005] + 1e-3 * np.roll(up, 2) + 2e-3 * wave[:, 3:])
        sections.append(Section(label, 60 * n, 60 * n + 60))
    return np.concatenate(force), np.concatenate(rate), sections


def recording(force, rate, hertz):
    return tumble.Recording.from_arrays("faces", np.arange(len(force)) / hertz, force, rate)


def is_near(found, K, R, b, factor=1.0):
    """Asserts that all are within 1e-9; those of a gyroscope in deg/s take a factor."""
    assert np.allclose(np.diag(found.K), np.array(K) * factor, rtol=1e-9, atol=0.0)
    assert np.allclose(found.R, R, rtol=0.0, atol=1e-9)
    assert np.allclose(found.b, np.array(b), rtol=1e-9, atol=1e-12)


def test_the_formulas_give_what_imucal_gives():
    force, rate, sections = readings()
    faces = tumble.multipose(recording(force, rate, 100.0), gravity=9.81, sections=sections).faces
    is_near(faces.accelerometer, **MADE_WITH_IMUCAL["accelerometer"])
    expected = MADE_WITH_IMUCAL["gyroscope"]
    is_near(faces.gyroscope, expected["K"], expected["R"], np.array(expected["b"]) / DEG)


def test_imucal_itself_agrees():
    force, rate, sections = readings()
    columns = [f"{sensor}_{axis}" for sensor in ("acc", "gyr") for axis in "xyz"]
    data = pandas.DataFrame(np.column_stack([force, DEG * rate]), columns=columns)
    spans = pandas.DataFrame([(s.start, s.end) for s in sections], columns=["start", "end"])
    spans.index = [each.label for each in sections]
    regions = imucal.ferraris_regions_from_section_list(data, spans)
    theirs = imucal.FerrarisCalibration().compute(
        regions, 100.0, from_acc_unit="m/s^2", from_gyr_unit="deg/s"
    )
    faces = tumble.multipose(recording(force, rate, 100.0), gravity=9.81, sections=sections).faces
    is_near(faces.accelerometer, np.diag(theirs.K_a), theirs.R_a, theirs.b_a)
    is_near(faces.gyroscope, np.diag(theirs.K_g), theirs.R_g, theirs.b_g / DEG)


@pytest.mark.skipif(not IMUCAL.is_dir(), reason="the recordings in ../shared/data are not here")
def test_published_calibration_of_a_session_in_counts_is_reproduced():
    rows = list(csv.DictReader((IMUCAL / "annotated_session.csv").open()))
    rows.sort(key=lambda row: int(row["samples"]))
    force, rate = (
        np.array([[float(row[f"{s}_{a}"]) for a in "xyz"] for row in rows]) for s in ("acc", "gyr")
    )
    labels = [row["part"] for row in rows]
    begins = [k for k in range(len(rows)) if k == 0 or labels[k] != labels[k - 1]]
    sections = [Section(labels[a], a, b) for a, b in zip(begins, [*begins[1:], len(rows)], strict=True)]
    found = tumble.multipose(recording(force, rate, 204.8), gravity=9.81, raw=True, sections=sections)
    published = json.loads((IMUCAL / "example_cal.json").read_text())
    is_near(found.faces.accelerometer, np.diag(published["K_a"]), published["R_a"], published["b_a"])
    is_near(found.faces.gyroscope, np.diag(published["K_g"]), published["R_g"], published["b_g"], DEG)
    assert np.allclose(found.faces.K_ga, published["K_ga"], rtol=1e-9, atol=1e-12)
    assert found.verdict == "calibrated"
    assert np.abs(found.faces.accelerometer.differences).max() < 3.0


@pytest.mark.skipif(not IMUCAL.is_dir(), reason="the recordings in ../shared/data are not here")
def test_session_with_external_sections_is_calibrated_as_typed(tmp_path):
    options = (
        "--rate",
        102.4,
        "--accelerometer-unit",
        "m/s^2",
        "--gyroscope-unit",
        "deg/s",
        "--gravity",
        9.81,
    )
    log, sections = IMUCAL / "example_ferraris_session.csv", IMUCAL / "example_ferraris_session_list.json"
    done = typed("multipose", log, *options, "--sections", sections, "-o", tmp_path, "--json")
    assert done.code == 0, done.err
    content = json.loads(done.out)
    assert content["faces"]["tilt"] < 0.01
    assert np.abs(content["faces"]["gyroscope"]["differences"]).max() < 3.0


@pytest.fixture(scope="module")
def hand():
    return simulate_multipose(seed=3, faces=True, g_sensitivity=False, latitude_deg=None)


def misfit(triad, matrix, bias):
    error = np.concatenate([(triad.M - matrix).ravel(), triad.b - bias])
    return float(error @ np.linalg.solve(triad.covariance, error))


@pytest.mark.parametrize("labelled", [False, True])
def test_both_sensors_are_within_their_covariance_in_the_box_frame(hand, labelled):
    sections = [Section(*each) for each in hand.sections] if labelled else None
    found = tumble.multipose(hand.recording, faces=True, sections=sections)
    unit = hand.unit
    # The covariance leans on a tilt that few residuals show.
    assert misfit(found.accelerometer, hand.force_matrix, unit.accelerometer.b) < 3 * chi2.isf(1e-4, 12)
    assert misfit(found.gyroscope, hand.rate_matrix, unit.gyroscope.b) < 3 * chi2.isf(1e-4, 12)
    assert 0.1 < np.degrees(found.faces.tilt) < 0.7
    assert all(each.observable for each in found.accelerometer.parameters)


def test_unstated_six_faces_are_refused_with_the_option_for_them(hand):
    with pytest.raises(tumble.ProcedureError, match=r"shows 6 orientations.*--faces"):
        tumble.multipose(hand.recording)


def test_a_face_that_is_missing_is_named(hand):
    sections = [Section(*each) for each in hand.sections if each[0] != "y_a"]
    with pytest.raises(tumble.ProcedureError, match="no rest on y_a"):
        tumble.multipose(hand.recording, sections=sections)


def test_without_full_turns_gyroscope_formulas_give_no_result(hand):
    sections = [Section(*each) for each in hand.sections if "rot" not in each[0]]
    found = tumble.multipose(hand.recording, sections=sections)
    assert found.faces.gyroscope is None
    assert any("no full turn" in line for line in found.warnings) or found.gyroscope_reason


def test_folder_with_a_file_a_face_equals_the_whole_log(hand, tmp_path):
    samples = hand.unit.samples
    folder = tmp_path / "faces"
    folder.mkdir()
    once = {label: span for label, *span in reversed(hand.sections)}
    for label, (start, end) in once.items():
        part = np.column_stack([samples.time, samples.accelerometer, samples.gyroscope])[start:end]
        header = "time,ax,ay,az,gx,gy,gz"
        np.savetxt(folder / f"{label}.csv", part, delimiter=",", header=header, comments="", fmt="%.9f")
    units = ("--accelerometer-unit", "m/s^2", "--gyroscope-unit", "rad/s")
    done = typed("multipose", folder, *units, "-o", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    content = json.loads(done.out)
    assert [label for label, _, _ in content["faces"]["sections"]].count("x_rot") == 1
    values = {each["parameter"]: each for each in content["parameters"] if each["sensor"] == "accelerometer"}
    assert abs(values["bias x"]["value"] - hand.unit.accelerometer.b[0]) < 5 * values["bias x"]["sigma"]


def test_rests_that_are_labelled_are_the_rests(tmp_path):
    hand = simulate_multipose(seed=8, g_sensitivity=False, latitude_deg=None)
    spans = [np.searchsorted(hand.unit.samples.time, (rest.start, rest.end)) for rest in hand.session.rests]
    sections = [Section("rest", int(a) + 20, int(b) - 20) for a, b in spans[:12]]
    found = tumble.multipose(hand.recording, sections=sections)
    assert [rest.samples for rest in found.rests] == [each.end - each.start for each in sections]
    assert len(found.turns) == 11
    assert np.allclose(found.accelerometer.M, hand.force_matrix, atol=3e-3)


def test_the_simulated_session_is_calibrated_by_the_command_it_names(tmp_path):
    done = typed("simulate", "multipose", "--faces", "--seed", 3, "-o", tmp_path / "box")
    assert done.code == 0, done.err
    assert "--sections" in done.out
    log, sections = tmp_path / "box" / "multipose.csv", tmp_path / "box" / "sections.csv"
    done = typed("multipose", log, "--sections", sections, "--g-sensitivity", "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert "by the formulas of Ferraris" in done.text
    assert "Beside the formulas of Ferraris" in (tmp_path / "out" / "multipose.html").read_text()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x,y\n", "expected the columns label,start,end"),
        ("label,start,end\n", "holds no sections"),
        ("label,start,end\nup,0,100\n", "'up' is no label"),
        ("label,start,end\nx_p,0,ten\n", "no numbers of samples"),
        ("label,start,end\nx_p,0,5\n", "10 samples or more"),
        ("label,start,end\nx_p,0,100\nx_a,50,200\n", "overlap at sample 50"),
        ("label,start,end\nx_p,0,100\nrest,200,300\n", "label all or none"),
        ("label,start,end\nx_p,0,9999999\n", "ends at sample 9999999"),
    ],
)
def test_a_list_of_sections_that_means_nothing_is_refused_in_one_line(hand, tmp_path, text, said):
    log = write_multipose(hand, tmp_path / "box")["log"]
    (tmp_path / "sections.csv").write_text(text)
    done = typed("multipose", log, "--sections", tmp_path / "sections.csv", "-o", tmp_path / "out")
    assert done.code == 2
    assert said in one_line(done.err)


def level_faces(hertz=100.0):
    """Specific force and rate, (n, 3), of a box on a level table: six faces, then three full turns."""
    ups = [s * np.eye(3)[k] for k in range(3) for s in (1.0, -1.0)] + [
        each for each in np.eye(3) for _ in range(2)
    ]
    up, force, rate = ups[0], [], []

    def go(axis, angle, duration):
        nonlocal up
        u = np.arange(round(duration * hertz)) / (duration * hertz)
        turned = np.outer(angle * (10 * u**3 - 15 * u**4 + 6 * u**5), axis)
        force.append(9.80665 * Rotation.from_rotvec(-turned).apply(up))
        rate.append(np.outer(angle * 30 * (u * (1 - u)) ** 2 / duration, axis))
        up = Rotation.from_rotvec(-angle * np.asarray(axis)).apply(up)

    for number, face in enumerate(ups):
        across = np.cross(face, up)
        if np.linalg.norm(across) > 0.5:
            go(across, np.pi / 2, 2.0)
        elif face @ up < 0.0:
            go(np.roll(np.abs(face), 1), np.pi, 2.0)
        elif number > 5:
            go(face, 2 * np.pi, 6.0)
        go(face, 0.0, 5.0)
    return np.concatenate(force), np.concatenate(rate)


def test_turns_on_faces_hold_a_g_sensitivity_nobody_asked_for():
    """It is constant in a full turn, so that as noise it moved angles by five sigmas and more."""
    force, rate = level_faces()
    squares = []
    for seed in range(40, 52):
        random = np.random.default_rng(seed)
        matrix = np.eye(3) + 0.01 * random.normal(size=(3, 3))
        felt = rate @ matrix.T + 0.01 + force @ (1e-4 * random.normal(size=(3, 3))).T
        felt += 1e-3 * random.normal(size=felt.shape)
        read = recording(force + 0.015 * random.normal(size=force.shape), felt, 100.0)
        found = tumble.multipose(read, faces=True).gyroscope
        lengths = np.linalg.norm(matrix, axis=1)
        off = (found.M - matrix) / lengths[:, None]
        level = ~np.eye(3, dtype=bool)
        squares.append(off[level] ** 2 / np.diag(found.covariance)[:9].reshape(3, 3)[level])
    print(np.round(squares, 1))
    assert np.max(squares) < 4.5**2
    assert np.mean(squares) < 1.6
