"""`tumble spin --live` as it is typed: prompts, files, exit codes, and what a failed run leaves alone."""

from __future__ import annotations

import json
import os
import pty
import signal
import socket
import subprocess
import sys
import threading

import numpy as np
import pytest
import yaml
from pymavlink.dialects.v20 import common as mavlink

from live_fixtures import serial_device, text_lines
from ports import free_port
from spin_sessions import record, still, turn
from tumble.calibration.document import Calibration
from turntable_sessions import typed

AHEAD = 2.0
"""s of samples that may be under way to a program that has not confirmed them."""
HEADER = "time_s,ax,ay,az,gx_rad/s,gy_rad/s,gz_rad/s"
OLD = "schema: tumble-calibration/1\n"
PROGRAM = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
    "from tumble.cli.main import main; main()"
)
"""Control-C is taken in even where tests run in the background, which a shell has ignore it."""


@pytest.fixture(scope="module")
def session():
    return record([still(6.0), turn(2.5)], seed=31)


@pytest.fixture
def run_live():
    """Starts the command as a user does; it is ended at the end at the latest."""
    started = []

    def start(*arguments, **options):
        command = [sys.executable, "-c", PROGRAM, "spin", "--live"]
        streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
        process = subprocess.Popen([*command, *map(str, arguments)], text=True, **streams)
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.wait()
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()


def wait_for(stream, words):
    """Reads lines until one holds these words; returns it."""
    for line in stream:
        if words in line:
            return line
    raise AssertionError(f"{words!r} was never said")


def refused(process):
    """The one line with which the command gives up; code 2."""
    _, errors = process.communicate()
    assert process.returncode == 2
    assert "Traceback" not in errors
    lines = [line for line in errors.splitlines() if line.startswith("tumble: error: ")]
    assert len(lines) == 1
    return lines[0]


def near(path, session):
    """Returns whether a calibration file holds the biases of the robot, within its own uncertainty."""
    calibration = Calibration.load(path)
    errors = [
        (calibration.accelerometer.b - session.robot.accelerometer_bias, calibration.accelerometer.sigma),
        (calibration.gyroscope.b - session.robot.gyroscope_bias, calibration.gyroscope.sigma),
    ]
    return all((np.abs(error) < 4.0 * sigma.bias).all() for error, sigma in errors)


def test_robot_on_a_serial_line_is_instructed_and_calibrated(run_live, session, tmp_path):
    with serial_device() as device:
        process = run_live(f"serial:{device.path}?baud=921600", "-o", tmp_path / "results")
        assert "stand still for 5 s" in wait_for(process.stderr, "Listening")
        device.write(text_lines(session.table, header=HEADER))
        assert "turn on the spot, either way, at about 1 rad/s" in wait_for(process.stderr, "Now")
        out, errors = process.communicate()
    assert process.returncode == 0
    name = os.path.basename(device.path)  # noqa: PTH119 - of a path that is gone
    path = tmp_path / "results" / f"{name}.live.yaml"
    assert errors == "Done.\n"
    assert str(path) in out
    assert "gyroscope bias x" in out
    assert near(path, session)


def of_two_units(session):
    """Lines of two robots on one line: the left one is the session's, the right one upside down."""
    lines = []
    for row in session.table.tolist():
        turned = [row[0], row[1], -row[2], -row[3], *row[4:]]
        lines += [
            f"{name}: {','.join(map(repr, each))}\n" for name, each in (("left", row), ("right", turned))
        ]
    return f"left: {HEADER}\nright: {HEADER}\n" + "".join(lines)


def test_one_of_two_robots_that_are_piped_in_is_calibrated(run_live, session, tmp_path):
    process = run_live("-:left", "-o", tmp_path, stdin=subprocess.PIPE)
    out, errors = process.communicate(of_two_units(session))
    assert process.returncode == 0, errors
    assert near(tmp_path / "stdin-left.live.yaml", session)
    assert "the line also carries right" in out + errors


def test_units_on_a_line_are_listed_where_none_is_selected(run_live, session, tmp_path):
    process = run_live("-", "-o", tmp_path, stdin=subprocess.PIPE)
    process.stdin.write(of_two_units(session)[:20_000])
    assert "-: holds 2 IMUs: name one, as -:left (found: left, right)" in refused(process)
    assert not list(tmp_path.glob("*.yaml"))


def replayed(log, *arguments):
    """Runs the command in this process on a log, which comes to its end by itself."""
    return typed("spin", "--live", f"replay:{log}?speed=max", *arguments)


def test_a_simulated_robot_can_be_tried_as_the_page_says(tmp_path):
    simulated = tmp_path / "simulated"
    assert typed("simulate", "spin", "-o", simulated).code == 0
    done = replayed(simulated / "spin.csv", "-o", tmp_path)
    assert done.code == 0
    assert done.err.endswith("Done.\n")
    live, truth = (
        yaml.safe_load(p.read_text()) for p in (tmp_path / "spin.live.yaml", simulated / "truth.yaml")
    )
    for triad, share in (("accelerometer", 0.1), ("gyroscope", 0.02)):
        left = np.array(live[triad]["b"]) - truth[triad]["b"]
        assert np.linalg.norm(left) < share * np.linalg.norm(truth[triad]["b"])


def test_other_options_are_passed_on(session, tmp_path):
    log = session.write(tmp_path / "drive.csv", HEADER)
    options = ("--still", "2s", "--turns", "1", "--turn-rate", "0.8", "--latitude", "48", "--serial", "0815")
    done = replayed(log, "-o", tmp_path, *options)
    assert done.code == 0
    assert "stand still for 2 s" in done.err
    assert "about 0.8 rad/s (46 deg/s), 1 turn." in done.err
    calibration = Calibration.load(tmp_path / "drive.live.yaml")
    options = calibration.method.options
    assert (options["still"], options["turns"], options["turn-rate"]) == (2.0, 1.0, 0.8)
    assert calibration.gravity.value == pytest.approx(9.8086, abs=1e-3)
    assert calibration.serial == "0815"


def test_units_are_stated_as_for_logs(session, tmp_path):
    shown = session.table * np.array([1, *[1 / 9.80665] * 3, *[180 / np.pi] * 3])
    log = tmp_path / "drive.csv"
    log.write_bytes(text_lines(shown))
    assert replayed(log, "-o", tmp_path, "--gyroscope-unit", "deg/s").code == 0
    assert near(tmp_path / "drive.live.yaml", session)


def test_json_is_a_line_for_every_event_and_nothing_else(session, tmp_path):
    done = replayed(session.write(tmp_path / "drive.csv", HEADER), "-o", tmp_path, "--json")
    assert done.err == ""
    lines = [json.loads(line) for line in done.out.splitlines()]
    told = [line["event"] for line in lines if line["event"] != "progress"]
    assert told == ["listening", "still began", "still done", "spin began", "done", "result"]
    progress = [line for line in lines if line["event"] == "progress"]
    assert {"time", "state", "still", "turned", "rate", "at_rest", "pace"} <= progress[0].keys()
    assert lines[-1]["files"]["calibration"] == str(tmp_path / "drive.live.yaml")
    found = lines[-1]["gyroscope_bias"]
    assert np.allclose(found["value"], session.robot.gyroscope_bias, atol=1e-3)


def lines_of(session):
    """Datagrams of ten lines, with the time of their last sample."""
    for first in range(0, len(session.time), 10):
        rows = session.table[first : first + 10]
        yield rows[-1, 0], text_lines(rows, header=HEADER)


def messages_of(session):
    """Datagrams of one HIGHRES_IMU each, with its time."""
    autopilot = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    for row in session.table:
        yield (
            row[0],
            mavlink.MAVLink_highres_imu_message(
                round(1e6 * row[0]), *row[1:], 0, 0, 0, 0, 0, 0, 25.0, 0xFFFF
            ).pack(autopilot),
        )


@pytest.mark.parametrize(
    ("scheme", "datagrams", "name"),
    [("udp://127.0.0.1", lines_of, "udp"), ("mavlink:udpin:127.0.0.1", messages_of, "mavlink")],
)
def test_a_robot_that_sends_datagrams_is_calibrated(run_live, session, tmp_path, scheme, datagrams, name):
    port = free_port()
    process = run_live(f"{scheme}:{port}", "-o", tmp_path, "--json")
    wait_for(process.stdout, '"listening"')
    heard = Heard(process.stdout)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for latest, datagram in datagrams(session):
            if not heard.wait_until(latest - AHEAD):
                break
            sender.sendto(datagram, ("127.0.0.1", port))
    heard.to_the_end()
    assert process.wait() == 0, process.stderr.read()
    assert near(tmp_path / f"{name}-{port}.live.yaml", session)


class Heard:
    """Follows the events of a program, so that no more is sent than it can have read."""

    def __init__(self, stream):
        self._time, self._over = 0.0, False
        self._changed = threading.Condition()
        self._reader = threading.Thread(target=self._follow, args=(stream,), daemon=True)
        self._reader.start()

    def wait_until(self, time):
        """Waits until the program has read up to a time, s; false if it is done."""
        with self._changed:
            self._changed.wait_for(lambda: self._over or self._time >= time)
            return not self._over

    def to_the_end(self):
        self._reader.join()

    def _follow(self, stream):
        for line in stream:
            event = json.loads(line)
            with self._changed:
                self._time = event.get("time") or self._time
                self._over = event["event"] == "done"
                self._changed.notify()
            if self._over:
                break
        with self._changed:
            self._over = True
            self._changed.notify()


@pytest.fixture
def earlier(tmp_path):
    """A folder with the calibration file of an earlier run, for a replayed log of the same name."""
    folder = tmp_path / "results"
    folder.mkdir()
    (folder / "drive.live.yaml").write_text(OLD)
    return folder


def untouched(folder, name="drive.live.yaml"):
    """Returns whether the folder holds the old file and nothing else but received samples."""
    others = {path.name for path in folder.iterdir()} - {"session"}
    return others == {name} and (folder / name).read_text() == OLD


def test_a_failed_run_says_why_and_leaves_the_old_calibration(run_live, session, tmp_path, earlier):
    log = session.part(12.0).write(tmp_path / "drive.csv", HEADER)
    line = refused(run_live(f"replay:{log}?speed=max", "-o", earlier))
    assert line.startswith("tumble: error: drive: samples stopped at 12.0 s")
    assert untouched(earlier)


def test_a_failure_is_the_last_event_in_json(run_live, session, tmp_path, earlier):
    log = session.part(12.0).write(tmp_path / "drive.csv", HEADER)
    process = run_live(f"replay:{log}?speed=max", "-o", earlier, "--json")
    out, errors = process.communicate()
    assert process.returncode == 2
    last = json.loads(out.splitlines()[-1])
    assert last["event"] == "failed"
    assert errors == f"tumble: error: {last['reason']}\n"
    assert untouched(earlier)


def test_an_unplugged_device_leaves_the_old_calibration(run_live, session, tmp_path):
    with serial_device() as device:
        name = os.path.basename(device.path)  # noqa: PTH119
        (tmp_path / f"{name}.live.yaml").write_text(OLD)
        process = run_live(f"serial:{device.path}", "-o", tmp_path)
        wait_for(process.stderr, "Listening")
        device.write(text_lines(session.part(9.0).table, header=HEADER))
        wait_for(process.stderr, "Now turn")
        device.unplug()
        assert "was the device unplugged" in refused(process)
    assert untouched(tmp_path, f"{name}.live.yaml")


def test_a_device_that_falls_silent_leaves_the_old_calibration(run_live, session, tmp_path):
    with serial_device() as device:
        name = os.path.basename(device.path)  # noqa: PTH119
        (tmp_path / f"{name}.live.yaml").write_text(OLD)
        process = run_live(f"serial:{device.path}", "-o", tmp_path)
        wait_for(process.stderr, "Listening")
        device.write(text_lines(session.part(9.0).table, header=HEADER))
        assert "samples stopped at 9.0 s" in refused(process)
    assert untouched(tmp_path, f"{name}.live.yaml")


def test_control_c_ends_it_without_a_trace(run_live, session, tmp_path):
    with serial_device() as device:
        name = os.path.basename(device.path)  # noqa: PTH119
        (tmp_path / f"{name}.live.yaml").write_text(OLD)
        process = run_live(f"serial:{device.path}", "-o", tmp_path)
        wait_for(process.stderr, "Listening")
        device.write(text_lines(session.part(9.0).table, header=HEADER))
        wait_for(process.stderr, "Now turn")
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate()
    assert process.returncode == 130
    kept = f"tumble: interrupted; what was received is in {tmp_path / 'session'}\n"
    assert (out, errors) == ("", kept)
    assert untouched(tmp_path, f"{name}.live.yaml")


def test_unwritable_folder_is_refused_before_the_robot_moves(run_live, session, tmp_path):
    log = session.write(tmp_path / "drive.csv", HEADER)
    process = run_live(f"replay:{log}", "-o", log)
    assert "cannot write in this output folder" in refused(process)


@pytest.mark.parametrize(("rate", "hint"), [(0.3, "turn faster"), (2.2, "turn more slowly")])
def test_a_terminal_shows_how_far_it_is_and_whether_the_pace_is_right(run_live, tmp_path, rate, hint):
    session = record([still(6.0), turn(2.5, rate=rate)], seed=32)
    log = session.write(tmp_path / "drive.csv", HEADER)
    ours, theirs = pty.openpty()
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "120"}
    process = run_live(f"replay:{log}?speed=max", "-o", tmp_path, stderr=theirs, env=environment)
    os.close(theirs)
    shown = b""
    while piece := _read(ours):
        shown += piece
    process.communicate()
    text = shown.decode(errors="replace")
    assert process.returncode == 0
    for words in ("stand still", "of 5 s", "of 720 deg", "rad/s", hint, "Done."):
        assert words in text


def _read(terminal):
    """Text written to a terminal; empty once its last writer has gone."""
    try:
        return os.read(terminal, 4096)
    except OSError:
        return b""
