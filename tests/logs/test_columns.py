"""Names of columns as people write them."""

from __future__ import annotations

import numpy as np
import pytest

from log_fixtures import made_up, read, same, write_text
from tumble.foundation.errors import LogError
from tumble.logs import ReadOptions, list_imus, open_recording
from tumble.logs.columns import find_imus, recognise

TRIADS = [
    ("ax,ay,az", None),
    ("acc_x,acc_y,acc_z", None),
    ("accel_x,accel_y,accel_z", None),
    ("accelerometer_x,accelerometer_y,accelerometer_z", None),
    ("accelerometer.x,accelerometer.y,accelerometer.z", None),
    ("linear_acceleration.x,linear_acceleration.y,linear_acceleration.z", None),
    ("AccX,AccY,AccZ", None),
    ("xacc,yacc,zacc", None),
    ("ax [g],ay [g],az [g]", "g"),
    ("Acc X (m/s²),Acc Y (m/s²),Acc Z (m/s²)", "m/s^2"),
    ("acc_x_g,acc_y_g,acc_z_g", "g"),
    ("accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2]", "m/s^2"),
    ("accel_g_x,accel_g_y,accel_g_z", "g"),
    ("ax_mg,ay_mg,az_mg", "mg"),
]
GYROSCOPES = [
    ("gx,gy,gz", None),
    ("wx,wy,wz", None),
    ("gyr_x,gyr_y,gyr_z", None),
    ("gyro_x_dps,gyro_y_dps,gyro_z_dps", "deg/s"),
    ("angular_velocity.x,angular_velocity.y,angular_velocity.z", None),
    ("GyrX,GyrY,GyrZ", None),
    ("gyro_rad[0],gyro_rad[1],gyro_rad[2]", "rad/s"),
    ("gyroscope x [deg/s],gyroscope y [deg/s],gyroscope z [deg/s]", "deg/s"),
]


@pytest.mark.parametrize(("names", "unit"), TRIADS)
def test_a_name_of_an_accelerometer_tells_axis_and_unit(names, unit):
    columns = [recognise(name) for name in names.split(",")]
    assert [(column.quantity, column.axis, column.imu, column.unit) for column in columns] == [
        ("accelerometer", axis, "", unit) for axis in range(3)
    ]


@pytest.mark.parametrize(("names", "unit"), GYROSCOPES)
def test_a_name_of_a_gyroscope_tells_axis_and_unit(names, unit):
    columns = [recognise(name) for name in names.split(",")]
    assert [(column.quantity, column.axis, column.imu, column.unit) for column in columns] == [
        ("gyroscope", axis, "", unit) for axis in range(3)
    ]


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("time", None),
        ("t", None),
        ("time_s", "s"),
        ("timestamp", None),
        ("timestamp_us", "us"),
        ("TimeUS", "us"),
        ("time (ms)", "ms"),
        ("seconds_elapsed", None),
        ("usec", "us"),
        ("Time [ns]", "ns"),
    ],
)
def test_a_name_of_time_tells_its_unit(name, unit):
    column = recognise(name)
    assert (column.quantity, column.imu, column.unit) == ("time", "", unit)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("temp", None),
        ("temperature", None),
        ("temperature_degc", "degC"),
        ("imu_temp", None),
        ("temp_f", "degF"),
    ],
)
def test_a_name_of_temperature_tells_its_unit(name, unit):
    column = recognise(name)
    assert (column.quantity, column.imu, column.unit) == ("temperature", "", unit)


@pytest.mark.parametrize("name", ["imu1_ax", "imu1.ax", "imu1/acc_x", "imu1 accel_x", "imu1:ax"])
def test_prefix_of_a_known_name_is_the_imu(name):
    assert recognise(name).imu == "imu1"


@pytest.mark.parametrize(
    "name", ["magnitude_x", "orientation.x", "gravity_x", "n_samples", "flag", "status", "x", "", "quality"]
)
def test_other_columns_are_not_taken_for_ours(name):
    assert recognise(name) is None


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " ", "   "])
def test_a_table_reads_the_same_whatever_splits_its_fields(tmp_path, delimiter):
    chunk = made_up(temperature=False)
    header = delimiter.join(["time", "ax", "ay", "az", "gx", "gy", "gz"])
    path = write_text(tmp_path / "log.txt", chunk, header=header, delimiter=delimiter)
    assert same(read(path), chunk)


def test_a_table_with_decimal_commas_reads_the_same(tmp_path):
    chunk = made_up(200, temperature=False)
    path = write_text(tmp_path / "log.csv", chunk, header="time;ax;ay;az;gx;gy;gz", delimiter=";")
    path.write_text(path.read_text().replace(".", ","))
    assert same(read(path), chunk)


def test_line_endings_quotes_and_a_byte_order_mark_change_nothing(tmp_path):
    chunk = made_up(200, temperature=False)
    path = write_text(tmp_path / "log.csv", chunk, header='"time","ax","ay","az","gx","gy","gz"')
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert same(read(path), chunk)


def test_blank_lines_are_passed_over(tmp_path):
    chunk = made_up(200, temperature=False)
    path = write_text(tmp_path / "log.csv", chunk)
    path.write_text(path.read_text().replace("\n", "\n\n"))
    assert same(read(path), chunk)


def test_a_table_without_names_is_time_and_six_channels(tmp_path):
    chunk = made_up(300, temperature=False)
    path = write_text(tmp_path / "log.csv", chunk, header="")
    recording = open_recording(path)
    assert same(read(path), chunk)
    assert "no column names: assumed to be time, ax, ay, az, gx, gy, gz" in recording.metadata.remarks


def test_columns_can_be_named_by_the_user(tmp_path):
    chunk = made_up(300, temperature=False)
    path = write_text(tmp_path / "log.csv", chunk, header="when,u,v,w,p,q,r")
    columns = dict(
        zip(("time", "ax", "ay", "az", "gx", "gy", "gz"), ["when", "u", "v", "w", "p", "q", "r"], strict=True)
    )
    assert same(read(path, ReadOptions(columns=columns)), chunk)


def test_columns_can_be_given_by_position(tmp_path):
    chunk = made_up(300, temperature=False)
    path = write_text(tmp_path / "log.csv", chunk, header="")
    columns = {"time": "1", "ax": "3", "ay": "2", "az": "4", "gx": "5", "gy": "6", "gz": "7"}
    swapped = read(path, ReadOptions(columns=columns))
    assert np.array_equal(swapped.accelerometer, chunk.accelerometer[:, [1, 0, 2]])


def test_lines_before_the_names_are_skipped_and_reported(tmp_path):
    chunk = made_up(300, temperature=False)
    path = write_text(tmp_path / "log.csv", chunk)
    path.write_text("Device,IMU 7\nFirmware,1.2\n" + path.read_text())
    assert same(read(path), chunk)
    assert "skipped 2 lines before the column names" in open_recording(path).metadata.remarks


def test_skip_lines_passes_over_a_row_of_names_that_are_wrong(tmp_path):
    chunk = made_up(300, temperature=False)
    path = write_text(tmp_path / "log.csv", chunk, header="time,gx,gy,gz,ax,ay,az")
    assert same(read(path, ReadOptions(skip_lines=1)), chunk)


def test_a_rate_before_the_columns_stands_in_for_time(tmp_path):
    chunk = made_up(400, rate=50.0, temperature=False)
    rows = "\n".join(
        ",".join(repr(float(value)) for value in row)
        for row in np.hstack([chunk.accelerometer, chunk.gyroscope])
    )
    path = tmp_path / "log.csv"
    path.write_text(f"Fs,50\nax,ay,az,gx,gy,gz\n{rows}\n")
    assert same(read(path), chunk)
    assert open_recording(path).metadata.rate == 50.0


def test_a_time_of_date_and_clock_is_read_in_seconds(tmp_path):
    path = tmp_path / "log.csv"
    rows = [f"2024-05-01T12:00:{second:06.3f},0,0,9.8,0,0,0" for second in np.arange(0.0, 2.0, 0.01)]
    path.write_text("timestamp,ax,ay,az,gx,gy,gz\n" + "\n".join(rows) + "\n")
    time = read(path).time
    assert np.allclose(np.diff(time), 0.01, atol=1e-6)
    assert time[0] == 1714564800.0


@pytest.mark.parametrize("prefix", ["imu{}_", "imu{}.", "imu{}/", "imu{} "])
def test_a_prefix_picks_one_of_several_imus(tmp_path, prefix):
    chunks = [made_up(300, seed=seed, temperature=False) for seed in (1, 2)]
    names = [prefix.format(i) + channel for i in (1, 2) for channel in ("ax", "ay", "az", "gx", "gy", "gz")]
    table = np.column_stack(
        [chunks[0].time, *(part for c in chunks for part in (c.accelerometer, c.gyroscope))]
    )
    path = tmp_path / "array.csv"
    rows = [",".join(repr(float(value)) for value in row) for row in table]
    path.write_text("\n".join([",".join(["time", *names]), *rows]) + "\n")
    assert list_imus(path) == ("imu1", "imu2")
    for number, chunk in enumerate(chunks, start=1):
        assert same(read(f"{path}:imu{number}"), chunk)
        assert same(read(path, ReadOptions(topic=f"imu{number}")), chunk)
    first, second = (open_recording(f"{path}:imu{number}").metadata for number in (1, 2))
    assert first.clock == second.clock != ""
    assert (first.name, second.name) == ("array-imu1", "array-imu2")


def test_a_path_with_a_colon_is_taken_whole(tmp_path):
    chunk = made_up(300, temperature=False)
    path = write_text(tmp_path / "run:imu1.csv", chunk)
    assert same(read(path), chunk)


def test_a_line_without_end_is_no_table(tmp_path):
    path = tmp_path / "dashes.csv"
    path.write_text("- " * 100_000)
    with pytest.raises(LogError):
        open_recording(path)


@pytest.mark.parametrize(
    ("names", "channel"),
    [
        ("acc_x,accel_x,ay,az,gx,gy,gz", "ax"),
        ("ax,ay,az,gx,gy,gz,gyro_z", "gz"),
        ("ax_g,ax_mg,ay,az,gx,gy,gz", "ax"),
        ("ax,ay,az,gx,gy,gz,temp,temperature", "temperature"),
        ("ax,ay,az,gx,gy,gz,mx,my,mz,mag_y", "my"),
        ("u1_ax,u1_accel_x,u1_ay,u1_az,u1_gx,u1_gy,u1_gz", "ax"),
        ("ax,ax,ay,az,gx,gy,gz", "ax"),
    ],
)
def test_two_columns_for_one_channel_are_refused(names, channel):
    columns = ["time", *names.split(",")]
    with pytest.raises(LogError, match=f"may each be {channel}; name one, as --columns {channel}="):
        find_imus(columns, "log.csv")


@pytest.mark.parametrize("chosen", ["acc_x", "accel_x"])
def test_the_column_that_is_stated_is_read(tmp_path, chosen):
    chunk = made_up(200, temperature=False)
    header = "time,acc_x,ay,az,gx,gy,gz,accel_x"
    path = write_text(tmp_path / "log.csv", chunk, header="time,ax,ay,az,gx,gy,gz")
    lines = path.read_text().splitlines()
    path.write_text("\n".join([header, *(f"{line},0.5" for line in lines[1:])]) + "\n")
    with pytest.raises(LogError, match="acc_x, accel_x may each be ax"):
        read(path)
    found = read(path, ReadOptions(columns={"ax": chosen}))
    assert (found.accelerometer[:, 0] == 0.5).all() == (chosen == "accel_x")


def test_columns_of_time_and_of_other_sensors_are_no_doubt():
    names = "time,timestamp,ax,ay,az,gx,gy,gz,baro_temp,mag_time,low_ax,low_accel_x"
    assert find_imus(names.split(","), "log.csv")[""].accelerometer == ("ax", "ay", "az")
