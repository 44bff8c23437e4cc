"""`tumble apply --live`: what comes goes on, corrected as a log would be, and refused where one would be."""

from __future__ import annotations

import json
import signal
import socket

import numpy as np
import pytest

from live_fixtures import resting, text_lines
from ports import free_ports
from tumble.calibration.document import Calibration
from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.live import LiveChunk
from tumble.live.outputs import parse_output
from tumble.logs import open_recording
from tumble.tools.apply.live import LiveApply
from turntable_sessions import typed

TABLE = resting(200)


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    """A log with a serial number, and a calibration of its unit."""
    folder = tmp_path_factory.mktemp("unit")
    assert typed("simulate", "turntable", "--seed", "3", "-o", folder).code == 0
    logs = (folder / "reference.csv", folder / "target_1.csv")
    done = typed("turntable", *logs, "--g-sensitivity", "-o", folder)
    assert done.code == 0, done.err
    return folder


def refused(done):
    assert done.code == 2, done.err
    lines = [line for line in done.err.splitlines() if line.startswith("tumble: error: ")]
    assert len(lines) == 1
    return lines[0]


def live(unit, *words, log="target_1.csv"):
    return typed("apply", "--live", unit / "target_1.yaml", f"replay:{unit / log}?speed=max", *words)


def test_a_replayed_log_is_corrected_as_the_log_is(unit, tmp_path):
    done = live(unit, "--to", tmp_path / "live.csv")
    assert done.code == 0, done.err
    assert done.out == ""
    assert typed("apply", unit / "target_1.yaml", unit / "target_1.csv", "-o", tmp_path / "log.csv").code == 0
    assert (tmp_path / "live.csv").read_bytes() == (tmp_path / "log.csv").read_bytes()


def test_standard_output_holds_samples_and_nothing_else(unit):
    done = live(unit, "--to", "stdout", "--json")
    samples = [json.loads(line) for line in done.out.splitlines()]
    assert {tuple(sample)[:7] for sample in samples} == {("time", "ax", "ay", "az", "gx", "gy", "gz")}
    assert f"{len(samples)} samples corrected: stdout" in done.err


def test_source_is_refused_for_the_same_errors_as_a_log(unit, tmp_path):
    assert "is of unit" in refused(live(unit, "--to", tmp_path / "x.csv", log="reference.csv"))
    assert live(unit, "--to", tmp_path / "once.csv").code == 0
    again = ("apply", "--live", unit / "target_1.yaml", f"replay:{tmp_path}/once.csv?speed=max")
    assert "was corrected already" in refused(typed(*again, "--to", tmp_path / "x.csv"))
    assert not (tmp_path / "x.csv").exists()
    forced = typed(*again, "--to", tmp_path / "x.csv", "--force")
    assert forced.code == 0
    assert "tumble: warning: the source was corrected already" in forced.err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--live",), "--live needs --to"),
        (("--to", "stdout"), "give --live SOURCE"),
        (("--live", "--to", "stdout", "-o", "x.csv"), "-o and --format are for logs"),
        (("--live", "--to", "nowhere"), "give stdout, udp://HOST:PORT"),
    ],
)
def test_options_that_do_not_go_together_are_refused(unit, words, says):
    assert says in refused(typed("apply", unit / "target_1.yaml", f"replay:{unit}/target_1.csv", *words))


def test_incoming_samples_are_corrected_until_the_stop(unit, simulated_clock):
    calibration = Calibration.load(unit / "target_1.yaml")
    came, goes = free_ports(2)
    found = []

    def send():
        clock.sleep(1.0)
        for sample in text_lines(TABLE, header="time,ax,ay,az,gx_rad/s,gy_rad/s,gz_rad/s").splitlines():
            line.sendto(sample, ("127.0.0.1", came))
        while len(found) < len(TABLE):
            assert clock.readable(line.fileno(), 20.0)
            found.extend(json.loads(text) for text in line.recv(1 << 16).splitlines())
        simulated_clock.interrupt(signal.SIGTERM)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("127.0.0.1", goes))
        sender = clock.thread(send)
        sender.start()
        words = ("apply", "--live", unit / "target_1.yaml", f"udp://127.0.0.1:{came}")
        done = typed(*words, "--to", f"udp://127.0.0.1:{goes}")
        clock.wait(sender)
    assert done.code == 0, done.err
    force, _ = calibration.correct(TABLE[:, 1:4], TABLE[:, 4:])
    assert np.array_equal([[each["ax"], each["ay"], each["az"]] for each in found], force)
    assert "200 samples corrected" in done.err


class BusySource:
    """A source that a busy computer reads 4 ms after its samples came."""

    name = "slow"
    clock = serial = ""
    already_corrected = None
    remarks = ()

    def __iter__(self):
        for part in np.array_split(TABLE, 4):
            came = clock.now()
            clock.sleep(0.004)
            yield LiveChunk(part[:, 0], part[:, 1:4], part[:, 4:], arrival=came)


def test_time_from_arrival_to_output_is_measured(unit, tmp_path, simulated_clock):
    output = parse_output(str(tmp_path / "kept.csv"))
    applied = LiveApply(Calibration.load(unit / "target_1.yaml"), BusySource(), output).run()
    assert applied.delays.largest == pytest.approx(0.004)


class LostSource:
    """A source that is lost after some samples."""

    name = "usb"
    clock = serial = ""
    already_corrected = None
    remarks = ()

    def __iter__(self):
        for part in np.array_split(TABLE, 4):
            yield LiveChunk(part[:, 0], part[:, 1:4], part[:, 4:], arrival=0.0)
        raise LogError("usb: is gone; plug it in again")


def test_samples_before_the_loss_of_a_source_are_kept(unit, tmp_path):
    calibration = Calibration.load(unit / "target_1.yaml")
    output = parse_output(str(tmp_path / "kept.csv"))
    with pytest.raises(LogError, match="is gone; plug it in again; 200 samples before that corrected: "):
        LiveApply(calibration, LostSource(), output).run()
    (kept,) = open_recording(tmp_path / "kept.csv").chunks()
    assert np.allclose(kept.accelerometer, calibration.correct(TABLE[:, 1:4])[0], rtol=1e-12)
