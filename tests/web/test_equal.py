"""The page finds, reports and writes what the command does, to the last bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tumble
from repetitions import SOAK, drawn_seed
from tumble.foundation.errors import TumbleError
from tumble.logs import ReadOptions
from tumble.logs.columns import recognise
from tumble.tools.exchange.registry import TARGETS
from tumble.tools.simulate import simulate_multipose
from web_page import DATE, SECONDS, by_command, found_in, headless

DATA = Path(__file__).parents[3] / "shared" / "data"

RECORDINGS = {
    "mpu9150/imu0.log": {"rate": 100.0},
    "mpu9150/imu1.log": {"rate": 100.0},
    "mpu9150/imu2.log": {"rate": 100.0, "serial": "0012"},
    "xsens/xsens_acc.mat": {"raw": True},
    "world/unread_gyroscope_columns/rpm.csv": {},
    "mpu6050/calibration.csv": {"raw": True},
    "world/triad_of_zeros/accelerometer_only.csv": {},
    "world/trailing_tab/sketch.txt": {},
    "world/raw_counts_near_1000_a_g/counts_1024.csv": {},
    "world/held_poses_in_planes/cal.csv": {},
    "world/time_unit_slow_log/s_1hz.csv": {},
    "world/noise_rate_unit_assumed/static.csv": {},
    "world/unit_of_named_column/wit_zh.txt": {},
    "imucal/example_ferraris_session.csv": {"rate": 102.4, "gyroscopeUnit": "deg/s"},
}
"""Options of the page by recording; some are refused, and then in the same words."""


@pytest.fixture(autouse=True)
def one_date(monkeypatch):
    """Has the command write the date that the page is given."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", SECONDS)


@pytest.mark.skipif(not DATA.exists(), reason=f"no recordings in {DATA}")
def test_recordings_give_the_same_file_to_the_byte():
    jobs = [{"files": files_of(DATA / name), "read": read, "date": DATE} for name, read in RECORDINGS.items()]
    found = dict(zip(RECORDINGS, headless(jobs), strict=True))
    calibrated = 0
    for name, by_page in found.items():
        exports = by_page.pop("exports", None)
        expected = by_command(DATA / name, RECORDINGS[name])
        calibrated += "text" in expected
        assert by_page == expected, name
        if exports is not None:
            assert exports == exports_of(DATA / name, RECORDINGS[name]), name
    assert calibrated >= 5


@pytest.mark.skipif(not DATA.exists(), reason=f"no recordings in {DATA}")
def test_six_faces_give_the_same_file_to_the_byte():
    path = DATA / "imucal" / "example_ferraris_session.csv"
    read = {"rate": 102.4, "gyroscopeUnit": "deg/s"}
    (by_page,) = headless([{"files": [str(path)], "read": read, "faces": True, "date": DATE}])
    options = ReadOptions(rate=102.4, gyroscope_unit="deg/s")
    assert by_page["text"] == tumble.multipose(path, read=options, faces=True).calibration.text()


HEAD = "time_us,ax [g],ay [g],az [g],gx [deg/s],gy [deg/s],gz [deg/s],temp"
STATED = {
    "ft/s^2": HEAD.replace("[g]", "[ft/s^2]"),
    "a count": HEAD.replace("[g]", "[LSB]"),
    "one axis": HEAD.replace("ay [g]", "ay (raw)"),
    "gon/s": HEAD.replace("[deg/s]", "[gon/s]"),
    "in parentheses": HEAD.replace("[deg/s]", "(0.1 deg/s)"),
    "time": HEAD.replace("time_us", "time [100ns]"),
    "temperature": HEAD.replace("temp", "temp [0.1 degC]"),
    "°F": HEAD.replace("temp", "temp [degrees F]"),
    "no unit": HEAD.replace(" [g]", " (IMU1)").replace("deg/s", "° s⁻¹"),
    "cm/s^2": HEAD.replace("[g]", "[Gal]"),
    "below the names": "time_us,ax,ay,az,gx,gy,gz,temp\nus,g,g,g,LSB,LSB,LSB,-",
}
"""Heads of logs that state a unit that is unknown, known, or none at all."""


def test_logs_that_state_any_unit_give_the_same_file_or_refusal(tmp_path):
    rows = session(np.random.default_rng(drawn_seed()), 0.0).split("\n", 1)[1]
    paths = [tmp_path / f"log {number}.csv" for number in range(len(STATED))]
    for path, head in zip(paths, STATED.values(), strict=True):
        path.write_text(f"{head}\n{rows}", encoding="utf-8")
    by_page = headless([{"files": [str(path)], "read": {}, "date": DATE} for path in paths])
    for name, path, page in zip(STATED, paths, by_page, strict=True):
        page.pop("exports", None)
        assert page == by_command(path, {}), name
    assert sum("which is no known unit of" in page.get("failure", "") for page in by_page) == 7


def files_of(path: Path) -> list[str]:
    partner = path.with_name(path.name.replace("_acc", "_gyro"))
    return [str(path), *([str(partner)] if partner != path else [])]


def exports_of(path: Path, read):
    """Returns the files for other programs, or their line of error."""
    calibration = found_in(path, **read).calibration
    typed = {"px4": {"accelerometer-id": "1310988", "gyroscope-id": "2490378"}}
    found = {}
    for word in ("c", "ardupilot", "betaflight", "px4"):
        try:
            found[word] = TARGETS[word].export([calibration], typed.get(word, {})).content.decode()
        except TumbleError as error:
            found[word] = str(error)
    return found


@pytest.mark.parametrize(("late", "failing"), [(0.0, None), (2e-3, None), (0.0, 120), (0.0, 40)])
def test_drawn_sessions_give_the_same_file_to_the_byte(tmp_path, late, failing):
    """Reads that gave zero, one in `failing`, are left out, or refused where they are too many."""
    rng = np.random.default_rng(drawn_seed())
    path = tmp_path / f"unit 7 {late} {failing}.csv"
    head, *rows = session(rng, late).splitlines()
    for row in range(50, len(rows), failing or len(rows)):
        time, *_, temperature = rows[row].split(",")
        rows[row] = ",".join([time, *6 * ["0"], temperature]) if failing else rows[row]
    path.write_text("\n".join([head, *rows, ""]), encoding="utf-8")
    (by_page,) = headless([{"files": [str(path)], "read": {}, "date": DATE}])
    by_page.pop("exports", None)
    assert by_page == by_command(path, {})


def test_rows_with_labels_of_imus_are_read_as_by_the_command(tmp_path):
    rng = np.random.default_rng(drawn_seed())
    path = tmp_path / "two.csv"
    (head, *first), (_, *second) = (session(rng, 0.0).splitlines() for _ in range(2))
    turns = [
        f"{label},{row}" for rows in zip(first, second, strict=True) for label, row in enumerate(rows, 7)
    ]
    path.write_text("\n".join([f"sensor_id,{head}", *turns, ""]), encoding="utf-8")
    reads = ({}, {"imu": "7"}, {"imu": "8"})
    refused, *found = headless([{"files": [str(path)], "read": read, "date": DATE} for read in reads])
    assert "column sensor_id distinguishes 2 IMUs" in refused["failure"]
    assert refused == by_command(path, {})
    for by_page, read in zip(found, reads[1:], strict=True):
        by_command_too = tumble.multipose(path, read=ReadOptions(topic=read["imu"]))
        assert by_page["text"] == by_command_too.calibration.text()


def test_a_pair_of_files_with_names_is_refused_in_one_line(tmp_path):
    head = {"acc": "time,ax [g],ay [g],az [g]", "gyro": "time,gx [deg/s],gy [deg/s],gz [deg/s]"}
    for word, names in head.items():
        rows = [f"{k / 100.0},0.1,0.2,{1.0 + k * 1e-4}" for k in range(500)]
        (tmp_path / f"wk_{word}.csv").write_text("\n".join([names, *rows, ""]), encoding="utf-8")
    files = [str(tmp_path / f"wk_{word}.csv") for word in head]
    (found,) = headless([{"files": files, "read": {}, "date": DATE}])
    assert found["failure"].startswith("wk_acc.csv: names its columns")


@pytest.mark.parametrize("late", [0.0, 0.02])
def test_stamps_of_a_gyroscope_are_read_as_by_the_command(tmp_path, late):
    head, *rows = session(np.random.default_rng(drawn_seed()), 0.0).splitlines()
    own = [f"{row},{int(row.split(',')[0]) + round(1e6 * late)}" for row in rows]
    path = tmp_path / "own.csv"
    path.write_text("\n".join([f"{head},gyro_time_us", *own, ""]), encoding="utf-8")
    (by_page,) = headless([{"files": [str(path)], "read": {}, "date": DATE}])
    by_page.pop("exports", None)
    assert by_page == by_command(path, {})
    assert ("failure" in by_page) == (late > 0.0)


CONTRADICTED = {
    "lost_and_counted": "times what noise explains",
    "lost_without_holes": "times what noise explains",
    "zeroed_at_rest": "zeroes itself at rest",
    "dead_band": "has a dead band",
    "stated_101": "states 101 Hz, but the log's stamps show 100 Hz",
    "lost_and_stated": "samples missing",
    "stated_300": "which no sensor has",
}
"""A part of the objection by the log."""
NOTED = {"one_lost_and_stated": "with 1 sample missing", "bent": "", "sound": ""}
"""A part of a warning, or none, by logs that calibrate."""


def test_contradictions_give_the_same_verdict_to_the_byte(tmp_path):
    reads = {name: {"rate": rate} for name, rate in contradicting_logs(tmp_path)}
    assert reads.keys() == {*CONTRADICTED, *NOTED}
    paths = {name: tmp_path / f"{name}.csv" for name in reads}
    jobs = []
    for name, read in reads.items():
        stated = {key: value for key, value in read.items() if value}
        jobs.append({"files": [str(paths[name])], "read": stated, "date": DATE})
    for (name, read), by_page in zip(reads.items(), headless(jobs), strict=True):
        by_page.pop("exports", None)
        assert by_page == by_command(paths[name], read), name
        verdict = "model not met" if name in CONTRADICTED else "calibrated"
        assert f"verdict: {verdict}" in by_page["text"].replace('"', ""), name
        part = {**CONTRADICTED, **NOTED}[name]
        assert not part or any(part in line for line in by_page["warnings"]), name


def contradicting_logs(folder):
    """Writes logs whose turns contradict their rests, or their stamps a stated rate; yields name and rate."""
    seed = drawn_seed()
    hand = simulate_multipose(
        seed=seed,
        grade="consumer",
        orientations=24,
        bias_instability=False,
        g_sensitivity=False,
        latitude_deg=None,
        rate_hz=100.0,
    )
    samples, rng = hand.unit.samples, np.random.default_rng(seed)
    even, force = np.arange(len(samples)) / 100.0, samples.accelerometer
    rate = samples.gyroscope - hand.unit.gyroscope.b
    is_rest = np.zeros(len(samples), dtype=bool)
    for each in hand.session.rests:
        is_rest |= (samples.time >= each.start) & (samples.time <= each.end)
    most, one = rng.random(len(samples)) > 0.03, np.arange(len(samples)) != len(samples) // 2
    zeroed = rate + np.where(is_rest[:, None], 0.0, [0.02, -0.01, 0.015])
    deaf = np.where(np.abs(rate + 1e-3) < 0.04, 0.0, rate) + 1e-4 * rng.normal(size=rate.shape)
    bent = force + 8e-5 * force**2
    logs = {
        "lost_and_counted": (None, most, samples.gyroscope, 100.0),
        "lost_without_holes": (even[: most.sum()], most, samples.gyroscope, None),
        "zeroed_at_rest": (even, slice(None), zeroed, None),
        "dead_band": (even, slice(None), deaf, None),
        "stated_101": (even, slice(None), samples.gyroscope, 101.0),
        "lost_and_stated": (even[most], most, samples.gyroscope, 100.0),
        "one_lost_and_stated": (even[one], one, samples.gyroscope, 100.0),
        "stated_300": (None, slice(None), samples.gyroscope, 300.0),
        "bent": (even, slice(None), samples.gyroscope, None),
        "sound": (even, slice(None), samples.gyroscope, 100.0),
    }
    for name, (time, keep, rates, stated) in logs.items():
        columns = {} if time is None else {"time (s)": time}
        read = bent if name == "bent" else force
        columns |= {f"a{axis} (m/s^2)": read[keep, k] for k, axis in enumerate("xyz")}
        columns |= {f"g{axis} (rad/s)": rates[keep, k] for k, axis in enumerate("xyz")}
        pandas.DataFrame(columns).to_csv(folder / f"{name}.csv", index=False)
        yield name, stated


def session(rng, late: float) -> str:
    """Returns a log of twelve orientations, turned in between; stamps are late by up to so many seconds."""
    rate, rows, time = 100.0, ["time_us,ax [g],ay [g],az [g],gx [deg/s],gy [deg/s],gz [deg/s],temp"], 0.0
    up = np.array([0.0, 0.0, 1.0])
    for _ in range(12):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        angle = rng.uniform(0.7, 2.0)
        moves = [(np.zeros(3), int(3.0 * rate)), (axis * angle, int(rate))]
        for turn, samples in moves:
            speed = turn * rate / samples
            for _ in range(samples):
                step = -speed / rate
                up = up + np.cross(step, up) + 0.5 * np.cross(step, np.cross(step, up))
                up /= np.linalg.norm(up)
                force = 1.01 * up + FORCE_BIAS + rng.normal(0.0, 5e-4, 3)
                turned = np.degrees(speed + RATE_BIAS + rng.normal(0.0, 1e-3, 3))
                stamp = round(1e6 * (time + rng.uniform(0.0, late)))
                numbers = [*(f"{each:.6f}" for each in (*force, *turned)), f"{25.0 + time / 100.0:.2f}"]
                rows.append(f"{stamp},{','.join(numbers)}")
                time += 1.0 / rate
    return "\n".join(rows) + "\n"


FORCE_BIAS, RATE_BIAS = np.array([0.02, -0.01, 0.03]), np.array([0.01, -0.02, 0.005])
"""g and rad/s."""
WORDS = (
    "acc",
    "gyr",
    "a",
    "g",
    "w",
    "accel",
    "angular_velocity",
    "mag",
    "time",
    "t",
    "temp",
    "imu1",
    "x",
    "y",
)
ENDS = (
    "_x",
    "y",
    " z",
    "[0]",
    ".x",
    " (m/s^2)",
    " [deg/s]",
    " [Gal]",
    " (0.1 degC)",
    " (body)",
    "_dps (IMU1)",
    " (g)",
    " [hh:mm]",
    "[°·s⁻¹]",
    " (min)",
    "_ms",
    "_us",
    "_CAL",
    " [x8004]",
    "",
    "_dps",
    "1",
)


# Many names at once: a start of Node takes longer than all of them.
@settings(max_examples=30 if SOAK else 6, deadline=None)
@given(st.lists(st.tuples(*map(st.sampled_from, (WORDS, ENDS, ENDS))), min_size=200, max_size=200))
def test_names_of_columns_mean_the_same(parts):
    names = ["".join(each) for each in parts]
    (found,) = headless([{"names": names}])
    for name, column in zip(names, found, strict=True):
        meant = recognise(name)
        expected = meant and {
            "quantity": meant.quantity,
            "axis": meant.axis,
            "imu": meant.imu,
            "unit": meant.unit,
            "unknown": meant.unknown,
        }
        assert (column and {"unit": None, "unknown": "", **column}) == expected, name
