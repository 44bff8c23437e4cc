"""A live aiding measurement counts as its table does, and a replay of the session uses it again."""

from __future__ import annotations

import json
import socket
import threading

import numpy as np
import pytest

from ports import free_ports
from repetitions import drawn_seed, repetitions
from simulated_clock import SimulatedClock
from tumble.foundation import clock
from tumble.procedures.redundancy.aiding_rows import SOONER, AidingRows
from turntable_sessions import one_line, typed

FAULT = 55
"""s at which the primary goes wrong, in motion, when its secondary is calibrated."""


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """Two units whose primary changes smoothly across gravity in flight: only aiding can isolate it."""
    folder = tmp_path_factory.mktemp("flight")
    fault = f"primary:bias-drift:triad=accelerometer:axis=x:start={FAULT}:end={FAULT + 2}:size=1.5"
    simulated = typed(
        *("simulate", "flight", "--unit", "tactical", "--unit", "industrial", "--fault", fault),
        *("--vibration", 0.5, "--velocity-rate", 5, "--seed", 7, "-o", folder),
    )
    assert simulated.code == 0, simulated.err
    return folder


def events_of(folder):
    lines = (folder / "events.jsonl").read_text(encoding="utf-8").splitlines()
    return [json.loads(line) for line in lines]


def test_live_aiding_isolates_the_fault_and_the_recording_agrees(flight, tmp_path):
    words = [f"{name}=replay:{flight / name}.csv?speed=max" for name in ("primary", "secondary_1")]
    aiding = f"replay:{flight / 'velocity.csv'}"
    known = ("--settings", flight / "units.yaml")
    done = typed(
        *("redundancy", "--live", *words, *known, "--aiding", aiding),
        *("--record", tmp_path / "session", "-o", tmp_path / "live"),
    )
    assert done.code == 0, done.err
    blamed = [event for event in events_of(tmp_path / "live") if event["figures"].get("ground") == "aiding"]
    assert [event["unit"] for event in blamed] == ["primary"]
    again = typed("redundancy", tmp_path / "session", *known, "-o", tmp_path / "again")
    assert again.code == 0, again.err
    assert events_of(tmp_path / "again") == events_of(tmp_path / "live")


def test_aiding_over_a_socket_is_on_the_clock_of_the_units(tmp_path):
    first, second, aiding = free_ports(3)
    over = threading.Event()

    def send():
        rng, began = np.random.default_rng(3), clock.now()
        with socket.socket(type=socket.SOCK_DGRAM) as line:
            for count in range(100_000):
                if over.is_set():
                    return
                now = clock.now() - began
                for port, ahead in ((first, 10.0), (second, 500.0)):
                    reading = rng.normal((0.0, 0.0, 9.80665, 0.0, 0.0, 0.0), 0.01).tolist()
                    row = ",".join(map(repr, [now + ahead, *reading]))
                    line.sendto(
                        f"time,ax,ay,az,gx_rad/s,gy_rad/s,gz_rad/s\n{row}".encode(), ("127.0.0.1", port)
                    )
                if count % 20 == 0:
                    line.sendto(b"%f#garbage" % now, ("127.0.0.1", aiding))
                    said = {
                        "time": 7000.0 + now,
                        "vx": 0.01,
                        "vy": 0.0,
                        "vz": 0.0,
                        "sigma": 0.1,
                        "score_b": -1.0,
                    }
                    line.sendto(json.dumps(said).encode(), ("127.0.0.1", aiding))
                clock.sleep(0.01)

    with SimulatedClock(seed=3, late=0.002):
        sender = clock.thread(send)
        sender.start()
        done = typed(
            *("redundancy", "--live", f"a=udp://:{first}", f"b=udp://:{second}", "--primary", "a"),
            *("--aiding", f"udp://:{aiding}", "--record", tmp_path / "session", "-o", tmp_path / "live"),
            *("--duration", "3s", "--set", "late=0.4", "--json"),
        )
        over.set()
        clock.wait(sender)
    assert done.code == 0, done.err
    events = events_of(tmp_path / "live")
    left_out = [event["figures"]["reason"] for event in events if event["event"] == "aiding left out"]
    assert left_out == ["negative score"], done.out[-2000:] + done.err
    assert "that say nothing" in done.out
    rows = np.genfromtxt(tmp_path / "session/aiding.csv", delimiter=",", names=True)
    assert len(rows) > 2
    # Half of them are velocities, whose arrival is that of samples soon after.
    delays = rows["arrival"] - rows["time"]
    assert delays.min() > -0.05
    assert np.median(delays) < 0.5
    again = typed(
        *("redundancy", tmp_path / "session", "--primary", "a", "--set", "late=0.4"),
        *("-o", tmp_path / "again"),
    )
    assert again.code == done.code, again.err
    assert events_of(tmp_path / "again") == events


@pytest.mark.parametrize(
    ("units", "aiding", "says"),
    [
        (("primary=udp://:9001", "a=udp://:9002"), "gps.csv", "no live source"),
        (("primary=udp://:9001", "a=udp://:9002"), "replay:gps.csv", "units are heard as they are now"),
        (("primary=udp://:9001", "a=udp://:9002"), "udp://:9002", "is the source of a unit"),
        (("primary=udp://:9001", "a=udp://:9002"), "mavlink:udpin::14550", "no rows of text come from"),
        (("primary=replay:p.csv", "a=replay:a.csv"), "udp://:9200", "units are replayed; give replay:FILE"),
    ],
)
def test_unreachable_aiding_source_is_refused_in_one_line(flight, tmp_path, units, aiding, says):
    units = [word.replace("p.csv", str(flight / "primary.csv")) for word in units]
    units = [word.replace("a.csv", str(flight / "secondary_1.csv")) for word in units]
    done = typed("redundancy", "--live", *units, "--aiding", aiding, "-o", tmp_path / "out")
    assert done.code == 2
    assert says in one_line(done.err)
    assert not (tmp_path / "out").exists()


def said(rows, *texts, start=100.0, step=0.2):
    """All measurements of rows that come one after another."""
    found = []
    for place, text in enumerate(texts):
        found += list(rows.read([text], start + step * place))
    return found


def test_rows_under_names_and_objects_say_the_same():
    table = AidingRows("gps", ["a"], sigma=0.3)
    objects = AidingRows("gps", ["a"], sigma=0.3)
    under_names = said(table, "# time; vn; ve; score_a", "1.0;2;3;4", "1.2;5;6;")
    as_objects = said(
        objects, {}, {"time": 1.0, "vn": 2.0, "ve": 3.0, "score_a": 4.0}, {"time": 1.2, "vn": 5.0, "ve": 6.0}
    )
    assert [each.kind for each in under_names] == ["velocity", "score", "velocity"]
    for one, other in zip(under_names, as_objects, strict=True):
        assert (one.kind, one.unit) == (other.kind, other.unit)
        assert np.array_equal(one.value, other.value)
        assert one.time == pytest.approx(other.time)


def test_a_row_without_a_time_is_of_when_it_came():
    rows = AidingRows("barometer", ["a"], sigma=0.3)
    (aiding,) = said(rows, "climb,sigma_climb", "0.5,0.1")
    assert aiding.time.tolist() == [100.2]
    assert aiding.sigma.tolist() == [[np.inf, np.inf, 0.1]]


def test_error_of_all_rows_is_kept_for_the_report():
    rows = AidingRows("gps", ["a"])
    assert said(rows, "time,vx", "1,2") == []
    assert "vx has no sigma" in rows.objection
    rows = AidingRows("gps", ["a"])
    assert said(rows, "time,score_c", "1,2") == []
    assert "scores are of no unit of the set: score_c" in rows.remarks


@pytest.mark.parametrize("draw", range(repetitions(10)))
def test_garbled_aiding_rows_never_end_it_and_times_stay_its_own(draw):
    rng = np.random.default_rng([drawn_seed(), draw])
    rows = AidingRows("gps", ["a"], sigma=0.3)
    offsets = []
    for count in range(200):
        line = bytearray(b"time,vx,vy,vz" if count % 20 == 0 else b"%.3f,1.25,-2.5,0.125" % (0.2 * count))
        for place in np.flatnonzero(rng.uniform(size=len(line)) < 0.01):
            line[place] = rng.integers(256)
        found = list(rows.read([line.decode("utf-8", "replace")], 100.0 + 0.2 * count))
        offsets += [float(each.time[0]) - 0.2 * count for each in found]
    assert len(offsets) > 100
    # A stamp with a wrong digit may pass if its error is less than the differences of lines.
    assert np.median(np.abs(np.array(offsets) - 100.0)) < 2.0 * SOONER
