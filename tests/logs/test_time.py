"""Which column is time, in which unit, and the message where neither makes sense of an IMU."""

from __future__ import annotations

import numpy as np
import pytest

from log_fixtures import made_up, refusal, write_text
from tumble.acquisition.acquire import acquire
from tumble.foundation.errors import ProcedureError
from tumble.logs import ReadOptions, open_recording
from tumble.logs.units import FASTEST_HZ, SLOWEST_HZ, UNITS, guess_time_unit, is_imu_step
from tumble.tools.inspect.procedure import inspect
from turntable_sessions import one_line, typed

TRIADS = "ax,ay,az,gx,gy,gz"


def counted(path, name, start=1.5e9, ticks_per_second=1e6, rate=155.0):
    """A log with a counter of microseconds, or of the given ticks, under that name."""
    chunk = made_up(600, rate=rate, start=start / ticks_per_second, temperature=False)
    return write_text(path, chunk, f"{name},{TRIADS}", scale=(ticks_per_second, 1.0, 1.0))


@pytest.mark.parametrize(
    ("name", "unit", "ticks"),
    [
        ("ustime", "us", 1e6),
        ("time_us", "us", 1e6),
        ("timestamp_ns", "ns", 1e9),
        ("mcu_us", "us", 1e6),
        ("rx_clock_ms", "ms", 1e3),
        ("nsstamp", "ns", 1e9),
        ("micros", "us", 1e6),
    ],
)
def test_a_counter_is_known_by_its_name(tmp_path, name, unit, ticks):
    found = inspect(open_recording(counted(tmp_path / "log.csv", name, ticks_per_second=ticks)))
    assert found.metadata.time_unit.name == unit
    assert found.timing.rate == pytest.approx(155.0, rel=1e-3)


@pytest.mark.parametrize("name", ["dt_us", "exposure_ms", "latency_ns"])
def test_a_duration_is_not_taken_for_time(tmp_path, name):
    assert "no column is known to be time" in refusal(counted(tmp_path / "log.csv", name))


def test_counter_of_us_as_large_as_epoch_seconds_is_known_by_its_step(tmp_path):
    path = counted(tmp_path / "log.csv", "counter", start=1.5e9)
    found = inspect(open_recording(path, ReadOptions(columns={"time": "counter"})))
    assert found.metadata.time_unit.name == "us"
    assert found.timing.rate == pytest.approx(155.0, rel=1e-3)


@pytest.mark.parametrize("rate", [1.0, 10.0, 155.0, 1000.0, 20_000.0])
@pytest.mark.parametrize("ticks", [1.0, 1e3, 1e6, 1e9])
def test_stamps_since_1970_keep_the_unit_of_their_size(rate, ticks):
    time = np.round((1.7e9 + np.arange(50_000) / rate) * ticks)
    expected = {1.0: "s", 1e3: "ms", 1e6: "us", 1e9: "ns"}[ticks]
    assert guess_time_unit(time).name == expected


def test_missing_time_column_is_refused_with_the_columns_found(tmp_path):
    line = refusal(counted(tmp_path / "log.csv", "counter"))
    assert "columns found: counter, ax, ay, az, gx, gy, gz" in line
    assert "--columns time=NAME" in line
    assert "--rate" in line


@pytest.mark.parametrize("rate", [0.9 * SLOWEST_HZ, 1.1 * FASTEST_HZ])
def test_implausible_rate_is_reported_and_suits_no_procedure(tmp_path, rate):
    path = write_text(tmp_path / "log.csv", made_up(600, rate=rate, temperature=False))
    recording = open_recording(path, ReadOptions(time_unit="s"))
    found = inspect(recording)
    assert not any(service.possible for service in found.services)
    assert all("samples a second" in " ".join(service.missing) for service in found.services)
    assert any("is none of an IMU" in remark and "--time-unit" in remark for remark in found.remarks)
    with pytest.raises(ProcedureError, match=r"is none of an IMU.*--time-unit"):
        acquire(recording)


@pytest.mark.parametrize("rate", [SLOWEST_HZ, 100.0, FASTEST_HZ])
def test_the_rates_that_imus_have_are_taken(rate):
    assert is_imu_step(1.0 / rate)


MAGNITUDES = [5e-324, 1e-310, 2e-308, 1e-300, 1e-154, 1e-30, 1e-9, 1e-4, 1.0, 1e9, 1e30, 1e154, 1e300, 1e308]
"""Numbers of all sizes that a stamp, a rate or a scale may have."""


@pytest.mark.parametrize("unit", [None, "s", "ns"])
@pytest.mark.parametrize("step", MAGNITUDES)
def test_a_step_of_time_of_any_size_is_read_or_one_line(tmp_path, step, unit):
    with np.errstate(over="ignore"):
        times = np.arange(300) * step
    path = tmp_path / "log.npz"
    chunk = made_up(300, temperature=False)
    np.savez(path, time=times, acc=chunk.accelerometer, gyro=chunk.gyroscope)
    words = [] if unit is None else ["--time-unit", unit]
    done = typed("inspect", path, *words)
    assert done.code in (0, 2), done.err
    # A step is that of an IMU in one unit at most of those that are far apart.
    if unit is not None and not is_imu_step(step * UNITS["time"][unit]):
        assert "is none of an IMU" in done.out or done.code == 2


@pytest.mark.parametrize("rate", [*map(str, MAGNITUDES), "inf", "1e309", "nan", "-inf", "-0"])
def test_a_rate_of_any_size_is_taken_or_one_line(tmp_path, rate):
    path = write_text(tmp_path / "log.csv", made_up(300, temperature=False), f"time,{TRIADS}")
    done = typed("inspect", path, f"--rate={rate}")
    assert done.code in (0, 2), done.err
    if not 0.0 < float(rate) < np.inf:
        assert f"--rate {float(rate):g}: needs to be a number above zero" in one_line(done.err)


@pytest.mark.parametrize("wrong", [1, 599])
@pytest.mark.parametrize("command", ["noise", "align"])
def test_a_time_that_no_clock_reads_is_named_in_every_command(tmp_path, command, wrong):
    chunk = made_up(600, rate=100.0, temperature=False)
    chunk.time[600 - wrong :] = np.linspace(1e300, 1.7e308, wrong)
    log = write_text(tmp_path / "log.csv", chunk, f"time,{TRIADS}")
    other = write_text(tmp_path / "other.csv", made_up(600, rate=100.0, temperature=False), f"time,{TRIADS}")
    words = (log,) if command == "noise" else ("--primary", log, "--secondary", other)
    done = typed(command, *words, "-o", tmp_path / "out")
    assert done.code in (0, 2, 3)
    seen = f"time reads 1e+300 s (line {602 - wrong})"
    assert seen in done.out + done.err
    if wrong > 6:
        assert f"{wrong} of 600 samples are what no sensor reads: {seen}" in one_line(done.err)
