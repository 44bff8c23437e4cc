"""Exports of other makers' programs: read, or refused with what to export in their place."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from log_fixtures import read
from tumble.foundation.errors import LogError
from tumble.logs import ReadOptions, open_recording

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


METADATA = "version,device name,platform,standardisation\n3,a phone,{platform},{standardised}\n"


@pytest.mark.parametrize(
    ("platform", "standardised", "sign"),
    [
        ("ios", "false", -1.0),
        ("ios", "true", 1.0),
        ("android", "false", 1.0),
        (None, None, 1.0),
        # Without a word of the app readings in g are those of iOS.
        (None, None, -1.0),
    ],
)
def test_sensor_logger_without_standard_axes_reads_minus_g(tmp_path, platform, standardised, sign):
    unit = 9.80665 if sign < 0.0 else 1.0
    for name, z in (("Accelerometer", 9.80665 * sign / unit), ("Gyroscope", 0.25)):
        rows = [f"{1_700_000_000_000_000_000 + k * 10_000_000},{k / 100},{z},0.0,0.0" for k in range(400)]
        text = "\n".join(["time,seconds_elapsed,z,y,x", *rows, ""])
        (tmp_path / f"{name}Uncalibrated.csv").write_text(text, encoding="utf-8")
    if platform:
        stated = METADATA.format(platform=platform, standardised=standardised)
        (tmp_path / "Metadata.csv").write_text(stated, encoding="utf-8")
    stated = ReadOptions(gyroscope_unit="rad/s")
    found = read(tmp_path, stated)
    assert found.accelerometer[:, 2] == pytest.approx(np.full(400, 9.80665))
    assert found.gyroscope[:, 2] == pytest.approx(np.full(400, 0.25))
    remarks = open_recording(tmp_path, stated).metadata.remarks
    assert any("sign of the accelerometer changed" in remark for remark in remarks) == (sign < 0.0)
