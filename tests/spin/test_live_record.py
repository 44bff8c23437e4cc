"""A live spin that records what it takes, and goes on correcting once it has its calibration."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
import yaml

import tumble.tools.apply.command_live  # noqa: F401
from live_fixtures import text_lines
from spin_sessions import record, still, turn
from tumble.calibration.document import Calibration
from tumble.logs import open_recording
from turntable_sessions import typed


@pytest.fixture(scope="module")
def session():
    return record([still(6.0), turn(2.5), still(3.0)], seed=31)


@pytest.fixture
def log(session, tmp_path):
    path = tmp_path / "drive.csv"
    path.write_bytes(text_lines(session.table, header="time_s,ax,ay,az,gx_rad/s,gy_rad/s,gz_rad/s"))
    return path


def live(source, *words):
    return typed("spin", "--live", f"replay:{source}?speed=max", *words)


def without_date(path):
    content = yaml.safe_load(path.read_text())
    return {key: value for key, value in content.items() if key not in ("date", "session")}


def test_recording_of_a_live_spin_gives_its_calibration_to_the_bit(log, tmp_path):
    first = live(log, "--json", "--record", tmp_path / "taken", "-o", tmp_path / "first")
    again = live(tmp_path / "taken", "--json", "-o", tmp_path / "again")
    assert (first.code, again.code) == (0, 0), first.err + again.err
    # Every event, its time, every figure of the result; files are elsewhere, and so is the source.
    events, repeated = ([json.loads(line) for line in done.out.splitlines()] for done in (first, again))
    assert events[:-1] == repeated[:-1]
    assert len(events) > 20
    assert events[-1]["spins"] == repeated[-1]["spins"]
    files = [tmp_path / name / "drive.live.yaml" for name in ("first", "again")]
    assert without_date(files[0]) == without_date(files[1])


def test_the_recording_is_the_log_up_to_where_the_spin_was_done(log, session, tmp_path):
    assert live(log, "--record", tmp_path / "taken", "-o", tmp_path).code == 0
    chunks = list(open_recording(tmp_path / "taken").chunks())
    taken = np.concatenate(
        [np.column_stack([each.time, each.accelerometer, each.gyroscope]) for each in chunks]
    )
    assert 0 < len(taken) < len(session.table)
    assert np.array_equal(taken, session.table[: len(taken)])


def test_after_a_spin_what_comes_is_corrected_by_what_was_found(log, session, tmp_path):
    done = live(log, "--then-apply", tmp_path / "rest.csv", "-o", tmp_path)
    assert done.code == 0, done.err
    rest = np.genfromtxt(tmp_path / "rest.csv", delimiter=",", comments="#", skip_header=2)
    if np.isnan(rest).any():
        rest = rest[~np.isnan(rest).any(axis=1)]
    table = session.table[-len(rest) :]
    assert 0 < len(rest) < len(session.table)
    assert np.array_equal(rest[:, 0], table[:, 0])
    found = Calibration.load(tmp_path / "drive.live.yaml")
    force, rate = found.correct(table[:, 1:4], table[:, 4:])
    assert np.array_equal(rest[:, 1:], np.column_stack([force, rate]))


def test_standard_output_with_corrected_samples_holds_nothing_else(log, tmp_path):
    done = live(log, "--then-apply", "stdout", "-o", tmp_path)
    names, *rows = done.out.splitlines()
    assert names == "time,ax,ay,az,gx,gy,gz"
    assert {row.count(",") for row in rows} == {6}
    assert "Calibration:" in done.err


def test_a_spin_that_fails_keeps_its_recording_and_says_how_it_ended(session, tmp_path):
    path = tmp_path / "drive.csv"
    path.write_bytes(text_lines(session.table[:400], header="time_s,ax,ay,az,gx_rad/s,gy_rad/s,gz_rad/s"))
    assert live(path, "--record", tmp_path / "taken", "-o", tmp_path).code == 2
    assert yaml.safe_load((tmp_path / "taken" / "session.yaml").read_text())["reason"] == "failed"
    assert sum(map(len, open_recording(tmp_path / "taken").chunks())) == 400


def test_a_source_that_is_not_there_leaves_no_session_behind(tmp_path):
    words = ("spin", "--live", "serial:/dev/no_such_port", "--record", tmp_path / "taken", "-o", tmp_path)
    assert "there is no such device" in typed(*words).err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [
        ("record", "a=serial:/dev/no_such_port", "-o", "results/session"),
        ("spin", "--live", "serial:/dev/no_such_port", "--record", "results/session", "-o", "results/live"),
        ("redundancy", "--live", "primary=serial:/dev/no_such_port", "a=udp://:0", "-o", "results/live"),
    ],
)
def test_a_source_that_cannot_be_opened_leaves_no_folder_behind(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert typed(*words).code == 2
    assert list(tmp_path.iterdir()) == []


def test_samples_go_on_while_the_page_is_written_or_fails(log, session, tmp_path, monkeypatch):
    heard = []

    def correct(found, samples, output, **options):
        heard.append((tmp_path / "drive.live.html").exists())

    monkeypatch.setattr(sys.modules["tumble.tools.apply.command_live"], "correct", correct)
    done = live(log, "--then-apply", tmp_path / "rest.csv", "-o", tmp_path)
    assert done.code == 0, done.err
    assert heard == [False]
    assert (tmp_path / "drive.live.html").read_text(encoding="utf-8").startswith("<!doctype html")

    (tmp_path / "drive.live.html").unlink()
    monkeypatch.setattr(
        sys.modules["tumble.tools.apply.command_live"],
        "correct",
        lambda *_, **__: (tmp_path / "drive.live.html").mkdir(),
    )
    done = live(log, "--then-apply", tmp_path / "rest.csv", "-o", tmp_path)
    assert done.code == 2
    last = done.err.splitlines()[-1]
    assert last.startswith("tumble: error: ")
    assert "drive.live.html: is a folder" in last


def test_recording_and_going_on_are_refused_with_a_log(log):
    for words in (("--record", "x"), ("--then-apply", "stdout")):
        done = typed("spin", log, *words)
        assert done.code == 2
        assert "are for a live stream" in done.err


def test_a_robot_that_turns_first_is_named_and_nothing_is_lost(tmp_path):
    spinning = record([turn(8.0)], seed=3)
    path = tmp_path / "spinning.csv"
    path.write_bytes(text_lines(spinning.table, header="time_s,ax,ay,az,gx_rad/s,gy_rad/s,gz_rad/s"))
    done = live(path, "--wait", "25", "--record", tmp_path / "kept", "-o", tmp_path / "results")
    assert done.code == 2
    assert "It turns before it stood still" in done.err
    assert "it turned before it stood still (" in done.err
    assert "in 25 s" in done.err
    assert f"What was received is in {tmp_path / 'kept'}" in done.err
    chunks = list(open_recording(tmp_path / "kept").chunks())
    assert sum(len(chunk) for chunk in chunks) > 2400


def test_a_live_source_is_recorded_unless_declined(log, tmp_path):
    words = ["-c", "from tumble.cli.main import main; main()", "spin", "--live", "stdin"]
    for number, extra in enumerate(([], [], ["--no-record"])):
        with log.open("rb") as lines:
            done = subprocess.run(
                [sys.executable, *words, *extra, "-o", tmp_path / "results"],
                stdin=lines,
                capture_output=True,
                text=True,
                check=False,
            )
        assert done.returncode == 0, done.stderr
        sessions = sorted(path.name for path in (tmp_path / "results").glob("session*"))
        assert sessions == ["session", "session-2"][: min(number + 1, 2)]


def test_a_robot_that_turns_on_has_no_bias_that_drifted(tmp_path):
    moves = [still(6.0), turn(6.0, rate=1.1)]
    turning = record(moves, seed=5, floor_tilt=0.0, lever_arm=(0.0, 0.0, 0.0))
    path = tmp_path / "turning.csv"
    path.write_bytes(text_lines(turning.table, header="time_s,ax,ay,az,gx_rad/s,gy_rad/s,gz_rad/s"))
    done = live(path, "-o", tmp_path / "results")
    assert done.code == 0, done.err
    assert "bias drifted" not in done.out + done.err
