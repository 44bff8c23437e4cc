"""Logs in the formats of others, written from samples by the documentation of each."""

from __future__ import annotations

from datetime import datetime, timezone
from functools import reduce

import numpy as np

from tumble.foundation.recording import Chunk
from tumble.logs import ReadOptions

EPOCH_NS = 1_403_636_579_758_555_392
STANDARD_GRAVITY = 9.80665


def stamps(chunk):
    """Times as whole ns since 1970, and as the seconds that a reader has to give for them."""
    nanoseconds = [EPOCH_NS + round(float(time) * 1e9) for time in chunk.time]
    return nanoseconds, np.array([each / 1e9 for each in nanoseconds])


def _rows(*columns, delimiter=","):
    table = np.column_stack([column for column in columns if np.ndim(column)])
    return [delimiter.join(repr(value) for value in row) for row in table.tolist()]


def _at(chunk, time):
    return Chunk(np.asarray(time), chunk.accelerometer, chunk.gyroscope)


def euroc(folder, chunk, imu="imu0", sensor=None):
    place = folder / "mav0" / imu
    place.mkdir(parents=True)
    nanoseconds, time = stamps(chunk)
    names = [f"w_RS_S_{axis} [rad s^-1]" for axis in "xyz"] + [f"a_RS_S_{axis} [m s^-2]" for axis in "xyz"]
    rows = _rows(chunk.gyroscope, chunk.accelerometer)
    lines = [f"{stamp},{row}" for stamp, row in zip(nanoseconds, rows, strict=True)]
    (place / "data.csv").write_text(
        "#timestamp [ns]," + ",".join(names) + "\r\n" + "\r\n".join(lines) + "\r\n"
    )
    if sensor is not None:
        (place / "sensor.yaml").write_text(sensor)
    return folder / "mav0", ReadOptions(), _at(chunk, time)


def tum_vi(folder, chunk):
    (folder / "dso").mkdir()
    nanoseconds, time = stamps(chunk)
    rows = _rows(chunk.gyroscope, chunk.accelerometer, delimiter=" ")
    lines = [f"{stamp} {row}" for stamp, row in zip(nanoseconds, rows, strict=True)]
    (folder / "dso" / "imu.txt").write_text(
        "# timestamp[ns] w.x w.y w.z a.x a.y a.z\n" + "\n".join(lines) + "\n"
    )
    return folder / "dso", ReadOptions(), _at(chunk, time)


def kitti(folder, chunk):
    data = folder / "2011_09_26_drive_0001_extract" / "oxts" / "data"
    data.mkdir(parents=True)
    nanoseconds, time = stamps(chunk)
    lines = []
    for number, stamp in enumerate(nanoseconds):
        when = datetime.fromtimestamp(stamp // 10**9, timezone.utc).strftime("%Y-%m-%d %H:%M:%S")
        lines.append(f"{when}.{stamp % 10**9:09d}\n")
        force, rate = chunk.accelerometer[number].tolist(), chunk.gyroscope[number].tolist()
        fields = [
            49.0,
            8.4,
            116.0,
            *[0.01] * 3,
            *[0.5] * 5,
            *force,
            *[7.0] * 3,
            *rate,
            *[7.0] * 3,
            0.1,
            0.2,
            4,
            9,
            5,
            6,
            7,
        ]
        (data / f"{number:010d}.txt").write_text(" ".join(map(repr, fields)) + "\n")
    (data.parent / "timestamps.txt").write_text("".join(lines))
    return data.parent, ReadOptions(), _at(chunk, time)


def rpg(folder, chunk):
    path = folder / "imu.txt"
    rows = _rows(chunk.time, chunk.gyroscope, chunk.accelerometer, delimiter=" ")
    names = "# timestamp ang_vel_x ang_vel_y ang_vel_z lin_acc_x lin_acc_y lin_acc_z"
    path.write_text("\n".join([names, *rows]) + "\n")
    return path, ReadOptions(), _at(chunk, chunk.time)


def rpg_without_names(folder, chunk):
    path, options, expected = rpg(folder, chunk)
    path.write_text(path.read_text().partition("\n")[2])
    return path, options, expected


def sentence(text):
    return f"${text}*{reduce(lambda left, right: left ^ right, text.encode()):02X}\r\n"


def sixteen_bits(text):
    """CRC of VectorNav, as its manual spells it in C."""
    crc = 0
    for byte in text.encode():
        crc = ((crc >> 8) | (crc << 8)) & 0xFFFF
        crc ^= byte
        crc ^= (crc & 0xFF) >> 4
        crc ^= (crc << 12) & 0xFFFF
        crc ^= ((crc & 0xFF) << 5) & 0xFFFF
    return f"${text}*{crc:04X}\r\n"


def vectornav(folder, chunk, header="VNIMU", seal=sentence, prefix=lambda number: "", extra=""):
    """Registers 54, 27, 15 and 20; what is uncompensated ends with temperature and pressure."""
    before = {"VNIMU": 3, "VNRRG,54": 3, "VNYMR": 6, "VNRRG,27": 6, "VNQMR": 7, "VNMAR": 3}[header]
    after = ",+24.5,+101.3" if before == 3 and header != "VNMAR" else ""
    force, rate = np.round(chunk.accelerometer, 3), np.round(chunk.gyroscope, 6)
    path = folder / "vn100.txt"
    with path.open("w", newline="") as file:
        for number in range(len(chunk)):
            values = ",".join(
                [
                    *(f"{value:+07.3f}" for value in force[number]),
                    *(f"{value:+09.6f}" for value in rate[number]),
                ]
            )
            text = f"{header}," + "+00.1000," * before + values + after + extra
            file.write(prefix(number) + seal(text))
    time = np.arange(len(chunk)) / 200.0
    degrees = np.full(len(chunk), 24.5) if after else None
    return path, ReadOptions(rate=200.0), Chunk(time, force, rate, degrees)


def xsens(
    folder, chunk, counter=lambda number: (number + 65_000) % 65_536, fine=None, head=None, delimiter="\t"
):
    path = folder / "MT_0120067F-000.txt"
    first = (
        "// Start Time: Unknown\n// Update Rate: 100.0Hz\n// Filter Profile: human (46.1)\n"
        "// Option Flags: AHS Disabled ICC Disabled \n// Firmware Version: 4.0.2\n"
    )
    names = ["PacketCounter", "SampleTimeFine", "Year", "Second", *(f"Acc_{axis}" for axis in "XYZ")]
    names += [*(f"FreeAcc_{axis}" for axis in "XYZ"), *(f"Gyr_{axis}" for axis in "XYZ"), "Mat[1][1]"]
    lines = [delimiter.join(names)]
    for number, row in enumerate(np.column_stack([chunk.accelerometer, chunk.gyroscope]).tolist()):
        stamp = "" if fine is None else str(fine(number))
        fields = [
            str(counter(number)),
            stamp,
            "",
            "",
            *map(repr, row[:3]),
            "0.1",
            "0.1",
            "0.1",
            *map(repr, row[3:]),
            "1.0",
        ]
        lines.append(delimiter.join(fields))
    path.write_text((first if head is None else head) + "\n".join(lines) + "\n")
    return path, ReadOptions(), _at(chunk, (65_000 + np.arange(len(chunk))) / 100.0)


def xsens_dot(folder, chunk):
    head = "sep=,\nDeviceTag:,Xsens DOT,\nOutputRate:,60Hz\n"
    turned = _at(chunk, chunk.time)
    turned.gyroscope[:] = np.rad2deg(chunk.gyroscope)
    fine = [4_294_000_000 + 16_667 * number for number in range(len(chunk))]
    path, options, _ = xsens(
        folder, turned, lambda number: number + 1, lambda number: fine[number] % 2**32, head, ","
    )
    return path, options, Chunk(np.array(fine) / 1e6, chunk.accelerometer, np.deg2rad(turned.gyroscope))


def rostopic(folder, chunk):
    path = folder / "imu.csv"
    nanoseconds, time = stamps(chunk)
    covariance = {
        name: [f"field.{name}_covariance{number}" for number in range(9)]
        for name in ("orientation", "angular_velocity", "linear_acceleration")
    }
    names = ["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id"]
    names += [f"field.orientation.{axis}" for axis in "xyzw"] + covariance["orientation"]
    names += [f"field.angular_velocity.{axis}" for axis in "xyz"] + covariance["angular_velocity"]
    names += [f"field.linear_acceleration.{axis}" for axis in "xyz"] + covariance["linear_acceleration"]
    lines, nine = [",".join(names)], "0.0," * 8 + "0.0"
    for number, stamp in enumerate(nanoseconds):
        rate, force = (
            ",".join(map(repr, values[number].tolist())) for values in (chunk.gyroscope, chunk.accelerometer)
        )
        lines.append(
            f"{stamp + 7_000_000 + number % 5},{number},{stamp},imu_link,0.0,0.0,0.0,1.0,"
            f"{nine},{rate},{nine},{force},{nine}"
        )
    path.write_text("\n".join(lines) + "\n")
    return path, ReadOptions(), _at(chunk, time)


def ros2_topic(folder, chunk):
    path = folder / "imu.csv"
    nanoseconds, time = stamps(chunk)
    lines, nine = [], "0.0," * 8 + "0.0"
    for number, stamp in enumerate(nanoseconds):
        rate, force = (
            ",".join(map(repr, values[number].tolist())) for values in (chunk.gyroscope, chunk.accelerometer)
        )
        lines.append(
            f"{stamp // 10**9},{stamp % 10**9},imu_link,0.0,0.0,0.0,1.0,{nine},{rate},{nine},{force},{nine}"
        )
    path.write_text("\n".join(lines) + "\n")
    return path, ReadOptions(), _at(chunk, time)


def _table(path, names, *columns, delimiter=",", before="", newline="\n"):
    path.write_text(
        before + newline.join([delimiter.join(names), *_rows(*columns, delimiter=delimiter)]) + newline
    )
    return path


def sensorlog(folder, chunk):
    names = [
        "accelerometerTimestamp_sinceReboot(s)",
        *(f"accelerometerAcceleration{axis}(G)" for axis in "XYZ"),
    ]
    names += ["motionYaw(rad)", *(f"gyroRotation{axis}(rad/s)" for axis in "XYZ")]
    path = _table(
        folder / "log.csv",
        names,
        chunk.time,
        -chunk.accelerometer / STANDARD_GRAVITY,
        0.0 * chunk.time,
        chunk.gyroscope,
    )
    return path, ReadOptions(), _at(chunk, chunk.time)


def androsensor(folder, chunk):
    names = [f"ACCELEROMETER {axis} (m/s²)" for axis in "XYZ"] + [f"GRAVITY {axis} (m/s²)" for axis in "XYZ"]
    names += [f"LINEAR ACCELERATION {axis} (m/s²)" for axis in "XYZ"] + [
        f"GYROSCOPE {axis} (rad/s)" for axis in "XYZ"
    ]
    names += ["LIGHT (lux)", "Time since start in ms "]
    force = chunk.accelerometer
    path = _table(
        folder / "log.csv",
        names,
        force,
        force,
        0.0 * force,
        chunk.gyroscope,
        chunk.time,
        1e3 * chunk.time,
        delimiter=";",
    )
    return path, ReadOptions(), _at(chunk, chunk.time)


def physics_toolbox(folder, chunk):
    names = ["time", "gFx", "gFy", "gFz", "ax", "ay", "az", "wx", "wy", "wz", "Bx"]
    force = chunk.accelerometer / STANDARD_GRAVITY
    path = _table(folder / "log.csv", names, chunk.time, force, 0.0 * force, chunk.gyroscope, chunk.time)
    return path, ReadOptions(), _at(chunk, chunk.time)


def betaflight(folder, chunk, raw=False):
    units = ("", "") if raw else (" (deg/s)", " (g)")
    names = [
        "loopIteration",
        " time (us)",
        " axisP[0]",
        *(f" gyroADC[{axis}]{units[0]}" for axis in range(3)),
    ]
    names += [f" accSmooth[{axis}]{units[1]}" for axis in range(3)] + [" flightModeFlags (flags)"]
    counts = 2048.0 if raw else 1.0
    lines = [",".join(names)]
    rows = np.column_stack(
        [1e6 * chunk.time, np.rad2deg(chunk.gyroscope), counts * chunk.accelerometer / STANDARD_GRAVITY]
    )
    for number, row in enumerate(rows.tolist()):
        lines.append(f"{number}, {row[0]!r},  -1, " + ", ".join(map(repr, row[1:])) + ", ANGLE_MODE")
    path = folder / "LOG00007.01.csv"
    path.write_text("\n".join(lines) + "\n")
    if raw:
        (folder / "LOG00007.01.headers.csv").write_text('"fieldname","fieldvalue"\n"acc_1G","2048"\n')
    return path, ReadOptions(), _at(chunk, chunk.time)


def betaflight_raw(folder, chunk):
    return betaflight(folder, chunk, raw=True)


def sensor_logger(folder, chunk, shift=0):
    nanoseconds, time = stamps(chunk)
    for name, triad, offset in (
        ("TotalAcceleration", chunk.accelerometer, 0),
        ("Gyroscope", chunk.gyroscope, shift),
    ):
        rows = _rows(chunk.time, triad[:, ::-1])
        lines = [f"{stamp + offset},{row}" for stamp, row in zip(nanoseconds, rows, strict=True)]
        (folder / f"{name}.csv").write_text("time,seconds_elapsed,z,y,x\n" + "\n".join(lines) + "\n")
    return folder, ReadOptions(), _at(chunk, time)


def phyphox(folder, chunk):
    for name, triad, unit in (
        ("Accelerometer", chunk.accelerometer, "m/s^2"),
        ("Gyroscope", chunk.gyroscope, "rad/s"),
    ):
        names = ['"Time (s)"', *(f'"{axis} ({unit})"' for axis in "XYZ")]
        _table(folder / f"{name}.csv", names, chunk.time, triad)
    return folder, ReadOptions(), _at(chunk, chunk.time)


def phyphox_in_degrees(folder, chunk):
    """Names and units as in adtngrha/Dataset-Phypox-, Accelerometer.csv and Gyroscope.csv."""
    for name, triad, names in (
        ("Accelerometer", chunk.accelerometer, [f"Accel_{axis} (m/s^2)" for axis in "XYZ"]),
        ("Gyroscope", np.degrees(chunk.gyroscope), [f"Gyroscope {axis} (deg/s)" for axis in "xyz"]),
    ):
        _table(folder / f"{name}.csv", ["Time (s)", *names], chunk.time, triad)
    return folder, ReadOptions(), _at(chunk, chunk.time)


def metawear(folder, chunk, before="epoch (ms),time (01:00)"):
    """Names as in daveebbelaar/tracking-barbell-exercises; stamps are whole milliseconds."""
    stamps = np.round(1e3 * (chunk.time - chunk.time[0]))
    for name, values, unit, rate in (
        ("Accelerometer", chunk.accelerometer / STANDARD_GRAVITY, "g", "12.500"),
        ("Gyroscope", np.degrees(chunk.gyroscope), "deg/s", "25.000"),
    ):
        rows = _rows(1e-3 * stamps, values)
        lines = [
            f"{1547219408431 + int(stamp)},2019-01-11T16:10:{k % 60:02d}.431,{row}"
            for k, (stamp, row) in enumerate(zip(stamps, rows, strict=True))
        ]
        head = ",".join([before, "elapsed (s)", *(f"{axis}-axis ({unit})" for axis in "xyz")])
        path = folder / f"bench_MetaWear_2019-01-11T16.10.08.270_C42732BE255C_{name}_{rate}Hz_1.4.4.csv"
        path.write_text("\n".join([head, *lines]) + "\n")
    return path, ReadOptions(), _at(chunk, 1547219408.431 + 1e-3 * stamps)


def metawear_of_older_apps(folder, chunk):
    return metawear(folder, chunk, "epoc (ms),timestamp (-0700)")


def picoquake(folder, chunk):
    """Head and names as in PLab-SI/PicoQuake, sample_data/car_vibration.csv; a count for each sample."""
    rate = 100.0
    before = "\n".join(
        [
            "# PLab PicoQuake Data",
            "# Time: 2024-04-21 15:54:46.333682, Device: D4E9 (E6632891E36F2029)",
            f"# Num. samples: {len(chunk)}, Duration: {len(chunk) / rate} s",
            f"# Config: data_rate = {rate!r} Hz, filter = 488 Hz, acc_range = 4 g, gyro_range = 250.0 dps",
            "# Integrity: True, Skipped samples: 0",
            "",
        ]
    )
    count = np.arange(len(chunk))
    names = ["count", "a_x", "a_y", "a_z", "g_x", "g_y", "g_z"]
    force, turns = chunk.accelerometer / STANDARD_GRAVITY, np.degrees(chunk.gyroscope)
    path = _table(folder / "log.csv", names, count, force, turns, before=before)
    return path, ReadOptions(), _at(chunk, count / rate)


WRITERS = {
    each.__name__: each
    for each in (
        euroc, tum_vi, kitti, rpg, rpg_without_names, vectornav, xsens, xsens_dot, rostopic, ros2_topic,
        sensorlog, androsensor, physics_toolbox, betaflight, betaflight_raw, sensor_logger, phyphox,
        phyphox_in_degrees, metawear, metawear_of_older_apps, picoquake,
    )
}  # fmt: skip
FORMATS = {
    **dict.fromkeys(("rpg", "rpg_without_names", "androsensor"), "csv"),
    **dict.fromkeys(("rostopic", "ros2_topic"), "ros_echo"),
    **dict.fromkeys(("sensor_logger", "phyphox", "phyphox_in_degrees"), "phone"),
    "metawear_of_older_apps": "metawear",
    **{"tum_vi": "euroc", "xsens_dot": "xsens", "betaflight_raw": "betaflight"},
}
"""Name of the format as it is found, where it is not that of the writer."""
