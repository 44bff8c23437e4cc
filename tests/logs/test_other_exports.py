"""Exports of other makers' programs: read, or refused with what to export in their place."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from tumble.foundation.errors import LogError

MICROSTRAIN = (
    "DATA_START\n"
    "GPS TFlags,GPS Week,GPS TOW,X Accel [x8004],Y Accel [x8004],Z Accel [x8004],"
    "X Gyro [x8005],Y Gyro [x8005],Z Gyro [x8005]\n"
)
WITMOTION = (
    "StartTime:2022-11-10 10:17:31.102\n"
    "address\tTime(s)\tax(g)\tay(g)\taz(g)\twx(deg/s)\twy(deg/s)\twz(deg/s)\tAngleX(deg)\tT(°)\n"
)
NOVATEL = (
    "#RAWIMUSXA,COM1,0,69.5,FINESTEERING,1724,219418.009,004c0040,5b36,43495;"
    "00,11,1724,219418.008755000,00000077,64732,56,298,8,28,-3*7378486f\n"
)


def test_heads_of_microstrain_state_quantity_and_unit(tmp_path):
    path = tmp_path / "sensor.csv"
    rows = "".join(
        f"15,2100,{345600 + 0.01 * k:.2f},0.01,0.02,{-1 - 1e-4 * (k % 3)},0.1,0.2,0.3\n" for k in range(50)
    )
    path.write_text(MICROSTRAIN + rows)
    (chunk,) = tumble.open_recording(path).chunks()
    np.testing.assert_allclose(chunk.accelerometer[0], 9.80665 * np.array([0.01, 0.02, -1.0]))
    np.testing.assert_allclose(chunk.gyroscope[0], [0.1, 0.2, 0.3])
    assert np.ptp(chunk.time) == pytest.approx(0.49)


def test_temperature_of_witmotion_is_read(tmp_path):
    path = tmp_path / "witmotion.txt"
    rows = "".join(
        f"0x50\t{0.1 * k:.1f}\t0\t0.1\t{1 + 1e-3 * (k % 2)}\t1\t2\t3\t4\t28.9\n" for k in range(50)
    )
    path.write_text(WITMOTION + rows, encoding="utf-8")
    (chunk,) = tumble.open_recording(path).chunks()
    np.testing.assert_allclose(chunk.temperature, 28.9)
    np.testing.assert_allclose(chunk.gyroscope[0], np.radians([1.0, 2.0, 3.0]))


@pytest.mark.parametrize(
    ("content", "remedy"),
    [
        (NOVATEL.encode(), "NovAtel Convert"),
        (b"\xaa\x44\x12\x1c\x0c\x01\x00\xc0" + bytes(200), "NovAtel Convert"),
        ((b"\x55\x51" + bytes(8) + b"\xae") * 30, "WitMotion's program"),
    ],
)
def test_own_formats_of_makers_get_the_export_to_make(tmp_path, content, remedy):
    path = tmp_path / "log.bin.txt"
    path.write_bytes(content)
    with pytest.raises(LogError, match=remedy) as refused:
        tumble.open_recording(path)
    assert "\n" not in str(refused.value)
