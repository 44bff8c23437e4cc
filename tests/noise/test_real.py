"""Recordings of others at rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tumble
from tumble.foundation.noise_terms import BIAS_INSTABILITY, RANDOM_WALK, WHITE

DATA = Path(__file__).parents[3] / "shared" / "data"

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the recordings in ../shared/data are not here")

COUNTS = tumble.ReadOptions(
    accelerometer_scale=16384.0,
    accelerometer_unit="g",
    gyroscope_scale=131.0,
    gyroscope_unit="deg/s",
)


@pytest.fixture(scope="module")
def mpu6050():
    return tumble.noise(DATA / "mpu6050" / "static_449s.csv", read=COUNTS)


def test_white_noise_of_an_mpu6050_equals_the_published_value(mpu6050):
    density = np.degrees(mpu6050.term("gyroscope", WHITE))
    assert 0.0074 < density.min() < density.max() < 0.0115
    assert all(channel.misfit == 0.0 for channel in mpu6050)


def test_seven_minutes_do_not_show_the_bias_instability_of_an_mpu6050(mpu6050):
    assert mpu6050.verdict == "partly measured"
    for channel in mpu6050:
        term = channel.term(BIAS_INSTABILITY)
        assert not term.observable
        assert "a log of" in term.reason
    assert np.isnan(mpu6050.term("accelerometer", RANDOM_WALK)).all()


def test_only_rests_of_a_wheeled_robot_are_used():
    result = tumble.noise(DATA / "husky" / "test1.bag")
    assert result.still.used < 0.1 * result.still.samples
    assert result.verdict != "measured"
    assert any("did not stand still" in line for line in result.warnings)
