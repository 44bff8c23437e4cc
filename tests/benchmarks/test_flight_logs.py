"""Recorded flights are listed by reference, and rates of verdicts have the interval of a Poisson process."""

import re
import struct

import numpy as np
import pytest
from benchmarks.flights import logs as flight_logs
from benchmarks.flights import sdlog2
from benchmarks.flights.body import fly
from benchmarks.flights.logs import interval, is_here, listed, place
from benchmarks.flights.units import Shaking, digitised, draw_unit, read

from dataflash_fixtures import DataFlashWriter


def test_every_log_is_listed_once_with_commit_and_checksum():
    rows = listed()
    assert len({row["sha256"] for row in rows}) == len(rows)
    for row in rows:
        assert re.fullmatch(r"[0-9a-f]{40}", row["commit"])
        assert re.fullmatch(r"[0-9a-f]{64}", row["sha256"])
        assert len(row["imus"]) >= 2
        assert (row["verdicts"] == 0) == ("why" not in row)
        assert row.get("format") in (None, "sdlog2")


SDLOG2 = {
    "TIME": (129, "Q", "StartTime"),
    "IMU": (4, "ffffff", "AccX,AccY,AccZ,GyroX,GyroY,GyroZ"),
    "IMU1": (22, "ffffff", "AccX,AccY,AccZ,GyroX,GyroY,GyroZ"),
    "EST0": (32, "BBBB", "nStat,fNaN,fHealth,fTOut"),
}


def sdlog2_of(messages):
    """Returns a log of PX4 before 2017: layouts, then messages, each a name and its values."""
    found = b""
    for name, (kind, letters, columns) in SDLOG2.items():
        length = 3 + struct.calcsize(f"<{letters}")
        layout = struct.pack("<BB4s16s64s", kind, length, name.encode(), letters.encode(), columns.encode())
        found += b"\xa3\x95\x80" + layout
    for name, values in messages:
        kind, letters, _ = SDLOG2[name]
        found += bytes((0xA3, 0x95, kind)) + struct.pack(f"<{letters}", *values)
    return found


def test_sdlog2_samples_have_the_time_message_before_them(tmp_path):
    messages = []
    for number in range(3):
        messages += [("TIME", (5_000_000 + 20_000 * number,)), ("IMU", (number, 0, -9.5, 0.5, 0, 0))]
        messages += [("IMU1", (number, 1, -9.5, 0.25, 0, 0)), ("EST0", (0, 0, 4 * (number == 2), 0))]
    path = tmp_path / "log001.px4log"
    path.write_bytes(sdlog2_of(messages))
    first, second = sdlog2.recorded(path, ["IMU", "IMU1"])
    assert first.time == pytest.approx([0.0, 0.02, 0.04])
    assert first.specific_force[2].tolist() == [2.0, 0.0, -9.5]
    assert second.specific_force[:, 1].tolist() == [1.0, 1.0, 1.0]
    assert second.angular_rate[0].tolist() == [0.25, 0.0, 0.0]
    assert list(sdlog2.autopilot(path)) == ["estimator health 4 at 0.0 s"]


def test_simulated_logs_are_counted_by_themselves():
    def log(rate, simulated):
        return {"rate": rate, "simulated": simulated, "seconds": 1800.0, "verdicts": 1}

    groups = flight_logs.groups_of([log(50.0, False), log(25.0, False), log(100.0, True), log(25.0, True)])
    assert {name: of["logs"] for name, of in groups.items()} == {
        "45 Hz and more": 1,
        "slower": 1,
        "simulated by ArduPilot": 2,
    }
    assert groups["simulated by ArduPilot"]["hours"] == 1.0


def test_health_that_ardupilot_states_is_told_when_it_changes(tmp_path):
    writer = DataFlashWriter()
    for number, health in enumerate((1, 0, 0, 1)):
        writer.add("IMU", 10_000 * number, 1, *[0.0] * 6, 0, 0, 30.0, health, 1, 1000, 1000)
    told = list(flight_logs.autopilot(writer.write(tmp_path / "flight.bin")))
    assert [each.partition(" at ")[0] for each in told] == [
        "gyroscope of IMU 1 unhealthy",
        "gyroscope of IMU 1 sound",
    ]


def test_a_log_of_another_version_is_left_out(tmp_path):
    row = listed()[0]
    assert not is_here(tmp_path, row)
    path = place(tmp_path, row)
    path.parent.mkdir(parents=True)
    path.write_bytes(b"another")
    assert not is_here(tmp_path, row)


@pytest.mark.parametrize(
    ("count", "hours", "expected"),
    [(0, 1.0, (0.0, 3.689)), (3, 1.0, (0.619, 8.767)), (3, 2.0, (0.309, 4.384))],
)
def test_a_rate_has_the_exact_interval_of_its_count(count, hours, expected):
    assert interval(count, hours) == pytest.approx(expected, abs=1e-3)


def test_a_unit_that_dies_in_a_log_of_two_is_named():
    print("seed 21")
    random = np.random.default_rng(21)
    body = fly(random, np.array([[8.0, 40.0]]), 50.0, 0.05)
    units = [draw_unit(random, 100.0, 0, 100.0) for _ in range(2)]
    samples = [digitised(read(random, unit, body, Shaking((), 0.0), 0.0), unit) for unit in units]
    found = flight_logs.faulted(samples, "dead", 1, (0, 0))
    assert (found["outcome"], found["units"]) == ("right", 2)
    assert found["isolated"] < 0.2
