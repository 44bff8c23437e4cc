"""Recordings of others: a result near the published one, or why there is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import tumble

DATA = Path(__file__).parents[3] / "shared" / "data"

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the recordings in ../shared/data are not here")

PUBLISHED = {
    "imu0": ((0.363, 0.315, 0.647), (0.103, 0.097, 0.344)),
    "imu1": ((0.471, 0.482, 0.932), (0.090, 0.070, 0.338)),
}
"""Published values of mpu9150: correction of scale in %, bias in m/s^2."""


def loaded(name, time, force, rate):
    return tumble.Recording.from_arrays(name, time, force, rate)


def test_counts_of_a_known_unit_give_its_published_scale_and_bias():
    found = tumble.multipose(DATA / "xsens" / "xsens_acc.mat", raw=True, g_sensitivity=True, gravity=9.81744)
    counts = found.nominal_scale.accelerometer
    scale = np.diag(found.accelerometer.K) * counts
    assert np.allclose(scale, [414.46, 412.01, 414.65], atol=0.2)
    assert np.allclose(found.accelerometer.b * counts, [33124.2, 33275.2, 32364.4], atol=2.0)
    rate_scale = np.diag(found.gyroscope.K) * found.nominal_scale.gyroscope
    assert np.allclose(rate_scale, [4777.9, 4764.2, 4773.7], rtol=5e-3)
    assert found.norm_after < 0.0012
    assert np.degrees(found.angle_after) < 0.2


def test_a_gyroscope_that_feels_gravity_is_found_out():
    found = tumble.multipose(DATA / "xsens" / "xsens_acc.mat", raw=True)
    assert any("with --g-sensitivity" in line for line in found.warnings)


@pytest.mark.parametrize("unit", PUBLISHED)
def test_units_that_others_calibrated_come_out_as_published(unit):
    columns = np.loadtxt(DATA / "mpu9150" / f"{unit}.log")
    recording = loaded(unit, np.arange(len(columns)) / 100.0, columns[:, :3], columns[:, 3:])
    found = tumble.multipose(recording, gravity=9.81)
    scale, bias = PUBLISHED[unit]
    assert np.allclose(100.0 * (np.diag(found.accelerometer.K) - 1.0), scale, atol=0.03)
    assert np.allclose(found.accelerometer.b, bias, atol=0.003)
    assert found.norm_after < 0.0033
    assert np.degrees(found.angle_after) < 0.07


def test_every_unit_of_a_board_is_calibrated_alone():
    table = pq.read_table(DATA / "mimu4444" / "exp_3.parquet").to_pandas()
    for unit in (1, 8):
        force, rate = (table[[f"imu{unit}_{kind}{axis}" for axis in "xyz"]].to_numpy(float) for kind in "ag")
        found = tumble.multipose(
            loaded(f"imu{unit}", table["time"].to_numpy(float), force, rate), gravity=9.81
        )
        assert found.directions == 20
        assert 0.0005 < found.norm_after < 0.0055
        assert np.degrees(found.angle_after) < 0.5


def test_six_faces_are_refused():
    columns = np.loadtxt(DATA / "imucal" / "example_ferraris_session.csv", delimiter=",", skiprows=1)
    recording = loaded("faces", np.arange(len(columns)) / 102.4, columns[:, 4:7], np.radians(columns[:, 1:4]))
    with pytest.raises(tumble.ProcedureError, match="shows 6 orientations"):
        tumble.multipose(recording)


@pytest.mark.parametrize(
    ("name", "seen"), [("calibration", "add poses across it"), ("static_449s", "one orientation only")]
)
def test_too_few_poses_are_refused(name, seen):
    columns = np.loadtxt(DATA / "mpu6050" / f"{name}.csv", delimiter=",", skiprows=5)
    force, rate = columns[:, :3] / 16384 * 9.80665, np.radians(columns[:, 3:] / 131)
    with pytest.raises(tumble.ProcedureError, match=seen):
        tumble.multipose(loaded(name, np.arange(len(columns)) / 100.0, force, rate))
