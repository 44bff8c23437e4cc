"""Whatever befalls a line, a live procedure ends in words, finds nothing wrong, and what it left is read."""

from __future__ import annotations

import json
import signal
import socket

import numpy as np
import pytest
import yaml

from killed_commands import killed_on_bench
from live_benches import simulated_bench, words_of
from live_fixtures import resting, text_lines
from repetitions import SOAK
from simulated_clock import BEGINS
from tumble.calibration.document import Calibration
from tumble.foundation import clock
from tumble.foundation.errors import OutputError
from tumble.logs import open_recording
from tumble.logs.session import Session
from tumble.tools.record.parts import UnitParts
from tumble.tools.simulate import LiveFault
from tumble.tools.simulate.live.scenario import LiveScenario
from turntable_sessions import typed

DRAWS = 50 if SOAK else 1
KILLS = 34 if SOAK else 1
"""Number of kills of each command."""
ROBOT = {"motion": "spin", "grades": ("tactical",), "rate_hz": 100.0}
FLYING = {"motion": "flight", "grades": ("industrial", "consumer", "consumer"), "rate_hz": 100.0}
KINDS = ("unplugged", "garbled", "restart", "frozen", "gap", "late", "clock-jump", "time-backwards")
TOLERATED = 6.0
"""Sigmas."""
LOST = 2.0
"""s that a kill may cost."""


def drawn(rng, kind, last):
    """A fault of that kind somewhere in a run; garbage is there all the time, at 1 % of bytes."""
    start = 0.0 if kind == "garbled" else float(rng.uniform(0.0, last))
    lasts = last if kind == "garbled" else float(rng.uniform(0.3, 5.0))
    return LiveFault(kind, start=start, end=start + lasts)


def ended_in_words(done):
    """Returns whether it ended well; asserts that otherwise it ended in one line with the reason."""
    assert "Traceback" not in done.err + done.out, done.err
    assert done.code in (0, 2, 3), done.err
    errors = [line for line in done.err.splitlines() if line.startswith("tumble: error:")]
    assert len(errors) == (done.code == 2), done.err
    return done.code == 0


def samples_in(session):
    """(n, 7) of each unit that was recorded: all that can be read of it, in order of time."""
    found = {}
    for unit in Session.load(session).units:
        if unit.samples == 0:
            continue
        chunks = list(open_recording(f"{session}:{unit.name}", keep_faults=True).chunks())
        found[unit.name] = np.concatenate(
            [np.column_stack([each.time, each.accelerometer]) for each in chunks]
        )
        assert np.isfinite(found[unit.name][:, 0]).all()
        assert (np.diff(found[unit.name][:, 0]) > 0.0).all()
        if unit.samples is not None:
            assert len(found[unit.name]) == unit.samples
    return found


@pytest.mark.parametrize("draw", range(DRAWS))
@pytest.mark.parametrize("kind", KINDS if SOAK else ["garbled"])
def test_disturbed_spin_ends_with_a_message_or_finds_the_truth(tmp_path, kind, draw):
    seed = 100 * draw + KINDS.index(kind)
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    faults = {"imu": [drawn(rng, kind, 30.0)]}
    transport = str(rng.choice(["tcp", "pty", "udp"]))
    with simulated_bench(
        seed=seed, **ROBOT, transport=transport, rest_seconds=12.0, faults=faults, folder=tmp_path
    ) as robot:
        done = typed(
            *("spin", "--live", robot.addresses["imu"], "--turns", "2", "--record", tmp_path / "session"),
            *("-o", tmp_path / "out"),
        )
    if ended_in_words(done):
        (path,) = (tmp_path / "out").glob("*.live.yaml")
        found = Calibration.load(path)
        for triad in ("accelerometer", "gyroscope"):
            section = getattr(found, triad)
            off = np.abs(section.b - robot.truth[f"{triad}_bias"]) / section.sigma.bias
            assert np.nanmax(off) < TOLERATED, f"{triad}: {off} sigmas: {faults}"
    if (tmp_path / "session" / "session.yaml").exists():
        samples_in(tmp_path / "session")


@pytest.mark.parametrize("draw", range(DRAWS))
@pytest.mark.parametrize("kind", KINDS if SOAK else ["unplugged"])
def test_disturbed_recording_goes_on_and_is_readable(tmp_path, kind, draw):
    seed = 100 * draw + KINDS.index(kind)
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    names = ("reference", "target_1", "target_2")
    faults = {str(rng.choice(names)): [drawn(rng, kind, 20.0)]}
    transport = str(rng.choice(["tcp", "pty", "udp"]))
    with simulated_bench(
        seed=seed, motion="six-faces", transport=transport, rate_hz=100.0, faults=faults, folder=tmp_path
    ) as bench:
        done = typed("record", *words_of(bench), "-o", tmp_path / "session", "--duration", "24s")
    assert ended_in_words(done), done.err
    found = samples_in(tmp_path / "session")
    assert set(found) == set(names)
    sound = [len(found[name]) for name in set(names) - set(faults)]
    assert min(sound) > 0.8 * max(sound) > 0.0


@pytest.mark.parametrize("draw", range(DRAWS))
@pytest.mark.parametrize("kind", KINDS if SOAK else ["clock-jump"])
def test_disturbed_live_corrections_are_right_or_reported(tmp_path, kind, draw):
    seed = 100 * draw + KINDS.index(kind)
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    transport = str(rng.choice(["tcp", "pty", "udp"]))
    faults = {"imu": [drawn(rng, kind, 20.0)]}
    out = tmp_path / "out.csv"
    with simulated_bench(
        seed=seed, **ROBOT, transport=transport, rest_seconds=60.0, faults=faults, folder=tmp_path
    ) as robot:
        biases = {triad: robot.truth[f"{triad}_bias"] for triad in ("accelerometer", "gyroscope")}
        calibration = {triad: {"M": np.eye(3), "b": bias} for triad, bias in biases.items()}
        Calibration.model_validate({"name": "imu", **calibration}).save(tmp_path / "imu.yaml")
        words = ("apply", "--live", tmp_path / "imu.yaml", robot.addresses["imu"], "--to", out)
        stopper = robot.clock.interrupt_later(32.0, signal.SIGTERM)
        done = typed(*words)
        clock.wait(stopper)
    ended_in_words(done)
    if out.exists():
        rows = np.concatenate(
            [
                np.column_stack([each.time, np.linalg.norm(each.accelerometer, axis=1)])
                for each in open_recording(out).chunks()
            ]
        )
        assert (np.diff(rows[:, 0]) > 0.0).all()
        # It rests: a corrupted number here and there looks like any other.
        assert abs(np.median(rows[:, 1]) - 9.8) < 0.1


def mounted(bench, path):
    """Prior knowledge of the units of a flight."""
    units = {
        name: {"sensor_from_primary": unit["nominal_mounting"], "lever_arm": unit["lever_arm"]}
        for name, unit in bench.truth["units"].items()
        if name != "primary"
    }
    path.write_text(yaml.safe_dump({"schema": "tumble-redundancy/1", "units": units}))
    return path


SET = ("primary", "secondary_1", "secondary_2")
SECONDS = 96.0 if SOAK else 48.0
"""For which a set is watched."""
FLIGHT = ("--set", "collect=15", "--set", "evaluate_every=3", "--set", "late=2")


def fly_with(tmp_path, seed, faults):
    """Watches a simulated flight; returns how it ended, and its truth."""
    with simulated_bench(seed=seed, **FLYING, faults=faults) as flight:
        known = mounted(flight, tmp_path / "units.yaml")
        true_calibration(flight.truth, "primary").save(tmp_path / "primary.yaml")
        done = typed(
            *(
                "redundancy",
                "--live",
                *words_of(flight),
                "--settings",
                known,
                *FLIGHT,
                "--store",
                tmp_path / "store",
            ),
            *("--calibration", tmp_path / "primary.yaml", "--record", tmp_path / "session"),
            *("-o", tmp_path / "out", "--duration", f"{SECONDS}s", "--json"),
        )
    return done, flight.truth


def true_calibration(truth, name):
    """Errors of a unit at the end of a flight."""
    unit = truth["units"][name]
    triads = {
        triad: {
            "M": unit[triad]["M"],
            "b": [a + b for a, b in zip(unit[triad]["b"], unit[triad]["drift"], strict=True)],
        }
        for triad in ("accelerometer", "gyroscope")
    }
    return Calibration.model_validate({"name": name, **triads})


WARMING = {"accelerometer": 0.05, "gyroscope": 0.01}
"""m/s^2 and rad/s by which biases drift while they warm up, beside what sigmas cover."""


def refuse_wrong(errors, truth):
    """Compares stored errors of secondaries with the truth."""
    for error in errors:
        unit, primary = (
            getattr(true_calibration(truth, name), error["sensor"]) for name in (error["unit"], "primary")
        )
        matrix = unit.M @ np.linalg.inv(primary.M)
        bias = unit.b - matrix @ primary.b
        shown = [np.array(error[name], dtype=float) for name in ("matrix_sigma", "bias_sigma")]
        matrix_sigma, bias_sigma = (np.where(np.isnan(sigma), np.inf, sigma) for sigma in shown)
        assert (np.abs(error["matrix"] - matrix) < TOLERATED * matrix_sigma + 0.002).all(), error
        allowed = TOLERATED * bias_sigma + WARMING[error["sensor"]]
        assert (np.abs(error["bias"] - bias) < allowed).all(), error


@pytest.mark.parametrize("draw", range(DRAWS))
@pytest.mark.parametrize("kind", KINDS if SOAK else ["restart"])
def test_disturbed_set_is_monitored_on_and_adopts_nothing_wrong(tmp_path, kind, draw):
    seed = 100 * draw + KINDS.index(kind)
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    done, truth = fly_with(tmp_path, seed, {str(rng.choice(SET)): [drawn(rng, kind, 70.0)]})
    ended_in_words(done)
    assert done.code in (0, 3), done.err
    errors = json.loads(done.out.splitlines()[-1])["errors"]
    print(f"{len(errors)} adopted")
    refuse_wrong(errors, truth)
    samples_in(tmp_path / "session")
    again = typed(
        *("redundancy", tmp_path / "session", "--settings", tmp_path / "units.yaml", *FLIGHT),
        *(
            "--calibration",
            tmp_path / "primary.yaml",
            "--store",
            tmp_path / "store",
            "-o",
            tmp_path / "again",
        ),
    )
    assert again.code in (0, 3), again.err


KILLED = {
    "record": lambda folder: ("record", "{units}", "-o", folder / "session"),
    "redundancy": lambda folder: (
        *("redundancy", "--live", "{units}", "--settings", folder / "units.yaml", *FLIGHT),
        *("--record", folder / "session", "--store", folder / "store", "-o", folder / "out"),
    ),
    "spin": lambda folder: ("spin", "--live", "{unit}", "--record", folder / "session", "-o", folder / "out"),
}


@pytest.mark.parametrize("draw", range(KILLS))
@pytest.mark.parametrize("command", KILLED)
def test_killed_commands_leave_a_readable_recording_and_store(tmp_path, command, draw):
    seed = 10 * draw + list(KILLED).index(command)
    rng = np.random.default_rng(seed)
    motion = {**ROBOT, "rest_seconds": 8.0} if command == "spin" else FLYING
    if command == "redundancy":
        with simulated_bench(seed=seed, **motion) as bench:
            mounted(bench, tmp_path / "units.yaml")
    session, after, operations = tmp_path / "session", rng.uniform(3.0, 24.0), int(rng.integers(0, 30))
    print(f"seed {seed}: killed after {after:.2f} s and {operations} operations")
    killed = killed_on_bench(KILLED[command](tmp_path), after, operations, seed=seed, work=0.1, **motion)
    found = samples_in(session)
    assert len(found) == len(motion["grades"])
    # A spin is recorded by the clock of its sensor.
    latest = LiveScenario().uptime + killed - BEGINS if command == "spin" else killed
    assert min(rows[-1, 0] for rows in found.values()) > latest - LOST
    if command == "redundancy":
        again = typed(
            *("redundancy", tmp_path / "session", "--settings", tmp_path / "units.yaml", *FLIGHT),
            *("--store", tmp_path / "store", "-o", tmp_path / "again"),
        )
        assert again.code in (0, 3), again.err
        assert "rejected" not in again.out


COMMANDS = {
    "record": lambda words, folder: ("record", *words, "-o", folder / "session"),
    "spin": lambda words, folder: (
        *("spin", "--live", words[0].partition("=")[2], "--record", folder / "session"),
        *("-o", folder / "out"),
    ),
    "redundancy": lambda words, folder: (
        *("redundancy", "--live", *words, "--primary", "a", "--record", folder / "session"),
        *("-o", folder / "out"),
    ),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_full_disk_is_one_line_and_recorded_samples_are_readable(
    tmp_path, command, monkeypatch, simulated_clock
):
    original, written = UnitParts.write, []

    def write(self, chunk):
        # However much a busy computer reads at once: there is room for the first of it, and not for all.
        if written and len(chunk) + sum(samples for _, samples in written) > 300:
            raise OutputError("session/a.parts/000002.parquet: cannot be written: No space left on device")
        written.append((self.name, len(chunk)))
        original(self, chunk)

    monkeypatch.setattr(UnitParts, "write", write)
    monkeypatch.setattr("tumble.tools.record.writer.FLUSH_EVERY", 0.1)
    words = []
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_bytes(text_lines(resting(400, seed=len(words))))
        words.append(f"{name}=replay:{tmp_path / name}.csv")
    done = typed(*COMMANDS[command](words, tmp_path))
    assert done.code == 2
    assert not ended_in_words(done)
    assert "No space left on device; what was recorded is readable" in done.err
    found = samples_in(tmp_path / "session")
    assert found
    for name, rows in found.items():
        assert len(rows) == sum(samples for each, samples in written if each == name)


@pytest.mark.parametrize("command", COMMANDS)
def test_two_programs_on_one_port_are_one_line_and_leave_nothing(tmp_path, command):
    with socket.socket(type=socket.SOCK_DGRAM) as first:
        first.bind(("127.0.0.1", 0))
        port = first.getsockname()[1]
        words = [f"a=udp://:{port}", f"b=tcp://127.0.0.1:{port}"]
        done = typed(*COMMANDS[command](words, tmp_path))
    assert done.code == 2
    assert not ended_in_words(done)
    assert "is another program listening?" in done.err
    assert list(tmp_path.iterdir()) == []
