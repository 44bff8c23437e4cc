"""Poses known and unknown, in any order and direction, in one recording or in one file each."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from tumble.poses.pose_list import SIX_FACES, Pose, PoseList
from turntable_sessions import (
    NAMES,
    assert_recovered,
    calibrate,
    chi_square,
    errors,
    simulate,
    write_poses,
)

DIRECTIONS = PoseList(
    tuple(
        Pose(f"pose {number}", up)
        for number, up in enumerate(np.random.default_rng(8).normal(size=(12, 3)), start=1)
    )
)


def test_targets_are_calibrated_without_known_poses_or_mounting():
    session = simulate(41, grades=("consumer", "industrial", "tactical"))
    known, unknown = calibrate(session), calibrate(session, poses=None)
    assert_recovered(session, unknown)
    assert unknown.reference.mounting is None
    assert "no pose list" in unknown.reference.mounting_reason
    assert unknown.poses == ()
    for with_poses, without in zip(known.targets, unknown.targets, strict=True):
        np.testing.assert_array_equal(with_poses.accelerometer.M, without.accelerometer.M)
        assert without.axis_readings == ()
        assert {rest.pose for rest in without.rests} == {""}


def test_rests_in_random_directions_serve_as_well():
    session = simulate(42, grades=("industrial", "tactical"), poses=DIRECTIONS)
    assert_recovered(session, calibrate(session, poses=None))


def test_a_list_of_random_directions_gives_the_mounting_angle_too():
    session = simulate(42, grades=("tactical",), poses=DIRECTIONS)
    result = calibrate(session, poses=DIRECTIONS)
    mounting = result.reference.mounting
    off = (mounting.rotation_vector - np.degrees(session.mounting)) / mounting.sigma
    assert np.abs(off).max() < 5.0
    assert len(result.poses) == len(DIRECTIONS)


def test_random_directions_are_not_mistaken_for_the_six_faces():
    session = simulate(42, grades=("tactical",), poses=DIRECTIONS)
    result = calibrate(session)
    assert result.reference.mounting is None
    assert "do not show the six faces" in result.reference.mounting_reason
    assert_recovered(session, result)


def test_poses_may_come_in_any_order_and_again_and_all_are_used():
    order = ["Z down", "X up", "Y up", "Z down", "X down", "Y down", "Z up", "X up"]
    session = simulate(43, grades=("industrial",), visits=order)
    result = calibrate(session)
    assert_recovered(session, result)
    assert [rest.pose for rest in result["target_1"].rests] == order
    assert {pose.name: pose.rests for pose in result.poses}["Z down"] == (0, 3)
    assert any("X up (2 times), Z down (2 times)" in warning for warning in result.warnings)


def test_unlisted_pose_serves_targets_but_not_the_mounting_angle():
    extra = PoseList((*SIX_FACES, Pose("askew", np.array([1.0, 1.0, 1.0]))))
    session = simulate(44, grades=("tactical",), poses=extra)
    listed, unlisted = calibrate(session, poses=extra), calibrate(session)
    assert any("rest 7 of the reference matches no pose" in warning for warning in unlisted.warnings)
    assert len(unlisted.poses) == 6
    np.testing.assert_array_equal(listed["target_1"].accelerometer.M, unlisted["target_1"].accelerometer.M)
    assert len(unlisted["target_1"].accelerometer.residuals) == 7


def test_the_error_of_the_table_at_each_pose_is_found():
    session = simulate(45, grades=("tactical",), table_error_deg=0.0, tipped_deg={"Y up": 0.5})
    result = calibrate(session)
    worst = max(result.poses, key=lambda pose: pose.table_error_angle)
    assert worst.name == "Y up"
    # The mounting angle, a fit to all six, gives way to the one that is off.
    assert 0.25 < worst.table_error_angle < 0.5
    assert_recovered(session, result)


def test_implausible_mounting_angle_is_not_estimated_but_targets_are():
    session = simulate(46, grades=("tactical",), mounting_angle_deg=12.0)
    result = calibrate(session)
    assert result.reference.mounting is None
    assert_recovered(session, result)


@pytest.fixture(scope="module")
def session():
    return simulate(47, grades=("industrial",))


@pytest.fixture
def folders(session, tmp_path):
    """One file a pose for the reference and for a target, whose files are of other lengths."""
    write_poses(session, "reference", tmp_path / "reference")
    write_poses(session, "target_1", tmp_path / "target_1", seconds=(3.1, 1.5, 2.0, 3.0, 1.8, 2.4))
    return tmp_path


def run(folders, **options):
    return tumble.turntable(folders / "reference", [folders / "target_1"], **options)


def assert_accelerometer_recovered(session, found):
    assert chi_square(session["target_1"], found, "accelerometer") < 45.0  # 1e-5 of chi-square with 12


def test_one_file_a_pose_is_matched_by_name_for_any_length_and_clock(session, folders):
    result = run(folders)
    found = result["target_1"]
    assert sorted(pose.name for pose in result.poses) == sorted(pose.name for pose in SIX_FACES)
    assert [rest.pose for rest in found.rests] == ["X down", "X up", "Y down", "Y up", "Z down", "Z up"]
    assert found.clock is None
    assert_accelerometer_recovered(session, found)
    assert found.gyroscope.estimated == ("bias",)


def test_a_pose_list_may_name_the_files(session, tmp_path):
    names = [f"take_{number:02d}" for number in range(1, 7)]
    for unit in ("reference", "target_1"):
        write_poses(session, unit, tmp_path / unit, names=names)
    poses = PoseList(
        tuple(Pose(pose.name, pose.up, f"{name}.csv") for pose, name in zip(SIX_FACES, names, strict=True))
    )
    poses.save(tmp_path / "poses.yaml")
    result = run(tmp_path, poses=tmp_path / "poses.yaml")
    assert [rest.pose for rest in result["target_1"].rests] == [pose.name for pose in SIX_FACES]
    assert_accelerometer_recovered(session, result["target_1"])


def test_files_of_unknown_poses_are_paired_by_name(session, tmp_path):
    for unit in ("reference", "target_1"):
        write_poses(session, unit, tmp_path / unit, names=[f"take_{number}" for number in range(6)])
    result = run(tmp_path, poses=None)
    assert result.reference.mounting is None
    assert_accelerometer_recovered(session, result["target_1"])


def test_pose_missing_in_a_target_is_left_out_and_reported(session, folders):
    (folders / "target_1/y_up.csv").unlink()
    found = run(folders)["target_1"]
    assert [rest.pose for rest in found.rests] == ["X down", "X up", "Y down", "Z down", "Z up"]
    assert any("rest 4 of the reference is not a rest of this unit" in warning for warning in found.warnings)
    assert_accelerometer_recovered(session, found)


def test_a_file_of_no_listed_pose_serves_the_targets(session, folders):
    for unit in ("reference", "target_1"):
        names, *rows = (folders / unit / "z_up.csv").read_text().splitlines(keepends=True)
        # A file that is the same to the bit would be a copy.
        (folders / unit / "again.csv").write_text("".join([names, *rows[10:]]))
    result = run(folders)
    assert any("file again matches no pose" in warning for warning in result.warnings)
    assert len(result["target_1"].accelerometer.residuals) == 7
    assert len(result.poses) == 6


def test_a_file_with_a_hiccup_is_one_rest(session, folders):
    path = folders / "target_1/x_up.csv"
    lines = path.read_text().splitlines()
    middle = len(lines) // 2
    path.write_text("\n".join(lines[: middle - 10] + lines[middle + 10 :]) + "\n")
    found = run(folders)["target_1"]
    assert len(found.accelerometer.residuals) == len(NAMES)
    assert_accelerometer_recovered(session, found)


def test_folders_and_one_recording_give_the_same_accelerometer(session, folders):
    continuous = calibrate(session)["target_1"]
    apart = run(folders)["target_1"]
    off = errors(session["target_1"], continuous, "accelerometer") - errors(
        session["target_1"], apart, "accelerometer"
    )
    assert np.abs(off).max() < 1e-3
