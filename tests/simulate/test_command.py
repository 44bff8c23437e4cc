"""`tumble simulate turntable` as it is typed."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from tumble.logs import open_recording
from tumble.poses.pose_list import SIX_FACES, PoseList
from tumble.tools.simulate import simulate_turntable
from turntable_sessions import typed

QUICK = ("--rest", "0.5", "--rate", "50")


def simulate(folder, *arguments):
    return typed("simulate", "turntable", "-o", folder, *QUICK, *arguments)


def samples(path):
    chunks = list(open_recording(path).chunks())
    return {
        name: np.concatenate([getattr(chunk, name) for chunk in chunks])
        for name in ("time", "accelerometer", "gyroscope", "temperature")
    }


@pytest.mark.parametrize("log_format", ["csv", "parquet", "mcap"])
def test_the_logs_written_are_read_back_as_they_were_simulated(tmp_path, log_format):
    done = simulate(tmp_path, "--seed", 5, "--format", log_format)
    assert done.code == 0, done.err
    session = simulate_turntable(seed=5, rest_seconds=0.5, rate_hz=50.0)
    for unit in session.units:
        read = samples(tmp_path / f"{unit.name}.{log_format}")
        assert np.array_equal(read["accelerometer"], unit.samples.accelerometer)
        assert np.array_equal(read["gyroscope"], unit.samples.gyroscope)
        assert np.array_equal(read["temperature"], unit.samples.temperature)
        # MCAP counts nanoseconds.
        assert np.abs(read["time"] - unit.samples.time).max() <= (1e-9 if log_format == "mcap" else 0.0)


def test_the_truth_beside_the_logs_is_exact_and_complete(tmp_path):
    assert simulate(tmp_path, "--seed", 6, "--fault", "target_2:moved:size=3:start=0.2").code == 0
    truth = yaml.safe_load((tmp_path / "truth.yaml").read_text())
    session = simulate_turntable(seed=6, rest_seconds=0.5, rate_hz=50.0)
    assert np.array_equal(truth["R_e"], session.R_e)
    assert [rest["pose"] for rest in truth["rests"]] == [pose.name for pose in SIX_FACES]
    assert truth["seed"] == 6
    assert truth["options"]["rest_seconds"] == 0.5
    for unit in session.units:
        written = truth["units"][unit.name]
        for triad, expected in (("accelerometer", unit.accelerometer), ("gyroscope", unit.gyroscope)):
            for name in ("M", "b", "K", "L", "Q", "g_sensitivity"):
                assert np.array_equal(written[triad][name], getattr(expected, name))
            assert written[triad]["mounting_deg"] == pytest.approx(np.degrees(expected.mounting))
    fault = truth["units"]["target_2"]["faults"]
    assert fault == [{"kind": "moved", "triad": "accelerometer", "axis": "y", "start": 0.2, "size": 3.0}]


def test_written_pose_list_is_the_given_one(tmp_path):
    poses = tmp_path / "five.yaml"
    ups = {"a": [1, 0, 0], "b": [0, 1, 0], "c": [0, 0, 1], "d": [-1, -1, -1], "e": [1, -1, 0.5]}
    poses.write_text(
        yaml.safe_dump({"schema": "tumble-poses/1", "poses": [{"name": n, "up": u} for n, u in ups.items()]})
    )
    done = simulate(tmp_path / "out", "--poses", poses, "--visits", "e,a,b,c")
    assert done.code == 0, done.err
    written = PoseList.load(tmp_path / "out" / "poses.yaml")
    assert np.allclose(written.directions(), PoseList.load(poses).directions(), atol=1e-15)
    truth = yaml.safe_load((tmp_path / "out" / "truth.yaml").read_text())
    assert [rest["pose"] for rest in truth["rests"]] == ["e", "a", "b", "c"]


def test_the_text_says_what_comes_next(tmp_path):
    done = simulate(tmp_path, "--fault", "target_1:gap", "--grades", "tactical")
    assert "fault: gap" in done.out
    assert f"Next: tumble turntable {tmp_path}/reference.csv {tmp_path}/target_1.csv" in done.out


def test_next_command_fits_the_response_of_the_units(tmp_path):
    assert " --g-sensitivity -o results" in simulate(tmp_path, "--grades", "consumer").out
    assert "--g-sensitivity" not in simulate(tmp_path, "--grades", "consumer", "--no-g-sensitivity").out
