"""Poses too few, missing, doubled, tipped or misnamed; units swapped, moved or from different sessions."""

from __future__ import annotations

import re

import numpy as np
import pytest
import yaml

import tumble
from tumble.foundation.errors import ProcedureError
from tumble.poses.pose_list import SIX_FACES, PoseList
from tumble.tools.simulate import Fault
from turntable_sessions import (
    NAMES,
    Pair,
    calibrate,
    calibrated,
    contents,
    refusal,
    rows,
    simulate,
    write,
    write_poses,
)

FACES = [pose.name for pose in SIX_FACES]


@pytest.fixture(scope="module")
def session():
    return simulate(121, grades=("industrial",))


@pytest.fixture(scope="module")
def pair(session, tmp_path_factory):
    return Pair.make(session, tmp_path_factory.mktemp("pair"))


@pytest.fixture
def listed(tmp_path):
    """The six faces as a file of the user."""
    SIX_FACES.save(tmp_path / "poses.yaml")
    return tmp_path / "poses.yaml"


@pytest.mark.parametrize(
    ("visits", "shown"), [(FACES[:1], "1 rest"), (FACES[:3], "3 rests")], ids=["one pose", "three poses"]
)
def test_fewer_poses_than_unknowns_need_are_refused_with_their_number(tmp_path, visits, shown):
    logs = write(simulate(122, grades=("industrial",), visits=visits), tmp_path)
    line = refusal(*logs, "-o", tmp_path / "out")
    assert line.startswith(f"reference: shows {shown}, needs at least 4 in different directions")
    assert "hold each pose still for 5 s or longer" in line


def test_a_target_that_shows_fewer_poses_is_refused_by_itself(session, pair, tmp_path):
    command = pair.corrupt(tmp_path, "target_1", lambda table: table[table[:, 0] < session.rests[2].end])
    assert refusal(*command).startswith("corrupt: shows 3 rests, needs at least 4")
    command.insert(1, pair.folder / "target_1.csv")
    calibrated(*command, code=3)
    assert rows(tmp_path / "out")["corrupt"]["verdict"] == "not calibrated"


def test_rests_in_four_directions_of_one_plane_are_refused(tmp_path):
    visits = ["X up", "Y up", "X down", "Y down"]
    level = {"table_error_deg": 0.0, "mounting_angle_deg": 0.0}
    logs = write(simulate(123, grades=("industrial",), visits=visits, **level), tmp_path)
    line = refusal(*logs, "-o", tmp_path / "out", "--poses", "none")
    assert "the rests point in too few directions to separate scale from bias" in line
    assert "add poses that show each axis up and down" in line


def test_a_pose_of_the_list_that_was_not_recorded_is_named(tmp_path, listed):
    logs = write(simulate(124, grades=("industrial",), visits=FACES[:5]), tmp_path)
    for options in ((), ("--poses", listed)):
        line = refusal(*logs, "-o", tmp_path / "out", *options)
        assert line.startswith("reference: pose 'Z down' is missing, 5 of 6 were found in 5 rests")
        assert "--poses none" in line
    calibrated(*logs, "-o", tmp_path / "out", "--poses", "none")


@pytest.mark.parametrize("angle", [12.0, 20.0])
def test_a_tipped_pose_is_named_with_its_angle(tmp_path, angle):
    session = simulate(125, grades=("industrial",), tipped_deg={"Y up": angle}, mounting_angle_deg=0.0)
    line = refusal(*write(session, tmp_path), "-o", tmp_path / "out")
    assert line.startswith("reference: rest 3 is tipped ")
    found = float(line.split("tipped ")[1].split(" deg")[0])
    assert found == pytest.approx(angle, abs=0.3)
    assert "pose 'Y up'" in line
    assert "--poses none" in line


def test_pose_tipped_within_the_limit_is_the_table_error_of_that_pose(tmp_path):
    session = simulate(126, grades=("industrial",), tipped_deg={"Y up": 5.0})
    result = calibrate(session)
    worst = max(result.poses, key=lambda pose: pose.table_error_angle)
    assert worst.name == "Y up"
    assert worst.table_error_angle > 2.5


LISTS = {
    "three poses": (lambda poses: poses[:3], "holds 3 poses, needs at least 4"),
    "a direction twice": (
        lambda poses: [*poses, {"name": "again", "up": [0.0, 0.0, 2.0]}],
        "poses 'Z up' and 'again' point up within 0 deg of each other",
    ),
    "a name twice": (
        lambda poses: [*poses, {"name": "X up", "up": [1.0, 1.0, 0.0]}],
        "two poses are named 'X up'",
    ),
    "no direction": (
        lambda poses: [*poses, {"name": "nowhere", "up": [0.0, 0.0, 0.0]}],
        "up is zero, which is no direction",
    ),
}


@pytest.mark.parametrize(("change", "said"), LISTS.values(), ids=LISTS.keys())
def test_a_pose_list_that_makes_no_sense_is_refused_with_its_file(pair, tmp_path, change, said):
    poses = [{"name": pose.name, "up": pose.up.tolist()} for pose in SIX_FACES]
    (tmp_path / "poses.yaml").write_text(yaml.safe_dump({"schema": "tumble-poses/1", "poses": change(poses)}))
    command = pair.with_log("target_1", pair.folder / "target_1.csv")
    line = refusal(*command[:2], "-o", tmp_path / "out", "--poses", tmp_path / "poses.yaml")
    assert line.startswith(f"{tmp_path / 'poses.yaml'}:")
    assert said in line


def test_a_list_of_other_poses_than_were_driven_to_is_refused(pair, tmp_path):
    tilted = PoseList(
        tuple(
            tumble.Pose(f"corner {number}", np.array(up))
            for number, up in enumerate([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], start=1)
        )
    )
    tilted.save(tmp_path / "poses.yaml")
    command = pair.with_log("target_1", pair.folder / "target_1.csv")
    line = refusal(*command[:2], "-o", tmp_path / "out", "--poses", tmp_path / "poses.yaml")
    assert "pose 'corner 1' is missing, 0 of 4 were found in 6 rests" in line


def test_a_truth_that_needs_poses_says_so_where_the_rests_show_none(tmp_path):
    visits = ["X up", "Y up", "Z up", "X down"]
    session = simulate(127, grades=("industrial",), visits=visits, mounting_angle_deg=15.0)
    line = refusal(*write(session, tmp_path), "-o", tmp_path / "out", "--truth", "rotate-truth")
    assert "truth 'rotate-truth' needs poses" in line
    assert "the rests do not show the six faces" in line


@pytest.fixture
def folders(session, tmp_path):
    for unit in ("reference", "target_1"):
        write_poses(session, unit, tmp_path / unit)
    return tmp_path


def refused_folders(folders, *options):
    return refusal(folders / "reference", folders / "target_1", "-o", folders / "out", *options)


def test_two_files_for_one_pose_are_refused_by_name(session, folders):
    write_poses(session, "reference", folders / "more", names=NAMES[:1], log_format="parquet")
    (folders / "more/x_up.parquet").rename(folders / "reference/X_up.parquet")
    line = refused_folders(folders)
    assert line.startswith("reference: 2 files are named 'x_up'")
    assert "keep one" in line


def test_two_files_for_one_pose_of_a_target_cost_that_target_only(session, folders):
    write_poses(session, "target_1", folders / "good")
    (folders / "target_1/X_UP.csv").write_bytes((folders / "target_1/x_up.csv").read_bytes())
    done = calibrated(
        folders / "reference", folders / "target_1", folders / "good", "-o", folders / "out", code=3
    )
    assert "target_1: not calibrated: 2 files are named 'x_up'" in done.text
    assert rows(folders / "out")["good"]["verdict"] == "calibrated"


def test_a_file_that_is_missing_for_a_pose_of_the_reference_is_named(folders):
    (folders / "reference/y_down.csv").unlink()
    line = refused_folders(folders)
    assert line.startswith("reference: no file for pose 'Y down' (looked for y_down.*)")
    calibrated(folders / "reference", folders / "target_1", "-o", folders / "out", "--poses", "none")


def test_files_of_the_reference_with_names_exchanged_are_refused(folders):
    first, second = folders / "reference/x_up.csv", folders / "reference/y_up.csv"
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    line = refused_folders(folders)
    shown = ("file 'x_up' shows pose 'Y up', not 'X up'", "file 'y_up' shows pose 'X up', not 'Y up'")
    assert any(words in line for words in shown)
    assert "rename the file" in line


def test_swapped_up_and_down_of_the_reference_are_found_by_pose(folders):
    first, second = folders / "reference/x_up.csv", folders / "reference/x_down.csv"
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    line = refused_folders(folders)
    shown = ("file 'x_up' shows pose 'X down', not 'X up'", "file 'x_down' shows pose 'X up', not 'X down'")
    assert any(words in line for words in shown)
    assert "rename the file" in line
    assert "sign" not in line


def test_reference_reading_minus_g_in_every_file_has_a_wrong_sign(folders):
    for path in (folders / "reference").iterdir():
        units, names, *lines = path.read_text().splitlines()
        rows = [line.split(",") for line in lines]
        turned = [[time, *(str(-float(force)) for force in rest[:3]), *rest[3:]] for time, *rest in rows]
        path.write_text("\n".join([units, names, *map(",".join, turned)]) + "\n")
    line = refused_folders(folders)
    assert "reads -g where its poses have +g, in every file" in line
    assert "--accelerometer-sign -1" in line


@pytest.mark.parametrize("other", ["y_up", "z_down"])
def test_files_of_a_target_with_names_exchanged_are_refused(folders, other):
    first, second = folders / "target_1/x_up.csv", folders / f"target_1/{other}.csv"
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    line = refused_folders(folders)
    assert line.startswith("target_1: ")
    assert "the files of two poses, are exchanged" in line


def test_folders_without_a_name_in_common_are_refused(folders):
    for number, path in enumerate(sorted((folders / "target_1").iterdir())):
        path.rename(path.with_name(f"take_{number}.csv"))
    assert "has no file of the same name as one of the reference's" in refused_folders(folders)


def test_a_folder_beside_one_recording_is_refused(pair, folders):
    line = refusal(pair.folder / "reference.csv", folders / "target_1", "-o", folders / "out")
    assert "was recorded in one file per pose where the reference was not" in line


def test_a_bad_file_of_a_folder_is_named(folders):
    (folders / "target_1/y_up.csv").write_text("")
    assert str(folders / "target_1/y_up.csv") in refused_folders(folders)


def test_an_empty_folder_says_what_was_expected(pair, tmp_path):
    (tmp_path / "target_1").mkdir()
    line = refusal(pair.folder / "reference.csv", tmp_path / "target_1", "-o", tmp_path / "out")
    assert "a folder without logs; expected one file per pose" in line


def test_reference_and_target_in_the_wrong_order_are_noticed(pair, tmp_path):
    line = refusal(pair.folder / "target_1.csv", pair.folder / "reference.csv", "-o", tmp_path / "out")
    assert "reference and target are swapped; name the better unit first" in line
    assert line.startswith("reference is quieter than the reference target_1")


def test_reference_among_the_targets_is_found_however_it_is_spelt(pair, tmp_path):
    (tmp_path / "link").symlink_to(pair.folder)
    done = calibrated(
        *(pair.folder / "reference.csv", pair.folder / "target_1.csv", tmp_path / "link/reference.csv"),
        *("-o", tmp_path / "out"),
    )
    assert "link/reference.csv is the reference, and left out of the targets" in done.err


def test_no_target_at_all_is_refused_in_python():
    session = simulate(128, grades=("industrial",))
    with pytest.raises(ProcedureError, match="no target was given"):
        tumble.turntable(session.reference, [])


@pytest.mark.parametrize("size", [0.5, 2.0, 30.0])
def test_target_that_moved_during_a_rest_is_named_with_time_and_pose(size):
    fault = Fault("moved", axis="y", start=9.5, size=size)
    session = simulate(129, grades=("industrial", "tactical"), faults={"target_1": fault})
    result = calibrate(session)
    moved, good = result.targets
    assert good.failure == ""
    assert moved.failure.startswith("target_1: turned by ")
    found = float(moved.failure.split("turned by ")[1].split(" deg")[0])
    assert found == pytest.approx(size, rel=0.1)
    assert " at 9.5 s, during rest 2 (X down), while the reference stood still" in moved.failure
    assert "fasten it and record again" in moved.failure


def test_reference_moving_beside_a_resting_target_is_reported(tmp_path):
    fault = Fault("moved", axis="y", start=9.5, size=2.0)
    session = simulate(130, grades=("industrial",), faults={"reference": fault})
    line = refusal(*write(session, tmp_path), "-o", tmp_path / "out")
    assert line.startswith("target_1: stood still while the reference turned by 2.0")
    assert "at 9.5 s" in line


def test_a_target_that_slipped_far_during_a_turn_is_refused():
    fault = Fault("moved", axis="x", start=19.0, size=10.0)
    session = simulate(131, grades=("industrial",), faults={"target_1": fault})
    with pytest.raises(ProcedureError, match="it did not turn as the reference did; fasten it"):
        calibrate(session)


def test_small_slip_in_a_turn_shows_in_a_warning_and_the_sigmas():
    fault = Fault("moved", axis="x", start=19.0, size=0.5)
    session = simulate(131, grades=("industrial",), faults={"target_1": fault})
    found, good = calibrate(session)["target_1"], calibrate(simulate(131, grades=("industrial",)))["target_1"]
    (warning,) = [text for text in found.warnings if text.startswith("accelerometer residuals")]
    assert "the fixture flexes or slipped" in warning
    sigmas = [np.sqrt(np.diag(each.accelerometer.covariance)).mean() for each in (found, good)]
    assert sigmas[0] > 10.0 * sigmas[1]


def test_slip_that_six_poses_confuse_with_skewed_axes_is_queried():
    """About the vertical of Y up, after X up and X down, before Z up and Z down."""
    fault = Fault("moved", axis="y", start=13.0, size=10.0)
    session = simulate(131, grades=("industrial", "consumer"), faults={"target_1": fault})
    slipped, good = calibrate(session).targets
    asked = [text for text in slipped.warnings if "did the unit slip in its fixture" in text]
    assert any(text.startswith("accelerometer non-orthogonality zx is ") for text in asked)
    assert not [text for text in good.warnings if "slip" in text]


def test_recordings_of_different_sessions_share_no_time(tmp_path):
    one = simulate(132, grades=("industrial",), visits=FACES)
    other = simulate(133, grades=("industrial",), visits=[FACES[k] for k in (4, 0, 2, 5, 1, 3)])
    (tmp_path / "one").mkdir()
    (tmp_path / "other").mkdir()
    reference, _ = write(one, tmp_path / "one")
    _, target = write(other, tmp_path / "other")
    line = refusal(reference, target, "-o", tmp_path / "out")
    assert re.match(r"target_1: only [1-3] of its 6 rests meet one of the reference", line)
    assert "check that both were recorded together" in line


def test_log_of_another_time_with_a_shared_clock_is_refused(pair, tmp_path):
    def later(table):
        table[:, 0] += 1000.0

    command = pair.corrupt(tmp_path, "target_1", later)
    line = refusal(*command, "--clock", "shared")
    assert (
        "its turns lie 1000.000 s from those of the reference although the clock is stated to be shared"
        in line
    )
    assert "--clock apart" in line
    calibrated(*command)


def test_target_that_rests_at_other_times_has_nothing_in_common(session, tmp_path):
    """Rests without turns cannot be laid beside the reference by themselves."""
    late = tumble.Recording.from_arrays(
        "late", session["target_1"].samples.time + 500.0, *split_of(session["target_1"].samples)
    )
    with pytest.raises(ProcedureError, match=r"shares no turn or rest with the reference|1 rest|vibration"):
        tumble.turntable(without_turns(session.reference), [without_turns(late)], clock="shared")


def split_of(samples):
    return samples.accelerometer, samples.gyroscope


def without_turns(recording):
    """Only samples at rest, on the recording's own clock, with gaps between."""
    (chunk,) = recording.chunks()
    quiet = np.linalg.norm(chunk.gyroscope, axis=1) < 0.05
    return tumble.Recording.from_arrays(
        recording.name, chunk.time[quiet], chunk.accelerometer[quiet], chunk.gyroscope[quiet]
    )


def test_a_refusal_for_its_poses_leaves_earlier_results_alone(pair, tmp_path):
    command = pair.with_log("target_1", pair.folder / "target_1.csv")
    calibrated(*command[:2], "-o", tmp_path / "out")
    before = contents(tmp_path / "out")
    reference = pair.corrupt(tmp_path, "reference", lambda table: table[table[:, 0] < 15.0])
    refusal(*reference)
    assert contents(tmp_path / "out") == before
