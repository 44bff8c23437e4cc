"""Recorded samples equal the received ones: all of them, to the bit, readable whatever happened."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml

from killed_commands import killed_on_bench
from live_benches import simulated_bench, words_of
from live_fixtures import resting, text_lines
from ports import free_port
from repetitions import SOAK
from tumble.live import LiveChunk, open_source
from tumble.live.multi_source import ABREAST
from tumble.logs import Facts, ReadOptions, list_imus, open_recording
from tumble.logs.session import Session, joined_file, parts_folder, unit_files
from tumble.tools.record import parts
from tumble.tools.record.parts import RecordedChunk, UnitParts
from tumble.tools.record.recorded_source import recorded_source
from tumble.tools.simulate import LiveSimulation
from turntable_sessions import typed

TABLE = resting(300)


def samples_of(source):
    """(n, 7) time, specific force and angular rate of a log, times as they were recorded."""
    return np.concatenate(
        [
            np.column_stack([chunk.time, chunk.accelerometer, chunk.gyroscope])
            for chunk in open_recording(str(source), ReadOptions(live_times=True)).chunks()
        ]
    )


def one_line(done):
    assert done.code == 2, done.err
    lines = [line for line in done.err.splitlines() if line.startswith("tumble: error: ")]
    assert len(lines) == 1
    assert "Traceback" not in done.err
    return lines[0]


@pytest.fixture
def logs(tmp_path):
    """Logs of two units, recorded at once at different rates."""
    tables = {"a": TABLE, "b": resting(600, rate=200.0, seed=1)}
    for name, table in tables.items():
        (tmp_path / f"{name}.csv").write_bytes(text_lines(table))
    return tables


def words_for(tmp_path, names=("a", "b")):
    return [f"{name}=replay:{tmp_path / name}.csv?speed=max" for name in names]


def chunk_of(table):
    """Samples as a recorder hands them to the disk."""
    time_, accelerometer, gyroscope = table[:, 0], table[:, 1:4], table[:, 4:]
    return RecordedChunk(time_, accelerometer, gyroscope, None, time_ + 7.0, np.full(len(table), np.nan))


def test_every_sample_of_every_unit_is_recorded_to_the_bit(tmp_path, logs):
    session = tmp_path / "session"
    done = typed("record", *words_for(tmp_path), "-o", session)
    assert done.code == 0, done.err
    assert list_imus(session) == ("a", "b")
    for name, table in logs.items():
        assert np.array_equal(samples_of(f"{session}:{name}"), table)
        assert open_recording(f"{session}:{name}").name == name
    said = yaml.safe_load((session / "session.yaml").read_text())
    assert said["schema"] == "tumble-session/1"
    assert [unit["samples"] for unit in said["units"]] == [300, 600]
    assert said["reason"] == "end of sources"
    assert sorted(path.name for path in session.iterdir()) == ["a.parquet", "b.parquet", "session.yaml"]


def test_units_of_a_session_share_a_clock_and_state_their_units(tmp_path, logs):
    session = tmp_path / "session"
    typed("record", *words_for(tmp_path), "-o", session)
    one, other = (open_recording(f"{session}:{name}").metadata for name in ("a", "b"))
    assert one.clock == other.clock != ""
    assert (one.gyroscope_unit.name, one.gyroscope_unit.reason) == ("rad/s", "head of the file")


def test_the_state_of_the_wheels_is_recorded_and_replayed(tmp_path):
    lines = text_lines(TABLE, header="time,ax,ay,az,gx,gy,gz").decode().splitlines()
    rows = [f"{line},{'moving' if number == 0 else number % 2}" for number, line in enumerate(lines)]
    port = free_port()
    with open_source(f"udp://127.0.0.1:{port}") as source, socket.socket(type=socket.SOCK_DGRAM) as sender:
        for row in rows:
            sender.sendto(row.encode(), ("127.0.0.1", port))
        with recorded_source(source, tmp_path / "session", typed="udp", serial="7") as samples:
            found = 0
            for chunk in samples:
                found += len(chunk)
                if found == len(TABLE):
                    break
    session = Session.load(tmp_path / "session")
    (path,) = unit_files(tmp_path / "session", session.names[0])
    assert pq.read_table(path)["moving"].to_pylist()[:4] == [1.0, 0.0, 1.0, 0.0]
    assert "a replay goes by it" in " ".join(session.units[0].remarks)
    with open_source(f"replay:{tmp_path / 'session'}?speed=max") as replayed:
        moving = np.concatenate([chunk.moving for chunk in replayed])
    assert np.array_equal(moving, pq.read_table(path)["moving"].to_numpy())
    assert session.clock == "sensor"
    assert open_recording(tmp_path / "session").metadata.serial == "7"


def test_a_session_is_not_written_over_and_goes_on_where_asked(tmp_path, logs):
    session = tmp_path / "session"
    typed("record", *words_for(tmp_path), "-o", session)
    before = samples_of(f"{session}:a")
    assert "holds a session already; add to it with --resume" in one_line(
        typed("record", *words_for(tmp_path), "-o", session)
    )
    assert "the same log comes again" in one_line(
        typed("record", *words_for(tmp_path), "-o", session, "--resume")
    )
    assert np.array_equal(samples_of(f"{session}:a"), before)
    for name, table in logs.items():
        (tmp_path / f"{name}.csv").write_bytes(text_lines(table + np.eye(7)[0] * 1000.0))
    done = typed("record", *words_for(tmp_path), "-o", session, "--resume")
    assert done.code == 0, done.err
    assert np.array_equal(samples_of(f"{session}:a"), np.vstack([before, before + np.eye(7)[0] * 1000.0]))
    assert Session.load(session).units[0].samples == 600


def test_a_session_of_other_units_does_not_go_on(tmp_path, logs):
    session = tmp_path / "session"
    typed("record", *words_for(tmp_path), "-o", session)
    refused = one_line(typed("record", *words_for(tmp_path, ["a"]), "-o", session, "--resume"))
    assert "the session is of a and b" in refused
    assert "holds no session" in one_line(
        typed("record", *words_for(tmp_path), "-o", tmp_path / "new", "--resume")
    )


def test_so_many_samples_of_each_unit_are_recorded_and_no_more(tmp_path, logs):
    session = tmp_path / "session"
    done = typed("record", *words_for(tmp_path), "-o", session, "--count", "120")
    assert done.code == 0, done.err
    assert [unit.samples for unit in Session.load(session).units] == [120, 120]
    assert np.array_equal(samples_of(f"{session}:a"), TABLE[:120])


def test_duration_to_record_is_by_the_clock_of_replayed_logs(tmp_path, logs):
    session = tmp_path / "session"
    typed("record", *words_for(tmp_path), "-o", session, "--duration", "1s")
    assert 1.0 - ABREAST <= samples_of(f"{session}:b")[-1, 0] < 1.1
    assert Session.load(session).reason == "duration"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["-o", "s"], "no unit to listen to"),
        (["udp://:9000", "-o", "s"], "names no unit"),
        (["a=udp://:9000"], "give the folder to record into"),
        (["a=canbus:0", "-o", "s"], "nothing reads live from 'canbus'"),
        (["a=serial:/dev/no_such_port", "-o", "s"], "a: serial:/dev/no_such_port"),
        (["a=udp://:9000", "-o", "s", "--duration", "soon"], "--duration soon: give a time above zero"),
        (["--finish", "nowhere"], "no such recorded session"),
        (["a=udp://:9000", "--finish", "s"], "--finish records nothing"),
    ],
)
def test_unrecordable_source_is_refused_in_one_line(tmp_path, monkeypatch, words, says):
    monkeypatch.chdir(tmp_path)
    assert says in one_line(typed("record", *words))


def test_progress_and_the_end_are_events_for_machines(tmp_path, logs):
    done = typed("record", *words_for(tmp_path), "-o", tmp_path / "session", "--json")
    events = [json.loads(line) for line in done.out.splitlines()]
    assert [events[0]["event"], events[-1]["event"]] == ["listening", "done"]
    assert {unit["name"]: unit["samples"] for unit in events[-1]["units"]} == {"a": 300, "b": 600}
    assert events[-1]["units"][0]["condition"] == "rest"
    assert events[-1]["units"][0]["rate"] == pytest.approx(100.0)


def test_parts_are_joined_now_and_then_and_each_sample_counts_once(tmp_path, monkeypatch):
    monkeypatch.setattr(parts, "JOINED", 3)
    unit = UnitParts(tmp_path, "a", Facts())
    for first in range(0, 300, 12):
        unit.write(chunk_of(TABLE[first : first + 12]))
    there = sorted(path.name for path in parts_folder(tmp_path, "a").iterdir())
    assert there == [
        "000001-000009.parquet",
        "000010-000018.parquet",
        "000019-000021.parquet",
        "000022-000024.parquet",
        "000025.parquet",
    ]
    assert np.array_equal(of_files(tmp_path), TABLE)
    unit.finish()
    assert np.array_equal(of_files(tmp_path), TABLE)
    assert joined_file(tmp_path, "a").is_file()


def of_files(folder):
    return np.concatenate([samples_of(path) for path in unit_files(folder, "a")])


@pytest.mark.parametrize("step", ["joined", "finished"])
def test_joining_that_is_broken_off_doubles_nothing(tmp_path, monkeypatch, step):
    monkeypatch.setattr(parts, "JOINED", 3)
    unit = UnitParts(tmp_path, "a", Facts())
    kept = {}
    for first in range(0, 60, 20):
        unit.write(chunk_of(TABLE[first : first + 20]))
        kept |= {path: path.read_bytes() for path in parts_folder(tmp_path, "a").iterdir()}
    if step == "finished":
        unit.finish()
        parts_folder(tmp_path, "a").mkdir()
    for path, content in kept.items():
        path.write_bytes(content)
    assert np.array_equal(of_files(tmp_path), TABLE[:60])
    again = UnitParts(tmp_path, "a", Facts())
    again.write(chunk_of(TABLE[60:70]))
    assert np.array_equal(of_files(tmp_path), TABLE[:70])


def test_sensor_and_arrival_times_are_recorded_beside_the_common_one():
    chunks = [
        LiveChunk(t, np.zeros((2, 3)), np.zeros((2, 3)), arrival=9.5, sensor_time=t - 5.0)
        for t in (np.array([8.0, 9.0]), np.array([10.0, 11.0]))
    ]
    recorded = parts.recorded(chunks, ("temperature",), shift=0.0)
    assert recorded.sensor_time.tolist() == [3.0, 4.0, 5.0, 6.0]
    assert recorded.arrival.tolist() == [9.5] * 4
    assert np.isnan(recorded.temperature).all()


UNITS = {"grades": ("tactical", "tactical"), "motion": "six-faces", "rate_hz": 200.0}
"""Units of a bench that are recorded."""


@pytest.mark.parametrize("late", [0.0, 0.02, 0.3])
def test_a_busy_computer_records_every_sample_and_the_same_each_run(tmp_path, late):
    def recorded(folder):
        with simulated_bench(late=late, **UNITS) as bench:
            done = typed("record", *words_of(bench), "-o", folder, "--duration", "20s")
        assert done.code == 0, done.err
        return {name: pq.read_table(joined_file(folder, name)) for name in Session.load(folder).names}

    once, again = (recorded(tmp_path / name) for name in ("once", "again"))
    for name, table in once.items():
        assert again[name].equals(table)
        stamps = table["sensor_time"].to_numpy()
        assert np.diff(stamps) == pytest.approx(1.0 / UNITS["rate_hz"], rel=1e-2)
        assert stamps[-1] - stamps[0] > 10.0


@pytest.mark.parametrize("draw", range(100 if SOAK else 3))
def test_killed_recorder_loses_two_seconds_at_most_and_stays_readable(tmp_path, draw):
    rng, session = np.random.default_rng(draw), tmp_path / "session"
    print(f"seed {draw}")
    # Between two writings, or in one, the disk being slow.
    after, operations = rng.uniform(3.0, 6.0), int(rng.integers(0, 30))
    killed = killed_on_bench(
        ("record", "{units}", "-o", session), after, operations, work=rng.uniform(0.0, 0.5), **UNITS
    )
    names = Session.load(session).names
    assert len(names) == 2
    done = typed("inspect", f"{session}:{names[0]}")
    assert done.code == 0, done.err
    for name in names:
        found = samples_of(f"{session}:{name}")
        assert killed - found[-1, 0] < 2.0
        assert (np.diff(found[:, 0]) > 0.0).all()
    before = {name: samples_of(f"{session}:{name}") for name in names}
    assert "was killed" in " ".join(open_recording(f"{session}:{names[0]}").metadata.remarks)
    done = typed("record", "--finish", session)
    assert done.code == 0, done.err
    whole = [*(f"{name}.parquet" for name in names), "session.yaml"]
    assert sorted(path.name for path in session.iterdir()) == sorted(whole)
    for name, samples in before.items():
        assert np.array_equal(samples_of(f"{session}:{name}"), samples)
    assert Session.load(session).reason == "killed"


def test_a_recording_that_was_killed_goes_on_after_what_it_left(tmp_path):
    session = tmp_path / "session"
    killed_on_bench(("record", "{units}", "-o", session), 4.0, **UNITS)
    before = {name: samples_of(f"{session}:{name}") for name in Session.load(session).names}
    with simulated_bench(**UNITS, later=10.0) as bench:
        done = typed("record", *words_of(bench), "-o", session, "--resume", "--count", "300")
    assert done.code == 0, done.err
    for unit in Session.load(session).units:
        after = samples_of(f"{session}:{unit.name}")
        assert len(after) == len(before[unit.name]) + 300 == unit.samples
        assert np.array_equal(after[: len(before[unit.name])], before[unit.name])
        assert (np.diff(after[:, 0]) > 0.0).all()


def test_it_ends_well_on_request(tmp_path):
    session = tmp_path / "session"
    with LiveSimulation(**UNITS, port=0) as bench:
        program = [sys.executable, "-c", "from tumble.cli.main import main; main()"]
        process = subprocess.Popen(
            [*program, "record", *words_of(bench), "-o", session, "--json"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        assert any(all(unit["samples"] for unit in json.loads(line)["units"]) for line in process.stdout)
        refused = typed("record", "--finish", session)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate()
    assert process.returncode == 0, err
    assert f"another run (process {process.pid}) writes into this folder" in one_line(refused)
    assert json.loads(out.splitlines()[-1])["event"] == "done"
    session = Session.load(session)
    assert session.reason == "stopped"
    assert session.clock == "host"


def test_a_full_disk_ends_it_in_one_line_and_leaves_what_was_recorded(
    tmp_path, logs, monkeypatch, simulated_clock
):
    session = tmp_path / "session"
    original, written = UnitParts.write, []

    def write(self, chunk):
        from tumble.foundation.errors import OutputError

        if sum(written) + len(chunk) > 650:
            raise OutputError(f"{session}/a.parts/000002.parquet: cannot be written: No space left on device")
        written.append(len(chunk))
        original(self, chunk)

    monkeypatch.setattr(UnitParts, "write", write)
    monkeypatch.setattr("tumble.tools.record.writer.FLUSH_EVERY", 0.1)
    slow = [f"{name}=replay:{tmp_path / name}.csv" for name in logs]
    refused = one_line(typed("record", *slow, "-o", session))
    assert "No space left on device" in refused
    assert "what was recorded is readable" in refused
    kept = sorted({path.parent.name.removesuffix(".parts") for path in session.glob("*.parts/*.parquet")})
    found = {name: samples_of(f"{session}:{name}") for name in kept}
    assert sum(map(len, found.values())) == sum(written) > 0
    for name, rows in found.items():
        assert np.array_equal(rows, logs[name][: len(rows)])


def test_unit_without_any_sample_is_reported_with_exit_code_3(tmp_path, logs, simulated_clock):
    words = [words_for(tmp_path, ["a"])[0].partition("?")[0], f"mute=udp://127.0.0.1:{free_port()}"]
    done = typed("record", *words, "-o", tmp_path / "session", "--duration", "1s")
    assert done.code == 3, done.err
    assert "mute never sent a sample" in done.err
    assert "no sample of mute was recorded" in one_line(typed("inspect", f"{tmp_path}/session:mute"))


def test_a_folder_that_holds_files_of_others_is_left_alone(tmp_path, logs):
    session = tmp_path / "session"
    session.mkdir()
    Path(session / "a.parquet").write_bytes(b"PAR1 of somebody else")
    assert "no part of a session" in one_line(typed("record", *words_for(tmp_path), "-o", session))
