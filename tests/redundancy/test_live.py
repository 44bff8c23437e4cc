"""`tumble redundancy --live`, and the monitor as a program drives it."""

from __future__ import annotations

import io
import json
import signal
import socket
import subprocess
import sys
import threading
from contextlib import contextmanager

import numpy as np
import pytest
from rich.console import Console

import tumble
from patience import PATIENCE
from ports import free_port
from redundancy_sets import BIASED, PRIMARY, QUICK, SOUND, motion, record
from repetitions import drawn_seed
from simulated_clock import SimulatedClock
from tumble import Chunk, RedundancyMonitor
from tumble.foundation import clock
from tumble.foundation.errors import LogError, ProcedureError
from tumble.live import LiveChunk, LiveSet, open_set
from tumble.procedures.redundancy import live as live_module
from tumble.procedures.redundancy.command_dashboard import Dashboard
from tumble.procedures.redundancy.live import LiveRedundancy, SetState, UnitRate
from tumble.procedures.redundancy.monitor import SILENCE
from tumble.procedures.redundancy.result import RedundancyEvent
from tumble.tools.record.writer import RecordedUnit, SessionWriter
from tumble.tools.simulate.live.outlet import UdpOutlet
from turntable_sessions import contents, one_line, typed

NAMES = ("imu1", "imu2", "imu3")
SETTINGS = {"collect": 20.0, "collect_timeout": 60.0, "evaluate_every": 5.0}
PATIENT = ("--set", "late=0.4")
"""Where a busy computer is late itself."""
HEADER = b"time,ax,ay,az,gx_rad/s,gy_rad/s,gz_rad/s\n"


@pytest.fixture(scope="module")
def said():
    return record([PRIMARY, BIASED, SOUND], 11, motion())


@pytest.fixture(scope="module")
def words(said, tmp_path_factory):
    """Units as they are typed: their logs, replayed as fast as they can be read."""
    folder = tmp_path_factory.mktemp("logs")
    return [f"{name}=replay:{unit.write(folder / f'{name}.csv')}?speed=max" for name, unit in said.items()]


def watched(*arguments):
    """Runs `tumble redundancy --live` as typed; returns how it ended, events and the result."""
    done = typed("redundancy", "--live", *arguments, "--json")
    assert done.code in (0, 3), f"exit code {done.code}: {done.err}"
    listening, *events, result = map(json.loads, done.out.splitlines())
    assert listening["event"] == "listening"
    assert result["event"] == "result"
    return done.code, events, result


def refusal(*arguments):
    done = typed("redundancy", *arguments)
    assert done.code == 2, f"exit code {done.code}: {done.out}{done.err}"
    return one_line(done.err)


def chunk_of(unit, part):
    return Chunk(unit.time[part], unit.readings[part, :3].copy(), unit.readings[part, 3:].copy())


def test_recorded_live_run_replays_to_the_same_events_and_store(words, tmp_path, simulated_clock):
    code, events, result = watched(
        *words, "--primary", "imu1", *QUICK, "-o", tmp_path / "live", "--store", tmp_path / "store",
        "--record", tmp_path / "session",
    )  # fmt: skip
    assert code == 0, result
    assert {error["unit"] for error in result["errors"]} == {"imu2"}
    again = typed(
        "redundancy", tmp_path / "session", "--primary", "imu1", *QUICK, "-o", tmp_path / "again",
        "--store", tmp_path / "store_again", "--json",
    )  # fmt: skip
    assert again.code == 0, again.err
    replayed = json.loads(again.out)
    assert replayed["errors"] == result["errors"]
    assert replayed["selected"] == result["selected"]
    lines = (tmp_path / "again/events.jsonl").read_text(encoding="utf-8").splitlines()
    assert list(map(json.loads, lines)) == events
    assert contents(tmp_path / "store") == contents(tmp_path / "store_again")
    assert contents(tmp_path / "store")


class Board:
    """Units that send over UDP, from a thread, at times that chance decides."""

    def __init__(self, seed):
        self._random = np.random.default_rng(seed)
        self.ports = {name: free_port() for name in NAMES}
        self.words = [f"{name}=udp://127.0.0.1:{port}" for name, port in self.ports.items()]
        self.ended = threading.Event()
        self._clock = SimulatedClock(seed, late=0.001)

    @contextmanager
    def sending(self, spans):
        """Sends while the block runs, by a simulated clock."""
        with self._clock:
            sender = clock.thread(self.send, spans)
            sender.start()
            try:
                yield
            finally:
                self.ended.set()
                clock.wait(sender)

    def send(self, spans):
        """Sends from each unit, 100 Hz, in spans of s, by clocks of their own, a few samples at a time."""
        booted = dict(zip(NAMES, (10.0, 500.0, 7000.0), strict=True))
        for port in self.ports.values():
            self._await_listener(port)
        began, line = clock.now(), socket.socket(type=socket.SOCK_DGRAM)
        told = dict.fromkeys(NAMES, 0.0)
        last = max(end for each in spans.values() for _, end in each)
        with line:
            while not self.ended.is_set() and min(told.values()) < last:
                clock.sleep(0.003)
                name = str(self._random.choice(NAMES))
                now = clock.now() - began
                while told[name] <= now:
                    at = told[name]
                    told[name] += 0.01
                    if not any(start <= at < end for start, end in spans[name]):
                        continue
                    reading = self._random.normal((0.0, 0.0, 9.80665, 0.0, 0.0, 0.0), 0.01)
                    row = ",".join(map(repr, [booted[name] + at, *reading.tolist()]))
                    line.sendto(HEADER + row.encode(), ("127.0.0.1", self.ports[name]))

    def _await_listener(self, port):
        # To try whether the port is free would take it from who is about to listen there.
        line = UdpOutlet("127.0.0.1", port)
        while not line.is_heard() and not self.ended.is_set():
            clock.sleep(0.01)
        line.unplug()


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    """A board whose primary stops, and later all; watched and recorded over sockets, its output in a file."""
    folder = tmp_path_factory.mktemp("served")
    board = Board(drawn_seed())
    others = ((0.0, 2.5), (4.2, 5.0))
    spans = {"imu1": ((0.0, 1.5),), "imu2": others, "imu3": others}
    with board.sending(spans):
        code, events, result = watched(
            *board.words, "--primary", "imu1", "-o", folder / "live", "--record", folder / "session",
            "--to", folder / "out.csv", "--duration", "5.5s", *PATIENT,
        )  # fmt: skip
    return folder, code, events, result


def of(events, word):
    return [event for event in events if event["event"] == word]


def test_a_secondary_takes_over_as_soon_as_the_primary_is_silent(served):
    _, code, events, _ = served
    assert code == 3
    reasons = {event["figures"]["reason"]: event["unit"] for event in of(events, "selected")}
    assert reasons["start"] == "imu1"
    assert reasons["primary failed"] in ("imu2", "imu3")


def test_the_silence_of_all_units_is_an_event_and_a_known_fault(served):
    _, _, events, result = served
    silences = of(events, "no samples")
    assert len(silences) == 1
    assert silences[0]["time"] == pytest.approx(silences[0]["figures"]["since"] + SILENCE)
    assert any("No unit said anything" in sentence for sentence in result["known_faults"])


def test_samples_over_sockets_replay_in_order_of_arrival(served):
    folder, _, events, result = served
    again = typed(
        "redundancy", folder / "session", "--primary", "imu1", *PATIENT, "-o", folder / "again", "--json"
    )
    assert again.code == 3, again.err
    lines = (folder / "again/events.jsonl").read_text(encoding="utf-8").splitlines()
    assert list(map(json.loads, lines)) == [event for event in events if event["event"] != "lost"]
    assert json.loads(again.out)["selected"] == result["selected"]


def test_set_silent_to_the_end_is_reported_live_and_in_the_replay(tmp_path):
    board = Board(drawn_seed())
    with board.sending(dict.fromkeys(NAMES, ((0.0, 1.0),))):
        _, events, result = watched(
            *board.words, "--primary", "imu1", "-o", tmp_path / "live", "--record", tmp_path / "session",
            "--duration", "4s", *PATIENT,
        )  # fmt: skip
    again = typed(
        "redundancy", tmp_path / "session", "--primary", "imu1", *PATIENT, "-o", tmp_path / "again", "--json"
    )
    lines = (tmp_path / "again/events.jsonl").read_text(encoding="utf-8").splitlines()
    assert events[-1]["event"] == "no samples"
    assert list(map(json.loads, lines)) == events
    replayed = json.loads(again.out)
    assert replayed["selected"] == result["selected"]
    assert replayed["known_faults"] == result["known_faults"]


def test_the_output_goes_where_it_is_sent_to(served):
    folder, _, _, _ = served
    replayed = tumble.redundancy(
        "imu1", ["imu2", "imu3"], log=folder / "session", settings={"late": 0.4}
    ).output
    sent = tumble.open_recording(folder / "out.csv")
    times = np.concatenate([chunk.time for chunk in sent.chunks()])
    assert np.array_equal(times, replayed.time)


def test_session_begins_with_its_primary_whoever_sends_first(tmp_path, said):
    described = {name: RecordedUnit(Scripted([]), "typed") for name in ("imu1", "imu2")}
    with SessionWriter(tmp_path / "session", described, "host") as session:
        for first in range(0, 1000, 10):
            for name, ahead in (("imu2", 0.0), ("imu1", 0.001)):
                chunk = chunk_of(said[name], slice(first, first + 10))
                came = chunk.time[-1] + ahead
                session.take(name, LiveChunk(chunk.time, chunk.accelerometer, chunk.gyroscope, arrival=came))
        session.finish("done")
    result = tumble.redundancy("imu1", "imu2", log=tmp_path / "session")
    assert [(span.unit, span.reason) for span in result.selected] == [("imu1", "start")]


class Scripted:
    """A source that gives these chunks, one a call, and is then at its end, or lost."""

    name, clock, remarks, gyroscope_unit_is_assumed = "scripted", "", (), False

    def __init__(self, chunks, error=None):
        self._chunks, self._error = list(chunks), error

    def __enter__(self):
        return self

    def __exit__(self, *error): ...

    def fileno(self):
        return None

    def read(self):
        if self._chunks:
            return self._chunks.pop(0)
        if self._error:
            raise self._error
        raise EOFError


def resting(start, count=30):
    stamps = start + np.arange(count) / 100
    readings = np.random.default_rng(int(start)).normal((0.0, 0.0, 9.80665, 0.0, 0.0, 0.0), 0.01, (count, 6))
    return LiveChunk(stamps, readings[:, :3].copy(), readings[:, 3:].copy(), arrival=clock.now())


def test_loss_and_return_of_a_source_are_reported_while_others_run(simulated_clock):
    lost = iter([Scripted([resting(5.0)], LogError("unplugged")), Scripted([resting(6.0)])])
    nothing = LiveChunk(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
    other = Scripted([resting(1.0), *[nothing] * 2000, resting(2.0)])
    units = LiveSet({"a": lambda: other, "b": lambda: next(lost)}, keep_going=True)
    watch = LiveRedundancy(units, RedundancyMonitor("a", ["b"]))
    told = [step for step in watch.steps() if isinstance(step, RedundancyEvent)]
    befell = [(step.unit, step.event) for step in told if step.event in ("lost", "returned")]
    assert befell == [("b", "lost"), ("b", "returned")]
    assert any("unplugged" in warning for warning in watch.result().warnings)


def test_unit_that_never_sends_is_reported_once(monkeypatch):
    monkeypatch.setattr(live_module, "FIRST_SAMPLE_WITHIN", 0.0)
    monkeypatch.setattr(live_module, "REPORT_EVERY", 0.0)
    monkeypatch.setattr(live_module, "ALL_WITHIN", 0.0)
    nothing = LiveChunk(np.empty(0), np.empty((0, 3)), np.empty((0, 3)))
    units = LiveSet({"a": Scripted([resting(1.0), resting(2.0)]), "b": Scripted([nothing] * 50)})
    watch = LiveRedundancy(units, RedundancyMonitor("a", ["b"]))
    silent = [step for step in watch.steps() if isinstance(step, RedundancyEvent) and step.event == "silent"]
    assert [step.unit for step in silent] == ["b"]
    assert "is the device on" in silent[0].figures["reason"]


def test_a_set_none_of_whose_units_sends_anything_is_refused():
    units = LiveSet({"a": Scripted([]), "b": Scripted([])})
    with pytest.raises(ProcedureError, match="none of these units sent a sample"):
        list(LiveRedundancy(units, RedundancyMonitor("a", ["b"])).steps())


def test_adopted_error_is_stored_before_its_event_is_reported(words, tmp_path):
    monitor = RedundancyMonitor("imu1", ["imu2", "imu3"], settings=SETTINGS, store=tmp_path)
    steps = LiveRedundancy(open_set(words), monitor).steps()
    adopted = next(step for step in steps if isinstance(step, RedundancyEvent) and step.event == "adopted")
    assert (tmp_path / f"{adopted.unit}-{adopted.figures['sensor']}.yaml").exists()
    assert any("of the store" not in notice for notice in monitor.notices())
    steps.close()


def test_sigterm_ends_with_the_summary_and_its_exit_code(words, tmp_path):
    command = "from tumble.cli.main import main; main()"
    slow = [word.replace("speed=max", "speed=1") for word in words]
    arguments = ["redundancy", "--live", *slow, "--primary", "imu1", "-o", tmp_path / "out", "--json"]
    running = subprocess.Popen(
        [sys.executable, "-c", command, *map(str, arguments)],
        stdout=subprocess.PIPE,
        text=True,
    )
    listening, first = (json.loads(running.stdout.readline()) for _ in range(2))
    running.send_signal(signal.SIGTERM)
    out, _ = running.communicate(timeout=PATIENCE)
    assert listening == {"event": "listening", "units": ["imu1", "imu2", "imu3"]}
    assert first["event"] == "selected"
    assert json.loads(out.splitlines()[-1])["event"] == "result"
    # The secondaries have no calibration yet.
    assert running.returncode == 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["primary=carrier:pigeon", "a=udp://:9"], "carrier"),
        (["primary=udp://:9001", "primary=udp://:9002"], "named twice"),
        (["a=udp://:9001", "b=udp://:9002"], "primary: is none of a, b"),
        (["primary=udp://:9001"], "0 secondaries were named"),
        (["primary=udp://:9001", "a=udp://:9002", "--to", "pigeon.txt"], "--to pigeon.txt"),
        (["primary=udp://:9001", "a=udp://:9002", "--to", "stdout", "--json"], "standard output"),
        (["primary=udp://:9001", "a=udp://:9002", "--output-log", "a.csv"], "--output-log is for logs"),
    ],
)
def test_error_is_reported_in_one_line(arguments, message, tmp_path):
    assert message in refusal("--live", *arguments, "-o", tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_options_of_live_sources_are_refused_for_logs():
    assert "--to is for sensors that run" in refusal("flight.csv", "--to", "stdout")


def test_the_store_of_another_set_is_refused(words, tmp_path):
    store = tmp_path / "store"
    serials = ["--set", "units.imu1.serial=A", "--set", "units.imu2.serial=B", "--set", "units.imu3.serial=C"]
    watched(*words, "--primary", "imu1", *QUICK, *serials, "-o", tmp_path / "out", "--store", store)
    before = contents(store)
    others = [*serials[:-1], "units.imu3.serial=C", "--set", "units.imu2.serial=Z"]
    line = refusal("--live", *words, "--primary", "imu1", *others, "-o", tmp_path / "out2", "--store", store)
    assert "with serial B" in line
    assert contents(store) == before


def test_samples_pushed_singly_equal_a_replay_of_the_logs(said):
    recordings = {
        name: tumble.Recording.from_arrays(
            name, unit.time, unit.readings[:, :3], unit.readings[:, 3:], clock="one"
        )
        for name, unit in said.items()
    }
    replayed = tumble.redundancy(recordings["imu1"], list(recordings.values())[1:], settings=SETTINGS)
    monitor = RedundancyMonitor("imu1", ["imu2", "imu3"], settings=SETTINGS)
    events, outputs = [], []
    for place in range(len(said["imu1"].time)):
        for name, unit in said.items():
            events += monitor.push(name, chunk_of(unit, slice(place, place + 1)))
            outputs.append(monitor.output.specific_force)
    assert tuple(events) == replayed.events
    assert np.array_equal(np.concatenate(outputs), replayed.output.specific_force)
    for one, other in zip(monitor.records, replayed.errors, strict=True):
        assert (one.name, one.adopted, one.residual) == (other.name, other.adopted, other.residual)
        assert np.array_equal(one.matrix, other.matrix)
    assert {record.unit for record in monitor.records} == {"imu2"}


def test_command_and_aiding_count_from_the_samples_of_their_time(said):
    monitor = RedundancyMonitor("imu1", ["imu2", "imu3"], settings=SETTINGS)
    monitor.aiding(tumble.Aiding.score("imu2", [1.0], [-1.0]))
    early = monitor.push("imu1", chunk_of(said["imu1"], slice(0, 50)))
    late = monitor.push("imu1", chunk_of(said["imu1"], slice(50, 150)))
    assert [event.event for event in early if "aiding" in event.event] == []
    left_out = [event.figures["reason"] for event in late if event.event == "aiding left out"]
    assert left_out == ["negative score"]
    with pytest.raises(ProcedureError, match="known are 'evaluate'"):
        monitor.command("dance")


def test_a_monitor_says_once_of_each_silence_that_there_is_one(said):
    monitor = RedundancyMonitor("imu1", ["imu2"])
    assert monitor.tick(100.0) == ()
    monitor.push("imu1", chunk_of(said["imu1"], slice(0, 10)))
    assert monitor.tick(0.09 + SILENCE) == ()
    (event,) = monitor.tick(0.2 + SILENCE)
    assert (event.event, event.time) == ("no samples", pytest.approx(0.09 + SILENCE))
    assert monitor.tick(50.0) == ()
    monitor.push("imu1", chunk_of(said["imu1"], slice(500, 510)))
    assert len(monitor.tick(500.0)) == 1


def test_samples_of_no_unit_of_the_set_are_refused(said):
    monitor = RedundancyMonitor("imu1", ["imu2"])
    with pytest.raises(ProcedureError, match="imu9: is none of imu1, imu2"):
        monitor.push("imu9", chunk_of(said["imu1"], slice(0, 10)))


def shown(board):
    console = Console(record=True, width=160, file=io.StringIO())
    console.print(board.rendered())
    return console.export_text()


def test_dashboard_shows_units_deviations_and_source_with_reason():
    board = Dashboard(["front", "rear"])
    assert "no source (no samples yet)" in shown(board)
    board.take(SetState(3.0, 3.0, "front", (UnitRate("front", 300, 100.0), UnitRate("rear", 0, np.nan))))
    board.take(RedundancyEvent(0.0, "front", "selected", {"reason": "start"}))
    figures = {"sensor": "accelerometer", "check": "vector", "deviation": 0.25, "threshold": 0.1}
    board.take(RedundancyEvent(2.6, "rear", "evaluated", {**figures, "exceeded": True}))
    board.take(RedundancyEvent(2.7, "rear", "triggered", {"sensors": "accelerometer"}))
    text = shown(board)
    assert "source front (start)" in text
    front, rear = (line for line in text.splitlines() if line.startswith(("│ front", "│ rear")))
    assert "healthy" in front
    assert "100 Hz" in front
    assert "waiting" in rear
    assert "waiting for motion" in rear
    assert "0.250 of 0.100 m/s²" in rear
    board.take(RedundancyEvent(9.0, "front", "unhealthy", {"reason": "late", "value": 0.2}))
    board.take(RedundancyEvent(9.1, "rear", "selected", {"reason": "primary failed"}))
    text = shown(board)
    assert "source rear (primary failed)" in text
    assert "late" in next(line for line in text.splitlines() if line.startswith("│ front"))


def test_the_dashboard_runs_on_a_command_line(words, tmp_path):
    done = typed("redundancy", "--live", *words, "--primary", "imu1", *QUICK, "-o", tmp_path, "--dashboard")
    assert done.code == 0
    assert "source imu1" in done.err
