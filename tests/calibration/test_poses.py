"""Pose lists as a user writes and breaks them."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from tumble.foundation.errors import CalibrationFileError
from tumble.poses.pose_list import SIX_FACES, Pose, PoseList

SCHEMA = json.loads((Path(__file__).parents[2] / "docs/schema/poses.schema.json").read_text())
FOUR = """\
schema: tumble-poses/1
poses:
- {name: up, up: [0, 0, 1]}
- {name: down, up: [0, 0, -2]}
- {name: nose, up: [1, 0, 0]}
- {name: wing, up: [0, 3, 4]}
"""


def refusal(tmp_path, text):
    path = tmp_path / "poses.yaml"
    path.write_text(text)
    with pytest.raises(CalibrationFileError) as caught:
        PoseList.load(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    return message


def test_six_faces_are_the_axes_up_and_down():
    assert [pose.name for pose in SIX_FACES] == ["X up", "X down", "Y up", "Y down", "Z up", "Z down"]
    np.testing.assert_array_equal(SIX_FACES.directions()[::2], np.eye(3))
    np.testing.assert_array_equal(SIX_FACES.directions()[1::2], -np.eye(3))


def test_directions_of_any_length_become_unit_vectors(tmp_path):
    path = tmp_path / "poses.yaml"
    path.write_text(FOUR)
    poses = PoseList.load(path)
    assert len(poses) == 4
    np.testing.assert_allclose(poses[3].up, [0.0, 0.6, 0.8])
    np.testing.assert_allclose(np.linalg.norm(poses.directions(), axis=1), 1.0)


def test_a_saved_list_reads_back_and_obeys_the_published_schema(tmp_path):
    path = tmp_path / "poses.yaml"
    SIX_FACES.save(path)
    jsonschema.validate(yaml.safe_load(path.read_text()), SCHEMA)
    again = PoseList.load(path)
    assert [pose.name for pose in again] == [pose.name for pose in SIX_FACES]
    np.testing.assert_array_equal(again.directions(), SIX_FACES.directions())


def test_one_file_a_pose_may_be_named(tmp_path):
    poses = PoseList(tuple(Pose(pose.name, pose.up, f"{pose.name}.csv") for pose in SIX_FACES))
    poses.save(tmp_path / "poses.yaml")
    assert PoseList.load(tmp_path / "poses.yaml")[2].file == "Y up.csv"


def test_three_poses_are_too_few(tmp_path):
    message = refusal(tmp_path, FOUR.replace("- {name: wing, up: [0, 3, 4]}\n", ""))
    assert "holds 3 poses, needs at least 4" in message


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ("name: nose, up: [1, 0, 0]", "name: nose, up: [0, 0.001, 1]", ["'up' and 'nose'", "0.057 deg"]),
        ("name: nose", "name: down", ["two poses are named 'down'"]),
        ("up: [1, 0, 0]", "up: [0, 0, 0]", ["line 5", "poses.2", "'nose'", "up is zero"]),
        ("up: [1, 0, 0]", "up: [1, 0]", ["line 5", "poses.2.up", "needs 3 numbers"]),
        ("up: [1, 0, 0]", "up: [1, 0, .nan]", ["poses.2.up", "needs 3 numbers, found nan"]),
        ("up: [1, 0, 0]", "up: [1, 0, 0], file: nose.csv", ["'up' names no file while others do"]),
        ("up: [1, 0, 0]", "up: [1, 0, 0], file: ../nose.csv", ["within the folder"]),
        ("name: nose, ", "", ["poses.2.name is missing"]),
        ("name: nose", "name: ' '", ["a pose needs a name"]),
        ("up: [1, 0, 0]", "upp: [1, 0, 0]", ["poses.2.upp is not a known key, did you mean 'up'?"]),
        ("poses:\n", "poses: 3\nother:\n", ["not a known key"]),
    ],
)
def test_a_mistake_is_named(tmp_path, old, new, parts):
    assert old in FOUR
    message = refusal(tmp_path, FOUR.replace(old, new, 1))
    for part in parts:
        assert part in message


@given(angle=st.floats(1.1, 90.0))
def test_poses_further_apart_than_the_tolerance_are_two_poses(angle):
    tipped = [0.0, np.sin(np.radians(angle)), np.cos(np.radians(angle))]
    faces = [SIX_FACES[0], SIX_FACES[1], SIX_FACES[4], SIX_FACES[5]]
    assert len(PoseList((*faces, Pose("tipped", np.array(tipped))))) == 5


@given(angle=st.floats(0.0, 0.99))
def test_poses_closer_than_the_tolerance_are_one(angle):
    tipped = [0.0, np.sin(np.radians(angle)), np.cos(np.radians(angle))]
    with pytest.raises(CalibrationFileError, match="'Z up' and 'tipped'"):
        PoseList((*SIX_FACES, Pose("tipped", np.array(tipped))))
