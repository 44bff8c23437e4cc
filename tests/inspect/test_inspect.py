"""`inspect`: what a recording holds, how good it is, and what it can serve."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from log_fixtures import made_up, write, write_text
from repetitions import drawn_seed
from tumble.foundation.recording import Chunk, Recording
from tumble.foundation.timing import TimeWatch
from tumble.logs import open_recording
from tumble.tools.inspect.procedure import inspect
from tumble.tools.inspect.samples import quantisation_step
from turntable_sessions import typed

G = 9.80665
GRAVITY_UP = np.array([0.0, 0.0, G])
RATE = 100.0
FACES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)


def recording(time, accelerometer, gyroscope, temperature=None):
    return Recording.from_arrays("made up", time, accelerometer, gyroscope, temperature)


def noise(samples, seed=4):
    random = np.random.default_rng(seed)
    return random.normal(0.0, 0.01, (samples, 3)), random.normal(0.0, 0.001, (samples, 3))


def still(up=(0.0, 0.0, 1.0), seconds=6.0):
    samples = int(seconds * RATE)
    return np.tile(G * np.asarray(up, float), (samples, 1)), np.zeros((samples, 3))


def turned(start, axis, angle, seconds=2.0):
    """Specific force and rate while the unit turns about an axis of its own, from up = `start`."""
    samples = int(seconds * RATE)
    axis = np.asarray(axis, float)
    turned_by = np.linspace(0.0, angle, samples)
    cross = np.cross(axis, start)
    along = (axis @ start) * axis
    up = np.array([along + np.cos(a) * (start - along) - np.sin(a) * cross for a in turned_by])
    return G * up, np.tile(axis * angle / seconds, (samples, 1))


def put_together(*pieces, seed=4):
    force, rate = np.vstack([piece[0] for piece in pieces]), np.vstack([piece[1] for piece in pieces])
    force_noise, rate_noise = noise(len(force), seed)
    return np.arange(len(force)) / RATE, force + force_noise, rate + rate_noise


def six_faces():
    """Rests with each axis up and down, quarter turns between them."""
    order = [0, 2, 1, 3, 4, 5]
    pieces = []
    for position, face in enumerate(order):
        pieces.append(still(FACES[face]))
        if position + 1 < len(order):
            after = FACES[order[position + 1]]
            axis = np.cross(FACES[face], after)
            if np.linalg.norm(axis) == 0.0:
                axis, angle = FACES[0], np.pi
            else:
                angle = np.pi / 2
            pieces.append(turned(FACES[face], -axis, angle))
    return put_together(*pieces)


def services(inspection):
    return {service.procedure: service for service in inspection.services}


def test_rate_jitter_and_gaps_are_those_put_in():
    random = np.random.default_rng(8)
    steps = np.full(20_000, 0.005) + random.normal(0.0, 20e-6, 20_000)
    steps[7_000] += 1.0
    steps[12_000] += 0.05
    time = 100.0 + np.cumsum(steps)
    force, rate = noise(20_000)
    timing = inspect(recording(time, force + GRAVITY_UP, rate)).timing
    assert timing.samples == 20_000
    assert timing.rate == pytest.approx(200.0, rel=1e-4)
    assert timing.jitter == pytest.approx(20e-6, rel=0.05)
    assert (timing.gaps, timing.missing) == (2, 210)
    assert timing.longest_gap == pytest.approx(1.005, abs=1e-4)
    assert timing.longest_gap_at == pytest.approx(time[6_999], abs=1e-9)


def test_an_inspection_does_not_depend_on_where_chunks_end():
    time, force, rate = six_faces()
    whole = recording(time, force, rate)
    cut = Recording(
        whole.metadata,
        lambda: (
            Chunk(time[i : i + 777], force[i : i + 777], rate[i : i + 777]) for i in range(0, len(time), 777)
        ),
    )
    one, other = inspect(whole), inspect(cut)
    assert one.timing.rate == pytest.approx(other.timing.rate, rel=1e-12)
    assert [rest.start for rest in one.rests] == [rest.start for rest in other.rests]
    assert [(c.low, c.high, c.saturated) for c in one.channels] == [
        (c.low, c.high, c.saturated) for c in other.channels
    ]


@pytest.mark.parametrize("channel", range(6))
def test_a_stuck_channel_is_named_and_stands_in_the_way(channel):
    time, force, rate = six_faces()
    (force if channel < 3 else rate)[:, channel % 3] = 0.25
    inspection = inspect(recording(time, force, rate))
    assert [c.stuck for c in inspection.channels] == [index == channel for index in range(6)]
    name = inspection.channels[channel].name
    assert any(f"{name} is stuck at 0.25" in remark for remark in inspection.remarks)
    assert not services(inspection)["turntable, as target"].possible


def test_samples_pinned_at_the_end_of_the_range_are_counted():
    random = np.random.default_rng(2)
    rate = np.column_stack([np.sin(np.arange(40_000) / 30.0) * 6.0, *random.normal(0, 0.01, (2, 40_000))])
    clipped = np.clip(rate, -4.0, 4.5)
    pinned = int((rate[:, 0] <= -4.0).sum() + (rate[:, 0] >= 4.5).sum())
    force, _ = noise(40_000)
    inspection = inspect(recording(np.arange(40_000) / RATE, force + GRAVITY_UP, clipped))
    assert [channel.saturated for channel in inspection.channels] == [0, 0, 0, pinned, 0, 0]


def test_a_coarse_sensor_at_rest_is_not_taken_for_saturated_or_stuck():
    time, force, rate = six_faces()
    force, rate = np.round(force / 0.05) * 0.05, np.round(rate / 0.002) * 0.002
    inspection = inspect(recording(time, force, rate))
    assert not any(channel.saturated or channel.stuck for channel in inspection.channels)
    assert [channel.step for channel in inspection.channels] == pytest.approx(
        [0.05] * 3 + [0.002] * 3, rel=1e-6
    )


@given(
    step=st.floats(1e-6, 1e3),
    offset=st.floats(-10.0, 10.0),
    counts=st.lists(st.integers(-60, 60), min_size=400, max_size=400),
)
def test_a_quantisation_step_is_found_whatever_scale_and_offset(step, offset, counts):
    if len(set(counts)) < 60:
        return
    values = (np.array(counts) + offset) * step
    assert quantisation_step(values) == pytest.approx(step, rel=1e-6)


def test_floats_that_scatter_freely_show_no_step():
    assert quantisation_step(np.random.default_rng(3).normal(size=60_000)) is None
    assert quantisation_step(np.zeros(100)) is None


def test_six_faces_serve_the_turntable_but_no_spin():
    inspection = inspect(recording(*six_faces()))
    assert len(inspection.rests) == 6
    assert inspection.directions == 6
    found = services(inspection)
    assert found["turntable, as reference"].possible
    assert found["turntable, as target"].possible
    assert found["turntable, as target"].remarks == ()
    assert not found["spin"].possible
    assert found["redundancy"].missing == ("a second IMU logged with it by the same clock",)


def test_one_rest_does_not_suit_a_turntable():
    found = services(inspect(recording(*put_together(still(seconds=20.0)))))
    assert found["turntable, as target"].missing == (
        "rests in at least 4 directions more than 20 deg apart, 1 found",
    )


def test_rests_in_one_plane_do_not_suit_a_turntable():
    pieces = []
    for angle in np.arange(0.0, 2.0 * np.pi, np.pi / 3):
        up = np.array([np.sin(angle), 0.0, np.cos(angle)])
        pieces += [still(up), turned(up, [0.0, -1.0, 0.0], np.pi / 3)]
    found = services(inspect(recording(*put_together(*pieces))))
    assert found["turntable, as target"].missing == (
        "a rest out of the plane in which all directions found lie",
    )


@pytest.mark.parametrize(("turns", "possible"), [(1.01, True), (-3.0, True), (0.7, False)])
def test_a_spin_needs_a_full_turn_on_the_spot_after_a_rest(turns, possible):
    z_up = np.array([0.0, 0.0, 1.0])
    spin = turned(z_up, z_up * np.sign(turns), abs(turns) * 2.0 * np.pi, seconds=2.0 * np.pi * abs(turns))
    spin_service = services(inspect(recording(*put_together(still(seconds=5.0), spin, still()))))["spin"]
    assert spin_service.possible is possible
    if not possible:
        assert "the longest found is 252 deg" in spin_service.missing[0]


def test_a_recording_without_a_rest_lacks_one_for_a_spin():
    time = np.arange(0.0, 60.0, 1.0 / RATE)
    force, rate = noise(len(time))
    sway = np.column_stack([np.sin(2.0 * time), np.cos(3.0 * time), np.sin(time)])
    found = services(inspect(recording(time, force + GRAVITY_UP + 3.0 * sway, rate + sway)))
    assert "a rest of at least 2 s" in found["spin"].missing


def test_two_imus_of_one_table_are_redundant(tmp_path):
    time, force, rate = six_faces()
    names = [f"imu{i}_{c}" for i in (1, 2) for c in ("ax", "ay", "az", "gx", "gy", "gz")]
    table = np.column_stack([time, force, rate, force, rate])
    path = tmp_path / "pair.csv"
    np.savetxt(path, table, delimiter=",", header=",".join(["time", *names]), comments="")
    assert services(inspect(open_recording(f"{path}:imu2")))["redundancy"].possible


def test_spread_orientations_serve_multi_pose_and_six_faces_do_not():
    directions = np.vstack([FACES, np.array([[x, y, 1.0] for x in (-1, 1) for y in (-1, 1)]) / np.sqrt(3.0)])
    pieces = []
    for before, after in pairwise(directions):
        axis = np.cross(before, after)
        axis = axis if np.linalg.norm(axis) > 0.0 else np.roll(before, 1)
        angle = np.arccos(np.clip(before @ after, -1.0, 1.0))
        pieces += [still(before), turned(before, -axis / np.linalg.norm(axis), angle)]
    found = services(inspect(recording(*put_together(*pieces, still(directions[-1])))))
    assert found["multipose"].possible
    few = services(inspect(recording(*six_faces())))["multipose"]
    assert few.missing == ("rests in at least 10 orientations, held for 3 s, 6 found",)


def test_unit_at_rest_serves_noise_and_drift_if_temperature_changes():
    time, force, rate = put_together(still(seconds=120.0))
    warming = np.linspace(20.0, 26.0, len(time))
    found = services(inspect(recording(time, force, rate, warming)))
    assert found["noise"].possible
    assert found["thermal"].possible
    cool = services(inspect(recording(time, force, rate, 0.3 * warming)))["thermal"]
    assert cool.missing == ("5 K of change in temperature, 1.8 K found",)
    assert services(inspect(recording(time, force, rate)))["thermal"].missing == (
        "a temperature, none was recorded",
    )


def test_omissions_are_counted_in_the_inspection(tmp_path):
    chunk = made_up(3000)
    chunk.gyroscope[5, 0] = np.nan
    chunk.time[100] = chunk.time[99]
    inspection = inspect(open_recording(write(tmp_path / "log.csv", chunk)))
    assert (inspection.timing.duplicates, inspection.timing.without_number) == (1, 1)
    assert "left out 1 sample without a number (gx 1)" in inspection.remarks


def test_a_folder_of_poses_is_inspected_part_by_part(tmp_path):
    for number, face in enumerate(FACES):
        write(tmp_path / f"{number}.csv", Chunk(*put_together(still(face), seed=number)))
    inspection = inspect(open_recording(tmp_path))
    assert len(inspection.rests) == 6
    assert inspection.timing.samples == 3600
    assert inspection.timing.gaps == 0
    target = services(inspection)["turntable, as target"]
    assert target.possible
    assert target.remarks == ("gyroscope scale and axes stay unknown without turns between rests",)


def test_temperature_is_reported_with_its_span(tmp_path):
    low, mean, high = inspect(open_recording(write(tmp_path / "log.csv", made_up(3000)))).temperature
    assert (low, mean, high) == pytest.approx((25.0, 25.5, 26.0), abs=1e-6)


def test_a_corrected_log_is_said_to_be_corrected(tmp_path):
    path = write(tmp_path / "log.csv", made_up(3000), corrected="sha256:ab", serial="7")
    inspection = inspect(open_recording(path))
    assert "csv, frame case, serial 7, already corrected" in repr(inspection)
    assert any("already corrected" in remark for remark in inspection.remarks)


def test_progress_counts_up_to_all_samples(tmp_path):
    told = []
    path = write(tmp_path / "log.parquet", made_up(200_000))
    inspect(open_recording(path), lambda done, expected: told.append((done, expected)))
    assert told[-1] == (200_000, 200_000)
    assert [done for done, _ in told] == sorted(done for done, _ in told)


NAMED = {"time": "clock", "ax": "q1", "ay": "q2", "az": "q3", "gx": "w1", "gy": "w2", "gz": "w3"}


@pytest.mark.parametrize(
    "columns",
    [NAMED, {key: str(place) for place, key in enumerate(NAMED, start=1)}],
    ids=["name", "position"],
)
def test_a_table_of_unknown_names_is_inspected_with_columns(tmp_path, columns):
    path = write_text(tmp_path / "log.csv", made_up(400, temperature=False), ",".join(NAMED.values()))
    done = typed("inspect", path, "--columns", ",".join(f"{key}={name}" for key, name in columns.items()))
    assert done.code == 0, done.err
    assert "200 Hz" in done.out
    assert "a second IMU" in done.text


def test_a_table_that_is_no_terminals_shows_every_digit(tmp_path):
    log = write(tmp_path / "drive.csv", made_up(600))
    done = typed("inspect", log)
    assert done.code == 0
    assert "saturated" in done.out
    assert "\N{HORIZONTAL ELLIPSIS}" not in done.out


def test_time_that_comes_sample_by_sample_shows_what_it_shows_at_once():
    generator = np.random.default_rng(drawn_seed())
    steps = 0.01 + 1e-4 * generator.standard_normal(500)
    steps[generator.integers(50, 500, 6)] += 0.05
    time = np.cumsum(steps)
    at_once, one_by_one = TimeWatch(), TimeWatch()
    at_once.push(time)
    one_by_one.push(time[:40])
    for stamp in time[40:]:
        one_by_one.push(np.array([stamp]))
    for name in ("samples", "start", "end"):
        assert getattr(at_once, name) == getattr(one_by_one, name)
    assert one_by_one.interval == pytest.approx(at_once.interval, rel=1e-3)
    assert (one_by_one.gaps, one_by_one.missing) == (at_once.gaps, at_once.missing)
    assert one_by_one.longest_gap == pytest.approx(at_once.longest_gap)
    assert one_by_one.duration == pytest.approx(at_once.duration)


def test_magnetometer_is_summed_up_by_rate_and_strength(tmp_path):
    time = np.arange(2000) / 200.0
    field = np.array([20.0, 0.0, 40.0]) + np.random.default_rng(3).normal(0.0, 1.0, (2000, 3))
    names = "time,ax,ay,az,gx,gy,gz,mx,my,mz"
    still = np.tile([0.0, 0.0, 9.81, 0.0, 0.0, 0.0], (2000, 1))
    still += np.random.default_rng(4).normal(0.0, 1e-3, still.shape)
    table = np.column_stack([time, still, np.repeat(field[::10], 10, axis=0)])
    path = tmp_path / "log.csv"
    np.savetxt(path, table, delimiter=",", header=names, comments="")
    found = inspect(open_recording(path))
    assert (found.magnetometer.readings, round(found.magnetometer.rate, 6)) == (200, 20.0)
    assert abs(found.magnetometer.strength - 44.7) < 0.5
    assert any(
        "magnetometer in uT (assumed), 200 readings, 20 Hz: field of 44" in line for line in found.lines()
    )
