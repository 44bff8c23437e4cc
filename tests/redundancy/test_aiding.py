"""An aiding measurement: its tables are read as they were meant, and it settles what two units cannot."""

from __future__ import annotations

import re

import numpy as np
import pytest
from benchmarks.redundancy_draw import draw
from benchmarks.redundancy_replay import flown
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from redundancy_sets import PRIMARY, QUICK, SOUND, motion, record, replay, units
from tumble.foundation.errors import LogError, TumbleError
from tumble.logs.aiding import Aiding
from turntable_sessions import typed

SEED = 7
FAULT = 55
"""s at which the primary goes wrong, in motion, when its secondary is calibrated."""


def written(folder, text):
    path = folder / "aiding.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("names", "row", "kind", "value"),
    [
        ("vx,vy,vz", "1,2,3", "velocity", [1, 2, 3]),
        ("vn,ve,vd", "1,2,3", "velocity", [2, 1, -3]),
        ("ve,vn,vu", "1,2,3", "velocity", [1, 2, 3]),
        ("body_vx,body_vy,body_vz", "1,2,3", "body velocity", [1, 2, 3]),
        ("score_imu2", "1.5", "score", [1.5, 0, 0]),
    ],
)
def test_columns_are_taken_for_what_their_names_say(tmp_path, names, row, kind, value):
    path = written(tmp_path, f"# a receiver\ntime,{names}\n0.5,{row}\n")
    (aiding,) = Aiding.load(path, sigma=0.2)
    assert aiding.kind == kind
    assert aiding.time.tolist() == [0.5]
    assert aiding.value.tolist() == [value]
    assert (aiding.sigma == 0.2).all() or kind == "score"


@pytest.mark.parametrize(
    ("names", "row", "yaw", "sigma"),
    [
        ("yaw,sigma_yaw", "0.5,0.02", 0.5, 0.02),
        ("heading_deg,sigma_heading_deg", "90,3", -np.pi / 2, np.pi / 60),
    ],
)
def test_headings_are_taken_for_what_their_names_say(tmp_path, names, row, yaw, sigma):
    (aiding,) = Aiding.load(written(tmp_path, f"time,{names}\n0.5,{row}\n1.0,,\n"))
    assert (aiding.kind, aiding.time.tolist()) == ("heading", [0.5])
    assert aiding.value[0, 0] == pytest.approx(yaw, abs=1e-15)
    assert aiding.sigma[0, 0] == pytest.approx(sigma, abs=1e-15)


def test_fields_may_be_separated_as_in_logs(tmp_path):
    path = written(tmp_path, "% exported\ntime;vx;sigma\n0,5;1,25;0,3\n")
    (aiding,) = Aiding.load(path)
    assert (aiding.time.tolist(), aiding.value.tolist()) == ([0.5], [[1.25, 0.0, 0.0]])


def test_unmeasured_value_has_no_weight(tmp_path):
    path = written(tmp_path, "time,vx,vz,sigma_vx,sigma\n0,1,,0.1,0.4\n1,,,0.1,0.4\n2,nan,3,0.1,0.4\n")
    (aiding,) = Aiding.load(path)
    assert aiding.time.tolist() == [0, 2]
    assert aiding.sigma.tolist() == [[0.1, np.inf, np.inf], [np.inf, np.inf, 0.4]]
    assert aiding.value.tolist() == [[1, 0, 0], [0, 0, 3]]


def test_one_table_may_hold_several(tmp_path):
    path = written(tmp_path, "time,climb,body_vx,score_a,score_b\n0,1,2,3,4\n")
    measurements = Aiding.load(path, sigma=0.2)
    assert [(each.kind, each.unit) for each in measurements] == [
        ("velocity", ""),
        ("body velocity", ""),
        ("score", "a"),
        ("score", "b"),
    ]


@pytest.mark.parametrize(
    ("text", "objection"),
    [
        ("", "not a table of an aiding measurement: found no column names such as time, vx"),
        ("vx,vy\n1,2\n", "has no column time"),
        ("time,speed\n1,2\n", "no column is known of speed"),
        ("time,vx\n0,1\n1,fast\n", "line 3 holds 'fast' in column vx, which is not a number; repair"),
        ("time,vx\n0,1\n1,2,3\n", "line 3 has 3 fields where 2 columns are named; repair"),
        ("time,vx\n", "line 1 names columns, but no samples follow"),
        ("time,vd,climb\n0,1,2\n", "vd, climb: two of these are of one axis"),
        ("time,yaw,sigma\n0,1,2\n", "yaw has no sigma; add a column sigma_yaw, in the unit of yaw"),
    ],
)
def test_a_table_that_cannot_be_read_is_refused_in_one_line(tmp_path, text, objection):
    path = written(tmp_path, text)
    with pytest.raises(LogError, match=rf"\A{re.escape(str(path))}: {re.escape(objection)}.*\Z"):
        Aiding.load(path, sigma=0.2)


@pytest.mark.parametrize(("sigma", "objection"), [(None, "has no sigma"), (0.0, "a sigma is not above 0")])
def test_a_velocity_without_a_sigma_is_refused(tmp_path, sigma, objection):
    with pytest.raises(TumbleError, match=objection):
        Aiding.load(written(tmp_path, "time,vx\n0,1\n"), sigma)


@settings(max_examples=30)
@given(
    st.integers(1, 20),
    st.sampled_from(["velocity", "body velocity", "heading", "score"]),
    st.integers(0, 2**32),
)
def test_saved_content_is_loaded_again(tmp_path_factory, samples, kind, seed):
    draw = np.random.default_rng(seed)
    time, value = np.sort(draw.uniform(0, 100, samples)), draw.standard_normal((samples, 3))
    if kind == "score":
        aiding = Aiding.score("imu 2", time, value[:, 0])
    elif kind == "heading":
        aiding = Aiding.heading(time, value[:, 0], 0.1)
    else:
        value[draw.uniform(size=value.shape) < 0.2] = np.nan
        value[np.isnan(value).all(axis=1), 0] = 1.0
        aiding = Aiding.velocity(time, value, [0.1, 0.2, 0.3], in_body=kind == "body velocity")
    (loaded,) = Aiding.load(aiding.save(tmp_path_factory.mktemp("saved") / "aiding.csv"))
    assert (loaded.kind, loaded.unit) == (aiding.kind, aiding.unit)
    assert np.array_equal(loaded.time, aiding.time)
    assert np.array_equal(loaded.value, aiding.value)
    assert np.array_equal(loaded.sigma, aiding.sigma)


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """Two units whose primary changes smoothly across gravity in flight: only aiding can isolate it."""
    folder = tmp_path_factory.mktemp("flight")
    print(f"seed {SEED}")
    fault = f"primary:bias-drift:triad=accelerometer:axis=x:start={FAULT}:end={FAULT + 2}:size=1.5"
    simulated = typed(
        *("simulate", "flight", "--unit", "tactical", "--unit", "industrial", "--fault", fault),
        *("--vibration", 0.5, "--velocity-rate", 5, "--seed", SEED, "-o", folder),
    )
    assert simulated.code == 0, simulated.err
    return folder


def replayed(flight, folder, *more):
    return typed(
        *("redundancy", "--primary", flight / "primary.csv", "--secondary", flight / "secondary_1.csv"),
        *("--settings", flight / "units.yaml", *more, "-o", folder),
    )


def test_aiding_isolates_the_fault_that_two_units_cannot(flight, tmp_path):
    done = replayed(flight, tmp_path, "--aiding", flight / "velocity.csv")
    said = " ".join(done.out.split())
    assert done.code == 0, done.out + done.err
    assert re.match(r"primary: accelerometer, isolated \(", said), said
    assert "an aiding measurement contradicts it" in said
    assert "secondary_1 took over at" in said


def test_aiding_of_another_time_is_refused_with_both_spans(flight, tmp_path):
    path = written(tmp_path, "time,vx,sigma\n5000,1,0.3\n5001,1,0.3\n")
    done = replayed(flight, tmp_path, "--aiding", path)
    assert done.code == 2
    assert re.search(r"aiding: speaks from 5000\.000 to 5001\.000 s, the logs from 0\.\d+ to", done.err)


def test_a_score_of_an_unknown_unit_is_refused(flight, tmp_path):
    done = replayed(flight, tmp_path, "--aiding", written(tmp_path, "time,score_imu9\n5,1\n"))
    assert done.code == 2
    assert "the score of imu9 is of none of primary, secondary_1" in done.err


def test_heading_isolates_the_gyroscope_that_drifts_about_vertical(tmp_path):
    moved = motion(rest=12.0, moving=110.0, swing=(0.3, 0.3, 1.5), push=1.0)
    said = record([PRIMARY, SOUND], 71, moved)
    secondary = said["imu3"]
    world_from_case = _attitudes(moved, secondary.time)
    drift = 0.002 * np.clip(secondary.time - 70.0, 0.0, None)
    secondary.readings[:, 3:] += world_from_case.inv().apply(drift[:, np.newaxis] * [0.0, 0.0, 1.0])
    every = slice(None, None, 20)
    ahead = world_from_case.apply([1.0, 0.0, 0.0])[every]
    yaw = np.arctan2(ahead[:, 1], ahead[:, 0]) + np.random.default_rng(72).normal(0.0, 0.03, len(ahead))
    Aiding.heading(secondary.time[every], yaw, 0.03).save(tmp_path / "heading.csv")
    logs = [each.write(tmp_path / f"{name}.csv") for name, each in said.items()]

    def blamed(*more, code=None):
        _, events = replay(*units(logs), *QUICK, *more, "-o", tmp_path / f"out{len(more)}", code=code)
        found = [each for each in events if each["figures"].get("reason") == "isolated"]
        return [(each["unit"], each["figures"]["ground"]) for each in found]

    assert blamed() == []
    assert blamed("--aiding", tmp_path / "heading.csv") == [("imu3", "aiding")]


def _attitudes(moved, times):
    """World from case, integrated from the angular rate that a motion has."""
    step = moved.time[1] - moved.time[0]
    turns = Rotation.from_rotvec(moved.angular_rate * step)
    attitude, found = Rotation.identity(), []
    wanted = set(np.round(times / step).astype(int).tolist())
    for number, turn in enumerate(turns):
        if number in wanted:
            found.append(attitude.as_quat())
        attitude = attitude * turn
    return Rotation.from_quat(found)


@pytest.mark.parametrize("seed", [1191])
def test_rest_overrules_aiding_that_blamed_a_healthy_unit(seed):
    """A slow ramp of the primary of two: aiding names the secondary, physics at rest the primary."""
    mission = draw(seed)
    assert (mission.units, mission.faulty) == (2, 0)
    _, _, replayed = flown(mission, with_aiding=True)
    named = [
        (unit, figures.get("ground")) for _, unit, what, figures in replayed.events if what == "unhealthy"
    ]
    assert named == [(1, "aiding"), (0, None)]
    sources = [unit for _, unit, what, _ in replayed.events if what == "selected"]
    assert sources[-1] == 1
