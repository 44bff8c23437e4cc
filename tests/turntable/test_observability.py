"""Parameters that a recording does not show have no number: not on screen, not in any file."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import yaml

from tumble import Calibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import Recording
from tumble.poses.pose_list import Pose, PoseList
from turntable_sessions import (
    calibrate,
    calibrated,
    chi_square,
    errors,
    rows,
    simulate,
    write_poses,
)

GYROSCOPE = ("scale", "non-orthogonality", "mounting")

ABOUT_X = PoseList(
    tuple(
        Pose(f"{angle} deg", np.array([0.0, np.sin(np.radians(angle)), np.cos(np.radians(angle))]))
        for angle in (0, 90, 180, 270)
    )
)
"""Poses that a turn about x alone leads through."""


@pytest.fixture(scope="module")
def at_rest(tmp_path_factory):
    """Results for a target of which only rests were recorded, without g-sensitivity: folder and session."""
    folder = tmp_path_factory.mktemp("rests only")
    session = simulate(51, grades=("industrial",))
    for unit in ("reference", "target_1"):
        write_poses(session, unit, folder / unit)
    done = calibrated(folder / "reference", folder / "target_1", "-o", folder / "out")
    return folder / "out", session, done


def test_the_screen_says_not_observable(at_rest):
    _, _, done = at_rest
    (line,) = [line for line in done.out.splitlines() if line.strip().startswith("gyroscope")]
    assert line.count("not observable") == len(GYROSCOPE)


def test_the_summary_leaves_the_cells_empty(at_rest):
    folder, _, _ = at_rest
    row = rows(folder)["target_1"]
    for column, cell in row.items():
        if any(f"gyroscope {group}" in column for group in GYROSCOPE):
            assert cell == "", column
        elif "gyroscope bias" in column:
            assert float(cell) != 0.0


def test_the_calibration_file_holds_null_and_says_why(at_rest):
    folder, _, _ = at_rest
    found = yaml.safe_load((folder / "target_1.yaml").read_text())["gyroscope"]
    assert found["estimated"] == ["bias"]
    assert len(found["unobservable"]) == 3
    assert all("no turn about it was recorded" in reason for reason in found["unobservable"])
    assert found["angles"] == {"non-orthogonality": dict.fromkeys(("xy", "yz", "zx")), "mounting": [None] * 3}
    assert found["sigma"]["scale"] == [None] * 3
    assert not {"K", "L", "Q"} & set(found)
    covariance = np.array(found["covariance"], dtype=float)
    assert np.isnan(covariance[:9]).all()
    assert np.isnan(covariance[:, :9]).all()
    assert (np.diag(covariance)[9:] > 0.0).all()


def test_unobserved_part_of_the_matrix_is_the_mounting(at_rest):
    """So that applying the file turns the rates with the forces, and changes no scale."""
    folder, _, _ = at_rest
    calibration = Calibration.load(folder / "target_1.yaml")
    np.testing.assert_allclose(calibration.gyroscope.M, calibration.accelerometer.Q, atol=1e-6)


def test_the_bias_is_right_all_the_same(at_rest):
    folder, session, _ = at_rest
    found = yaml.safe_load((folder / "target_1.yaml").read_text())["gyroscope"]
    true = session["target_1"].gyroscope
    off = (np.array(found["b"]) - true.b - true.drift) / np.array(found["sigma"]["bias"])
    assert np.abs(off).max() < 4.5


def test_the_page_shows_no_number_for_it(at_rest):
    folder, _, _ = at_rest
    page = (folder / "target_1.html").read_text()
    (parameters,) = re.findall(r'<section id="parameters">.*?</section>', page, flags=re.DOTALL)
    words = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", parameters))
    _, section = words.split("Gyroscope parameter value")
    for name in ("scale x", "non-orthogonality xy", "mounting x"):
        assert f"{name} not observable" in section
    # Numbers there belong to the bias: nothing follows the names of the others but words.
    after = section.split("scale error")[1]
    assert not re.search(r"\d\.\d", after), after


def test_json_has_null_for_it(at_rest, tmp_path):
    folder, _, _ = at_rest
    done = calibrated(folder.parent / "reference", folder.parent / "target_1", "-o", tmp_path, "--json")
    found = json.loads(done.out)["targets"][0]["calibration"]["gyroscope"]
    assert found["angles"]["mounting"] == [None] * 3
    assert found["sigma"]["non-orthogonality"] == {"xy": None, "yz": None, "zx": None}


def test_a_limit_on_it_fails_because_nothing_showed_that_it_is_within(at_rest, tmp_path):
    folder, _, _ = at_rest
    (tmp_path / "limits.yaml").write_text("gyroscope: {bias: 1.0, scale: {x: 0.5}}\n")
    done = calibrated(
        *(folder.parent / "reference", folder.parent / "target_1", "-o", tmp_path),
        *("--limits", tmp_path / "limits.yaml"),
        code=3,
    )
    assert "gyroscope scale x" in done.text
    assert "not shown" in rows(tmp_path)["target_1"]["reason"]
    assert "bias" not in rows(tmp_path)["target_1"]["reason"]


def test_rests_about_one_axis_leave_scale_and_bias_open_and_fail():
    session = simulate(52, grades=("tactical",), poses=ABOUT_X, mounting_angle_deg=0.0, table_error_deg=0.0)
    with pytest.raises(ProcedureError, match="point in too few directions to separate scale from bias"):
        calibrate(session, poses=None)


@pytest.fixture(scope="module")
def about_one_axis():
    """All six faces at rest, but only the turns about x recorded: samples of the others are missing."""
    session = simulate(53, grades=("industrial",), table_error_deg=0.0, mounting_angle_deg=0.0)
    return session, calibrate(without_turns(session, keep=keep_about(session, axis=0)))


def keep_about(session, axis):
    """Turns of the session whose rate is about one axis of the case."""
    rate = session.reference_unit.samples.gyroscope
    time = session.reference_unit.samples.time
    kept = []
    for before, after in zip(session.rests, session.rests[1:], strict=False):
        within = (time > before.end) & (time < after.start)
        share = np.abs(rate[within]).sum(axis=0)
        if share[axis] > 0.97 * share.sum():
            kept.append((before.end, after.start))
    assert kept, "the session has no such turn"
    return kept


def without_turns(session, keep):
    """The session with the middle of every other turn missing, in all logs."""

    def cut(unit):
        time = unit.samples.time
        gone = np.zeros(len(time), dtype=bool)
        for before, after in zip(session.rests, session.rests[1:], strict=False):
            if (before.end, after.start) not in keep:
                gone |= (time > before.end + 0.5) & (time < after.start - 0.5)
        samples = unit.samples
        recording = Recording.from_arrays(
            unit.name, time[~gone], samples.accelerometer[~gone], samples.gyroscope[~gone]
        )
        return replace(unit, recording=recording)

    return replace(
        session,
        reference_unit=cut(session.reference_unit),
        target_units=tuple(cut(unit) for unit in session.target_units),
    )


def test_a_turn_about_one_axis_shows_its_column_and_no_other(about_one_axis):
    session, result = about_one_axis
    found = result["target_1"].gyroscope
    seen = ~np.isnan(np.diag(found.covariance)[:9].reshape(3, 3))
    assert seen.sum(axis=0).tolist() == [3, 0, 0]
    assert found.estimated == ("bias",)
    assert found.rank == 6
    off = errors(session["target_1"], result["target_1"], "gyroscope")
    sigmas = np.sqrt(np.diag(found.covariance))
    known = ~np.isnan(sigmas)
    assert np.abs(off[known] / sigmas[known]).max() < 5.0


def test_no_scale_or_angle_is_given_for_a_turn_about_one_axis(about_one_axis):
    _, result = about_one_axis
    shown = [parameter.name for parameter in result["target_1"].gyroscope.parameters if parameter.observable]
    assert shown == ["bias x", "bias y", "bias z"]
    reasons = result["target_1"].gyroscope.unobservable
    assert [reason for reason in reasons if "case axis x" in reason] == []
    assert sum("no turn about it was recorded" in reason for reason in reasons) == 2


def test_the_accelerometer_does_not_mind_turns_that_were_not_recorded(about_one_axis):
    session, result = about_one_axis
    assert chi_square(session["target_1"], result["target_1"], "accelerometer") < 45.0
