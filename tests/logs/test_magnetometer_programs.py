"""Magnetometers in the texts of phones, programs and boards."""

from pathlib import Path

import numpy as np
import pytest

from tumble.logs import ReadOptions, open_recording

ROWS = 60
FIELD = np.round(np.array([20.0, -5.0, 42.0]) + np.random.default_rng(34).normal(0, 5.0, (ROWS, 3)), 3)
STILL = (0.01, -0.02, 9.81), (0.001, 0.002, -0.003)


def lines(path: Path, head: str, row, rows: int = ROWS) -> Path:
    path.write_text(head + "".join(f"{row(number, *FIELD[number].tolist())}\n" for number in range(rows)))
    return path


def triad_files(folder: Path, head: str, names: dict[str, tuple[float, float, float] | None], step: float):
    """Writes a file a sensor; that without a reading is the magnetometer, at a fifth of the rate."""
    for name, reading in names.items():
        every = 1 if reading else 5
        texts = [
            f"{number * every * step:.12g},{','.join(map(str, reading or FIELD[number]))}"
            for number in range(ROWS // every)
        ]
        (folder / name).write_text(head.replace("SENSOR", name.split(".")[0]) + "\n".join(texts) + "\n")
    return folder


def phyphox(folder: Path) -> Path:
    files = {"Accelerometer.csv": STILL[0], "Gyroscope.csv": STILL[1], "Magnetometer.csv": None}
    return triad_files(folder, '"Time (s)","X (µT)","Y (µT)","Z (µT)"\n'.replace(" (µT)", ""), files, 0.01)


def metawear(folder: Path) -> Path:
    for sensor, unit, reading in (
        ("Accelerometer", "g", (0.0, 0.0, 1.0)),
        ("Gyroscope", "deg/s", (0.1, 0.2, 0.3)),
        ("Magnetometer", "T", None),
    ):
        head = f"epoch (ms),time (+00:00),elapsed (s),x-axis ({unit}),y-axis ({unit}),z-axis ({unit})\n"
        rows = [
            f"{1_600_000_000_000 + 10 * number},2020-09-13T12:26:40.{10 * number:03d},{0.01 * number:.3f},"
            + ",".join(f"{value:.9g}" for value in reading or 1e-6 * FIELD[number])
            for number in range(ROWS)
        ]
        (folder / f"a_{sensor}_100.000Hz_1.4.4.csv").write_text(head + "\n".join(rows) + "\n")
    return folder / "a_Accelerometer_100.000Hz_1.4.4.csv"


def vectornav(folder: Path) -> Path:
    def sentence(number: int, x: float, y: float, z: float) -> str:
        field = ",".join(f"{axis / 100:.5f}" for axis in (x, y, z))
        body = f"VNIMU,{field},0.010,-0.020,-9.810,0.001,0.002,0.003,25.0,101.3"
        check = 0
        for byte in body.encode():
            check ^= byte
        return f"{0.025 * number:.3f},${body}*{check:02X}"

    return lines(folder / "vn.txt", "", sentence)


def xsens(folder: Path) -> Path:
    channels = ",".join(f"{triad}_{axis}" for triad in ("Acc", "Gyr", "Mag") for axis in "XYZ")
    head = f"// Update Rate: 100.0Hz\nPacketCounter,SampleTimeFine,{channels}\n"
    return lines(
        folder / "MT_1.txt",
        head,
        lambda number, *field: ",".join(
            map(str, ((65530 + number) % 65536, 100 * number, *STILL[0], *STILL[1], *field))
        ),
    )


def sensorlog(folder: Path) -> Path:
    names = [
        f"{sensor}{axis}({unit})"
        for sensor, unit in (
            ("accelerometerAcceleration", "G"),
            ("gyroRotation", "rad/s"),
            ("magnetometer", "µT"),
        )
        for axis in "XYZ"
    ]
    return lines(
        folder / "log.csv",
        "accelerometerTimestamp_sinceReboot(s)," + ",".join(names) + "\n",
        lambda number, *field: ",".join(map(str, (0.01 * number, 0, 0, -1, 0.001, 0.002, 0.003, *field))),
    )


def plotter(folder: Path) -> Path:
    return lines(
        folder / "plot.txt",
        "",
        lambda number, x, y, z: (
            f"AccX:0.01,AccY:0.02,AccZ:1.0,GyroX:0.1,GyroY:0.2,GyroZ:0.3,MagX:{x},MagY:{y},MagZ:{z}"
        ),
    )


def adafruit(folder: Path) -> Path:
    def sample(_: int, x: float, y: float, z: float) -> str:
        return (
            "Accel X: 0.01 \tY: 0.02 \tZ: 9.81 m/s^2\nGyro X: 0.01 \tY: 0.02 \tZ: 0.03 radians/s\n"
            f"Mag X: {x} \tY: {y} \tZ: {z} uT"
        )

    return lines(folder / "adafruit.txt", "", sample)


@pytest.mark.parametrize("write", [phyphox, metawear, vectornav, xsens, sensorlog, plotter, adafruit])
def test_magnetometer_stands_in_texts_of_programs(tmp_path: Path, write) -> None:
    timed = write not in (plotter, adafruit)
    options = ReadOptions(rate=None if timed else 20.0, gyroscope_unit="deg/s" if write is plotter else None)
    found = open_recording(write(tmp_path), options).magnetic
    assert found is not None
    every = 5 if write is phyphox else 1
    tolerance = 1e-3 if write is vectornav else 1e-9
    np.testing.assert_allclose(found.field, FIELD[: len(found)], atol=tolerance)
    assert len(found) == ROWS // every
    step = {vectornav: 0.025, plotter: 0.05, adafruit: 0.05}.get(write, 0.01) * every
    np.testing.assert_allclose(np.diff(found.time), step, atol=1e-6)
