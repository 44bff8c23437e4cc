"""A live bench: units that feel the motion of the table, send over real lines, and fail on demand."""

from __future__ import annotations

import json
import os
import random
import re
import shlex
import signal
import socket
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from live_fixtures import first_samples
from patience import PATIENCE
from repetitions import drawn_seed, repetitions
from table_fixtures import Clock
from tumble import _core
from tumble.foundation import clock
from tumble.live import open_source
from tumble.procedures.spin.live import LiveSpin, LiveSpinOptions
from tumble.tools.simulate.live.fault import LIVE_FAULTS, LiveFault
from tumble.tools.simulate.live.outlet import Outlet
from tumble.tools.simulate.live.procedure import LiveSimulation, LiveUnit
from tumble.tools.simulate.live.samples import NONE
from tumble.tools.simulate.live.scenario import LiveScenario
from tumble.tools.simulate.live.table_units import Noise, session_at_rest, units_on
from tumble.tools.table import GuardedTable, open_table
from tumble.tools.table.axes import body_motion, level_from_table
from tumble.tools.table.simulated import PRESETS, SimulatedTable
from turntable_sessions import one_line, typed

SEED = 20


class Kept(Outlet):
    """Keeps what is sent."""

    address = "kept"

    def __init__(self):
        self.samples, self.garbled, self.plugs = NONE, [], []

    def is_heard(self):
        return True

    def plug(self):
        self.plugs.append("in")

    def unplug(self):
        self.plugs.append("out")

    def send(self, samples, garble, share):
        self.samples = self.samples.then(samples)
        self.garbled.append(share)


def bench(now, axes=PRESETS["three-axis"], **changes):
    """A table, and its units, at the mercy of a clock."""
    scenario = LiveScenario(seed=SEED, **changes)
    table = SimulatedTable(axes, now)
    session, feeds, noise = units_on(
        table, scenario, {name: tuple(each) for name, each in scenario.faults.items()}
    )
    return scenario, table, session, feeds, noise


def test_units_on_a_resting_table_read_as_in_simulated_sessions():
    scenario, _, _, feeds, noise = bench(Clock(), duration_seconds=5.0)
    try:
        recorded = session_at_rest(scenario, noise._seconds, SEED)
        for unit in recorded.units:
            live = feeds[unit.name].until(3.0)
            assert len(live) > 500
            count = len(live)
            assert np.allclose(live.time, unit.samples.time[:count], atol=1e-9)
            for name in ("accelerometer", "gyroscope"):
                off = np.abs(getattr(live, name) - getattr(unit.samples, name)[:count])
                # A last bit may decide which step of the output is nearest.
                assert np.mean(off < 1e-9) > 0.999
                assert off.max() <= getattr(unit, name).quantisation * 1.001 + 1e-9
    finally:
        noise.close()


ANGLE = st.floats(-3.0, 3.0)


@settings(max_examples=60)
@given(st.lists(st.tuples(ANGLE, ANGLE, ANGLE), min_size=1, max_size=3), st.integers(0, 999))
def test_the_rates_of_a_table_are_the_derivatives_of_its_attitude(states, seed):
    random = np.random.default_rng(seed)
    axes = tuple(
        replace(axis, about=_unit(random.standard_normal(3))) for axis in PRESETS["three-axis"][: len(states)]
    )
    angles, rates, accelerations = (np.array(each) for each in zip(*states, strict=True))
    step = 1e-4

    def at(t):
        moved = angles + rates * t + 0.5 * accelerations * t * t
        return level_from_table(axes, moved[np.newaxis])[0], rates + accelerations * t, moved

    def rate_at(t):
        _, rate, moved = at(t)
        return body_motion(axes, moved[np.newaxis], rate[np.newaxis], accelerations[np.newaxis])[0][0]

    turned, speeding = body_motion(axes, *(each[np.newaxis] for each in (angles, rates, accelerations)))
    between = at(-step)[0].T @ at(step)[0]
    assert np.allclose(
        _core.rotation_vector(np.ascontiguousarray(between)) / (2 * step), turned[0], atol=1e-5
    )
    assert np.allclose((rate_at(step) - rate_at(-step)) / (2 * step), speeding[0], atol=1e-5)


def _unit(vector):
    return tuple((vector / np.linalg.norm(vector)).tolist())


def test_unit_feels_angle_and_turn_of_the_table_at_its_own_place():
    now, arm = Clock(), (0.2, -0.1, 0.05)
    scenario, table, session, feeds, noise = bench(
        now, duration_seconds=40.0, lever_arm_m={"target_1": arm}, grades=("reference", "industrial")
    )
    try:
        table.goto(np.radians([0.0, 90.0, 30.0]), np.full(3, 2.0), np.full(3, 2.0))
        now.now = 10.0
        table.rate(np.radians([90.0, 0.0, 0.0]), np.full(3, 2.0))
        now.now = 20.0
        samples = feeds["target_1"].until(20.0)
        unit = session["target_1"]
        for start, end, spinning in ((4.0, 10.0, 0.0), (12.0, 20.0, np.pi / 2)):
            at = np.array([end])
            case_from_level = session.R_e @ level_from_table(table.axes, table.states(at)[0])[0].T
            spin = session.R_e @ body_motion(table.axes, *table.states(at))[0][0]
            assert np.linalg.norm(spin) == pytest.approx(spinning, abs=1e-9)
            force = case_from_level @ [0.0, 0.0, scenario.gravity] + np.cross(spin, np.cross(spin, arm))
            inside = (samples.taken > start) & (samples.taken < end)
            count = inside.sum()
            truth = unit.accelerometer
            sigma = truth.noise_density * np.sqrt(scenario.rate_hz / count) + 5 * truth.bias_instability
            found = samples.accelerometer[inside].mean(axis=0)
            # About the vertical everything turns with the table, but for the Earth.
            assert np.abs(found - truth.M @ force - truth.b).max() < 5 * sigma + truth.quantisation
            found = samples.gyroscope[inside].mean(axis=0)
            truth = unit.gyroscope
            sigma = truth.noise_density * np.sqrt(scenario.rate_hz / count) + 5 * truth.bias_instability
            off = found - truth.M @ spin - truth.b - truth.g_sensitivity @ force
            assert np.abs(off).max() < 5 * sigma + truth.quantisation + 1e-4
    finally:
        noise.close()


def test_noise_continues_without_a_jump_for_any_pieces():
    scenario = LiveScenario(seed=SEED, rate_hz=50.0, duration_seconds=10.0, grades=("consumer",))
    noise = Noise(scenario)
    try:
        stretch = noise._length - noise._overlap
        whole = noise.rows("reference", 0, 4 * stretch)
        pieces = [noise.rows("reference", first, 7) for first in range(2 * stretch, 3 * stretch - 7, 7)]
        assert np.array_equal(np.concatenate(pieces), whole[2 * stretch : 2 * stretch + 7 * len(pieces)])
        spread = whole.std(axis=0)
        for border in range(stretch, 4 * stretch, stretch):
            near = whole[border - noise._overlap // 2 : border + noise._overlap]
            assert np.all(near.std(axis=0) < 1.5 * spread)
            assert np.all(near.std(axis=0) > 0.6 * spread)
    finally:
        noise.close()


def test_units_sample_without_end_whatever_their_clocks():
    draws = random.Random(drawn_seed())
    for _ in range(repetitions(12)):
        skew = draws.uniform(100.0, 5000.0)
        _, _, _, feeds, noise = bench(Clock(), duration_seconds=4.0, clock_skew_ppm=skew)
        try:
            stretches = 4.0 * noise._seconds
            for feed in feeds.values():
                assert len(feed.until(stretches)) > 0.9 * stretches * feed._rate
        finally:
            noise.close()


def test_same_seed_gives_the_same_samples_for_any_pieces():
    def sent(ticks):
        scenario, _, _, feeds, noise = bench(Clock(), duration_seconds=4.0)
        outlet = Kept()
        unit = LiveUnit("target_1", 1, feeds["target_1"], outlet, scenario)
        for now in ticks:
            unit.advance(now)
        noise.close()
        return outlet.samples

    often, seldom = sent(np.arange(0.0, 4.0, 0.01)), sent([0.5, 3.0])
    count = min(len(often), len(seldom))
    assert count > 400
    assert np.allclose(often.time[:count], seldom.time[:count], atol=1e-12)
    assert np.allclose(often.accelerometer[:count], seldom.accelerometer[:count], atol=1e-12)


@pytest.mark.parametrize("kind", LIVE_FAULTS)
def test_a_fault_shows_from_its_start_to_its_end_and_nowhere_else(kind):
    def sent(faults):
        scenario, _, _, feeds, noise = bench(
            Clock(), duration_seconds=8.0, faults={"target_1": faults}, jitter_seconds=0.0
        )
        outlet, arrivals = Kept(), []
        unit = LiveUnit("target_1", 1, feeds["target_1"], outlet, scenario)
        for now in np.arange(0.0, 8.0, 0.02):
            unit.advance(now)
            arrivals += [now] * (len(outlet.samples) - len(arrivals))
        noise.close()
        return outlet, np.array(arrivals)

    good, _ = sent([])
    outlet, arrivals = sent([LiveFault(kind, start=2.0, end=5.0)])
    fault = LiveFault(kind, start=2.0, end=5.0)
    found = outlet.samples
    before = good.samples.taken < 2.0
    count = before.sum()
    assert np.array_equal(found.accelerometer[:count], good.samples.accelerometer[before])
    assert np.array_equal(found.time[:count], good.samples.time[before])
    inside = (found.taken >= 2.0) & (found.taken < 5.0)
    after = found.taken >= 5.0
    delay = arrivals - found.taken
    match kind:
        case "unplugged" | "gap" | "restart":
            assert not inside.any()
        case "frozen":
            assert np.ptp(found.gyroscope[inside], axis=0).max() == 0.0
            assert np.ptp(found.gyroscope[after], axis=0).max() > 0.0
        case "late":
            assert delay[inside & (found.taken < 4.0)].min() >= fault.bad
            assert delay[found.taken > 6.0].max() < 0.1
        case "garbled":
            assert outlet.garbled[: int(2.0 / 0.02) - 2] == [0.0] * (int(2.0 / 0.02) - 2)
            assert fault.bad in outlet.garbled
            assert outlet.garbled[-1] == 0.0
        case "clock-jump" | "time-backwards":
            jump = fault.bad if kind == "clock-jump" else -fault.bad
            same = good.samples.time[good.samples.taken >= 2.0]
            assert np.allclose(found.time[found.taken >= 2.0], same + jump)
        case "moved":
            late = found.accelerometer[found.taken > 2.0].mean(axis=0)
            early = found.accelerometer[found.taken < 2.0].mean(axis=0)
            lean = np.linalg.norm((late - early)[:2]) / 9.8
            assert np.degrees(lean) == pytest.approx(fault.bad, rel=0.2)
    if kind == "restart":
        assert found.time[after][0] < 0.1
    assert outlet.plugs == (["out", "in"] if kind == "unplugged" else [])


@pytest.mark.parametrize("transport", ["udp", "pty", "tcp", "mavlink"])
def test_each_unit_is_read_over_its_own_line(transport, tmp_path, simulated_clock):
    grades = ("reference", "consumer")
    with LiveSimulation(
        seed=SEED, grades=grades, transport=transport, port=0, table_port=0, folder=tmp_path
    ) as simulation:
        for name, address in simulation.addresses.items():
            with open_source(address) as source:
                samples = first_samples(source, 100)
                assert not source.gyroscope_unit_is_assumed
            truth = simulation.truth["units"][name]["accelerometer"]
            expected = np.array(truth["M"]) @ simulation.truth["R_e"] @ [0.0, 0.0, 9.80665] + truth["b"]
            assert np.allclose(samples[:, 1:4].mean(axis=0), expected, atol=0.05)
            assert np.diff(samples[:, 0]) == pytest.approx(0.005, abs=1e-5)
            assert samples[0, 0] >= 0.0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("transport", ["udp", "pty", "tcp", "mavlink"])
def test_uncommanded_motion_begins_with_the_first_listener(transport, tmp_path, simulated_clock):
    with LiveSimulation(
        seed=SEED, motion="spin", transport=transport, port=0, rest_seconds=2.0, folder=tmp_path
    ) as robot:
        for _ in range(3):
            clock.sleep(5.0)
            assert robot.now() == 0.0
        with open_source(robot.addresses["imu"]) as source:
            samples = first_samples(source, 10)
        assert robot.now() > 0.0
    assert samples[0, 0] < robot.scenario.uptime + 0.1


def test_a_motion_that_nobody_listens_to_ends_after_its_duration(simulated_clock):
    with LiveSimulation(seed=SEED, motion="spin", port=0, speed=50.0, duration_seconds=10.0) as robot:
        assert robot.wait(60.0)


def test_tcp_client_receives_the_columns_first(simulated_clock):
    with LiveSimulation(transport="tcp", port=0, table_port=0, grades=("reference",)) as simulation:
        host, port = simulation.addresses["reference"].removeprefix("tcp://").split(":")
        for _ in range(2):
            with socket.create_connection((host, int(port))) as line:
                text = ""
                while text.count("\n") < 2:
                    assert clock.readable(line.fileno(), 10.0)
                    piece = line.recv(4096).decode()
                    assert piece, "the simulation closed the line"
                    text += piece
            names, first, *_ = text.splitlines()
            assert names == "time_us,ax_mps2,ay_mps2,az_mps2,gx_radps,gy_radps,gz_radps"
            assert len(first.split(",")) == 7


def test_unplugged_serial_line_is_lost_and_can_be_opened_again(tmp_path, simulated_clock):
    faults = {"reference": [LiveFault("unplugged", start=2.0, end=4.0)]}
    with LiveSimulation(
        transport="pty", grades=("reference",), faults=faults, table_port=0, folder=tmp_path
    ) as simulation:
        address = simulation.addresses["reference"]
        with pytest.raises(Exception, match="connection was lost"), open_source(address) as source:
            first_samples(source, 10_000)
        while simulation.now() < 4.0 or not (tmp_path / "reference").exists():
            clock.sleep(0.02)
        with open_source(address) as source:
            assert len(first_samples(source, 50)) == 50


def test_the_loop_is_closed_over_real_sockets(simulated_clock):
    readings = []
    with (
        LiveSimulation(seed=SEED, port=0, table_port=0, grades=("reference",)) as simulation,
        GuardedTable(open_table(simulation.table_address), armed=True) as table,
        open_source(simulation.addresses["reference"]) as source,
    ):
        for angles in ([0.0, 0.0], [90.0, 0.0], [180.0, 0.0]):
            table.goto(np.radians(angles))
            table.wait()
            since = simulation.now() + simulation.scenario.uptime + 0.5
            samples = np.empty((0, 7))
            while not len(samples):
                samples = first_samples(source, 400)
                samples = samples[samples[:, 0] > since]
            readings.append(samples[:, 1:4].mean(axis=0))
    axis = np.array(simulation.truth["R_e"])
    for reading, up in zip(readings, ([0, 0, 1], [0, 1, 0], [0, 0, -1]), strict=True):
        assert np.allclose(reading, 9.80665 * axis @ up, atol=0.02)


def test_a_spin_is_found_from_a_robot_that_is_served_live(simulated_clock):
    with (
        LiveSimulation(
            seed=SEED, motion="spin", transport="tcp", port=0, rest_seconds=10.0, rate_hz=100.0
        ) as robot,
        open_source(robot.addresses["imu"]) as source,
    ):
        live = LiveSpin(source, LiveSpinOptions(still=5.0, turns=2.0))
        for _ in live.steps():
            pass
    error = live.result().spins[0].level_free.value - robot.truth["accelerometer_bias"]
    assert np.abs(error[:2]).max() < 0.02


def test_the_command_serves_until_its_end_and_writes_the_truth(tmp_path, simulated_clock):
    done = typed(
        *("simulate", "live", "--grades", "reference,consumer", "--port", "0", "--table-port", "0"),
        *("--speed", "20", "--duration", "4", "--seed", "5", "-o", tmp_path, "--json"),
    )
    assert done.code == 0, done.err
    said = json.loads(done.out)
    assert list(said["units"]) == ["reference", "target_1"]
    truth = yaml.safe_load((tmp_path / "truth.yaml").read_text())
    assert truth["live"]["addresses"] == said["units"]
    assert truth["live"]["table"] == said["table"]
    assert truth["seed"] == said["seed"] == 5
    sent = dict(re.findall(r"^(\w+): (\d+) samples sent$", done.err, re.MULTILINE))
    # 4 s at 200 Hz, but for what is still on its way.
    assert {name for name, count in sent.items() if 790 < int(count) <= 801} == {"reference", "target_1"}


@pytest.mark.parametrize("which", ["SIGTERM", "SIGINT"])
def test_a_signal_ends_the_command_cleanly(tmp_path, which):
    words = ["simulate", "live", "--transport", "pty", "--table-port", "0", "-o", str(tmp_path / "bench")]
    program = subprocess.Popen(
        [sys.executable, "-c", "from tumble.cli.main import main; main()", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert any("Ctrl-C ends it" in line for line in program.stdout)
        os.kill(program.pid, getattr(signal, which))
        _, err = program.communicate(timeout=PATIENCE)
    finally:
        program.kill()
    assert program.returncode == 0
    assert "Traceback" not in err
    assert [path.name for path in (tmp_path / "bench").iterdir()] == ["truth.yaml"]


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("--rate", "0.1"), "rate_hz is 0.1"),
        (("--grades", "toy"), "unknown grade 'toy'"),
        (("--speed", "0"), "speed is 0; make it positive"),
        (("--jitter", "-1"), "make it zero or more"),
        (("--fault", "nobody:moved"), "unknown unit 'nobody' of a fault"),
        (("--fault", "reference:melted"), "unknown fault 'melted'"),
        (("--fault", "reference:garbled:size=2"), "size is a share of 1"),
        (("--table-profile", "nobodys"), "no such profile"),
        (("--host", "999.1.1.1"), "give"),
    ],
)
def test_a_bench_that_makes_no_sense_is_refused_in_one_line(tmp_path, words, problem):
    done = typed("simulate", "live", "--port", "0", "--table-port", "0", "-o", tmp_path, *words)
    assert done.code == 2
    assert problem in one_line(done.err)


def test_a_file_where_a_serial_line_is_to_be_linked_is_left_alone(tmp_path):
    (tmp_path / "reference").write_text("mine")
    done = typed("simulate", "live", "--transport", "pty", "--table-port", "0", "-o", tmp_path)
    assert done.code == 2
    assert "cannot be linked" in one_line(done.err)
    assert (tmp_path / "reference").read_text() == "mine"


def test_a_port_of_a_table_that_is_taken_is_refused_in_one_line(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = typed("simulate", "live", "--port", "0", "--table-port", port, "-o", tmp_path)
    assert done.code == 2
    assert f"table at 127.0.0.1:{port}" in one_line(done.err)


def test_printed_command_records_all_units(tmp_path):
    words = ["simulate", "live", "--motion", "six-faces", "--port", "0", "-o", str(tmp_path / "bench")]
    program = subprocess.Popen(
        [sys.executable, "-c", "from tumble.cli.main import main; main()", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        line = next(line for line in program.stdout if line.startswith("Next: "))
        printed = shlex.split(line.removeprefix("Next: tumble "))
        printed[-1] = str(tmp_path / "session")
        # It waits by the clock of the computer, as the bench does.
        command = [sys.executable, "-m", "tumble", *printed, "--count", "100"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    finally:
        program.kill()
        program.wait()
        program.stdout.close()
    assert done.returncode == 0, done.stderr
    names = {path.stem for path in (tmp_path / "session").glob("*.parquet")}
    assert names == {"reference", "target_1", "target_2", "target_3"}
