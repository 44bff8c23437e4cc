"""Units: stated in options, stated by the log, or shown by the values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from log_fixtures import made_up, read, refusal, same, write_text
from tumble.logs import ReadOptions, open_recording
from tumble.logs.units import guess_time_unit, rest_norm

G = 9.80665
DEGREE = np.pi / 180.0


def close(left, right):
    np.testing.assert_allclose(left.time, right.time, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(left.accelerometer, right.accelerometer, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(left.gyroscope, right.gyroscope, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("unit", "scale"), [("m/s^2", 1.0), ("g", G), ("mg", G / 1000.0)])
def test_the_length_at_rest_tells_the_unit_of_an_accelerometer(tmp_path, unit, scale):
    chunk = made_up(temperature=False)
    path = write_text(tmp_path / "log.csv", chunk, scale=(1.0, 1.0 / scale, 1.0))
    found = open_recording(path).metadata.accelerometer_unit
    assert found.name == unit
    assert found.reason.startswith("norm at rest is ")
    close(read(path), chunk)


def test_a_peak_no_body_turns_at_makes_a_gyroscope_read_degrees(tmp_path):
    chunk = made_up(temperature=False)
    path = write_text(tmp_path / "log.csv", chunk, scale=(1.0, 1.0, 1.0 / DEGREE))
    found = open_recording(path).metadata.gyroscope_unit
    assert found.name == "deg/s"
    assert "too fast for rad/s" in found.reason
    close(read(path), chunk)


def test_slow_gyroscope_is_assumed_in_radians_with_the_reason(tmp_path):
    path = write_text(tmp_path / "log.csv", made_up(temperature=False))
    unit = open_recording(path).metadata.gyroscope_unit
    assert (unit.name, unit.reason) == ("rad/s", "assumed")


def test_assumed_radians_are_refused_when_later_rates_are_too_fast(tmp_path):
    chunk = made_up(200_000, temperature=False)
    chunk.gyroscope[:, 2] = 0.0
    chunk.gyroscope[-100:, 2] = 250.0
    path = write_text(tmp_path / "log.csv", chunk)
    assert "--gyroscope-unit" in refusal(path)


@pytest.mark.parametrize(("unit", "scale"), [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_the_step_between_samples_tells_the_unit_of_time(tmp_path, unit, scale):
    chunk = made_up(temperature=False, rate=100.0)
    path = write_text(tmp_path / "log.csv", chunk, scale=(scale, 1.0, 1.0))
    assert open_recording(path).metadata.time_unit.name == unit
    close(read(path), chunk)


@pytest.mark.parametrize(("unit", "scale"), [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_the_size_of_stamps_that_count_from_1970_tells_their_unit(unit, scale):
    assert guess_time_unit(np.array([1.7e9, 1.7e9 + 1.0]) * scale).name == unit


def test_a_unit_in_a_column_name_needs_no_guess(tmp_path):
    chunk = made_up(temperature=False)
    header = "timestamp_us,ax [g],ay [g],az [g],gyro_x_dps,gyro_y_dps,gyro_z_dps"
    path = write_text(tmp_path / "log.csv", chunk, header=header, scale=(1e6, 1.0 / G, 1.0 / DEGREE))
    metadata = open_recording(path).metadata
    assert [unit.reason for unit in (metadata.accelerometer_unit, metadata.gyroscope_unit)] == [
        "column name"
    ] * 2
    close(read(path), chunk)


def test_an_option_goes_before_a_column_name_and_says_so(tmp_path):
    chunk = made_up(temperature=False)
    header = "time,ax [m/s^2],ay [m/s^2],az [m/s^2],gx,gy,gz"
    path = write_text(tmp_path / "log.csv", chunk, header=header, scale=(1.0, 1.0 / G, 1.0))
    options = ReadOptions(accelerometer_unit="g")
    assert open_recording(path, options).metadata.accelerometer_unit.reason == "option, log says m/s^2"
    close(read(path, options), chunk)


@pytest.mark.parametrize(("stated", "true", "scale"), [("m/s^2", "g", 1.0 / G), ("g", "m/s^2", 1.0)])
def test_stated_unit_that_gravity_contradicts_is_refused_with_remedy(tmp_path, stated, true, scale):
    header = f"time,ax [{stated}],ay [{stated}],az [{stated}],gx,gy,gz"
    path = write_text(
        tmp_path / "log.csv", made_up(temperature=False), header=header, scale=(1.0, scale, 1.0)
    )
    line = refusal(path)
    assert f"stated in {stated}" in line
    assert f"--accelerometer-unit {true}" in line
    assert f"--accelerometer-unit {true}" in refusal(path, ReadOptions(accelerometer_unit=stated))


def test_counts_without_a_scale_are_refused_with_the_remedy(tmp_path):
    path = write_text(tmp_path / "log.csv", made_up(temperature=False), scale=(1.0, 16384 / G, 1.0))
    assert "--accelerometer-scale" in refusal(path)


def test_gyroscope_counts_without_a_scale_are_refused_with_the_remedy(tmp_path):
    chunk = made_up(temperature=False)
    chunk.gyroscope[:] += 3.0
    path = write_text(tmp_path / "log.csv", chunk, scale=(1.0, 1.0, 131 / DEGREE))
    assert "--gyroscope-scale" in refusal(path)


def test_counts_are_read_with_scale_and_zero_of_each_axis(tmp_path):
    chunk = made_up(temperature=False)
    counts = chunk.accelerometer * [400.0, 410.0, 420.0] + [32768, 32700, 32800]
    chunk_in_counts = type(chunk)(chunk.time, counts, chunk.gyroscope * 131 / DEGREE + 5)
    path = write_text(tmp_path / "log.csv", chunk_in_counts)
    options = ReadOptions(
        accelerometer_scale=(400.0, 410.0, 420.0),
        accelerometer_zero=(32768.0, 32700.0, 32800.0),
        gyroscope_scale=131.0,
        gyroscope_zero=5.0,
        gyroscope_unit="deg/s",
    )
    recording = open_recording(path, options)
    assert recording.metadata.accelerometer_unit.name == "counts"
    found = read(path, options)
    np.testing.assert_allclose(found.accelerometer, chunk.accelerometer, atol=1e-9)
    np.testing.assert_allclose(found.gyroscope, chunk.gyroscope, atol=1e-9)


def test_a_scale_that_puts_gravity_out_of_reach_is_refused(tmp_path):
    path = write_text(tmp_path / "log.csv", made_up(temperature=False), scale=(1.0, 16384 / G, 1.0))
    assert "--accelerometer-scale" in refusal(path, ReadOptions(accelerometer_scale=16384.0))


@pytest.mark.parametrize(
    ("unit", "there"), [("degC", lambda c: c), ("K", lambda c: c + 273.15), ("degF", lambda c: 32 + 1.8 * c)]
)
def test_temperature_is_read_in_degrees_celsius(tmp_path, unit, there):
    rows = [f"{0.01 * i!r},0,0,9.8,0,0,0,{there(20.0 + 0.1 * i)!r}" for i in range(100)]
    path = tmp_path / "log.csv"
    path.write_text(f"time,ax,ay,az,gx,gy,gz,temperature [{unit}]\n" + "\n".join(rows) + "\n")
    np.testing.assert_allclose(read(path).temperature, 20.0 + 0.1 * np.arange(100), atol=1e-9)


def test_sensor_that_reads_minus_g_up_is_inverted_with_a_remark(tmp_path):
    chunk = made_up(temperature=False)
    path = write_text(tmp_path / "log.csv", chunk, scale=(1.0, -1.0, 1.0))
    options = ReadOptions(accelerometer_sign=-1)
    assert same(read(path, options), chunk)
    assert "sign of the accelerometer changed to read +g up" in open_recording(path, options).metadata.remarks


def test_axes_turn_both_triads_alike(tmp_path):
    chunk = made_up(temperature=False)
    found = read(write_text(tmp_path / "log.csv", chunk), ReadOptions(axes="y,-x,z"))
    for turned, triad in ((found.accelerometer, chunk.accelerometer), (found.gyroscope, chunk.gyroscope)):
        assert np.array_equal(turned, np.column_stack([triad[:, 1], -triad[:, 0], triad[:, 2]]))


def test_axes_are_turned_after_scale_and_zero_of_the_log_s_own_axes(tmp_path):
    chunk = made_up(temperature=False)
    counts = type(chunk)(
        chunk.time, chunk.accelerometer * [100.0, 200.0, 300.0] + [1.0, 2.0, 3.0], chunk.gyroscope
    )
    options = ReadOptions(
        axes="z,x,y", accelerometer_scale=(100.0, 200.0, 300.0), accelerometer_zero=(1.0, 2.0, 3.0)
    )
    found = read(write_text(tmp_path / "log.csv", counts), options)
    np.testing.assert_allclose(found.accelerometer, chunk.accelerometer[:, [2, 0, 1]], atol=1e-9)


@pytest.mark.parametrize("axes", ["y,x,z", "-x,y,z"])
def test_axes_that_mirror_say_that_the_log_is_left_handed(tmp_path, axes):
    log = write_text(tmp_path / "log.csv", made_up())
    (remark,) = open_recording(log, ReadOptions(axes=axes)).metadata.remarks
    assert "left-handed" in remark


@pytest.mark.parametrize("axes", ["x,y", "x,x,z", "a,b,c", ""])
def test_axes_that_are_none_are_refused(tmp_path, axes):
    assert "--axes" in refusal(write_text(tmp_path / "log.csv", made_up()), ReadOptions(axes=axes))


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (ReadOptions(accelerometer_unit="furlong"), "--accelerometer-unit"),
        (ReadOptions(gyroscope_unit="g"), "--gyroscope-unit"),
        (ReadOptions(time_unit="weeks"), "--time-unit"),
        (ReadOptions(temperature_unit="hot"), "--temperature-unit"),
        (ReadOptions(accelerometer_sign=2), "--accelerometer-sign"),
        (ReadOptions(accelerometer_scale=0.0), "--accelerometer-scale"),
        (ReadOptions(gyroscope_zero=(1.0, 2.0)), "--gyroscope-zero"),
        (ReadOptions(rate=-1.0), "--rate"),
        (ReadOptions(columns={"ax": "nothing"}), "nothing"),
        (ReadOptions(columns={"bx": "ax"}), "--columns"),
        (ReadOptions(topic="imu7"), "imu7"),
    ],
)
def test_an_option_that_makes_no_sense_is_named(tmp_path, options, word):
    assert word in refusal(write_text(tmp_path / "log.csv", made_up()), options)


def test_a_rate_replaces_the_time_of_the_log(tmp_path):
    path = write_text(tmp_path / "log.csv", made_up(temperature=False))
    assert np.array_equal(read(path, ReadOptions(rate=50.0)).time, np.arange(2000) / 50.0)


@given(
    direction=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    length=st.floats(0.1, 1e4),
)
def test_length_at_rest_depends_on_neither_direction_nor_later_motion(direction, length):
    still = np.tile(np.array(direction) / np.linalg.norm(direction) * length, (400, 1))
    shaken = still + length * np.random.default_rng(3).normal(0.0, 1.0, still.shape)
    assert rest_norm(np.vstack([still, shaken])) == pytest.approx(length, rel=1e-9)


@pytest.mark.parametrize(("length", "unit"), [(9.80665, "m/s^2"), (1.0, "g")])
def test_columns_of_a_gyroscope_that_hold_gravity_are_named(tmp_path, length, unit):
    values = np.random.default_rng(3).normal([0.0, 0.01, 1.0], 0.001, (1000, 3)) * length
    rows = "".join(f"{k / 100:.2f},{x!r},{y!r},{z!r}\n" for k, (x, y, z) in enumerate(values.tolist()))
    path = tmp_path / "log.csv"
    path.write_text("time,gx,gy,gz\n" + rows)
    remarks = " ".join(assumptions_of(path))
    assert f"the length of gravity in {unit}, and no accelerometer is recorded" in remarks
    assert "--columns ax=gx,ay=gy,az=gz" in remarks
    named = ReadOptions(columns={"ax": "gx", "ay": "gy", "az": "gz"})
    assert open_recording(path, named).metadata.triads == ("accelerometer",)


@pytest.mark.parametrize("bias", [0.01, 0.5, 1.5, 8.0])
def test_a_gyroscope_alone_with_any_bias_is_no_accelerometer(tmp_path, bias):
    values = np.random.default_rng(3).normal([0.0, 0.0, bias], 0.001, (1000, 3))
    rows = "".join(f"{k / 100:.2f},{x!r},{y!r},{z!r}\n" for k, (x, y, z) in enumerate(values.tolist()))
    path = tmp_path / "log.csv"
    path.write_text("time,gx,gy,gz\n" + rows)
    assert "length of gravity" not in " ".join(assumptions_of(path))


def assumptions_of(path):
    metadata = open_recording(path).metadata
    return [*metadata.remarks, *metadata.assumptions]
