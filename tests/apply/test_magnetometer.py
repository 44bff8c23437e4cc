"""The magnetometer of a log is corrected with its IMU."""

from __future__ import annotations

import numpy as np
import pytest

from exchange_units import with_current
from tumble.calibration.document import Calibration
from tumble.foundation.errors import ProcedureError
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.recording import Recording
from tumble.logs import open_recording
from tumble.tools.apply.magnetic import corrected_magnetometer
from tumble.tools.apply.procedure import apply
from turntable_sessions import typed

COUNT = 40
LACKS = "the calibration has the effect of current, which the log does not state; it is left in"


@pytest.fixture
def truth():
    return 40.0 * np.random.default_rng(8).normal(size=(COUNT, 3))


def track(calibration, truth, current, **facts):
    section = calibration.magnetometer
    field = truth @ section.M.T + section.b + current[:, np.newaxis] * section.current
    return MagneticTrack(np.linspace(0.1, 0.9, COUNT), field, current, **facts)


def recording(magnetic, temperature=None):
    time = np.linspace(0.0, 1.0, 90)
    imu = np.tile([0.0, 0.0, 9.8], (90, 1)), np.zeros((90, 3))
    return Recording.from_arrays("unit", time, *imu, temperature, magnetic=magnetic)


@pytest.mark.parametrize("kind", ["csv", "parquet", "mcap"])
def test_corrected_log_holds_the_true_field(tmp_path, truth, kind):
    calibration = with_current(8, "A")
    magnetic = track(calibration, truth, np.linspace(0.0, 20.0, COUNT))
    applied = apply(calibration, recording(magnetic), tmp_path / f"out.{kind}")
    found = open_recording(tmp_path / f"out.{kind}").magnetic
    assert found.field == pytest.approx(truth, abs=1e-9)
    assert found.time == pytest.approx(magnetic.time, abs=1e-9)
    assert not any("current" in warning for warning in applied.warnings)


def test_effect_of_a_current_that_the_log_lacks_is_reported(tmp_path, truth):
    calibration = with_current(8, "A")
    magnetic = track(calibration, truth, np.ones(COUNT), current_unit="1")
    assert LACKS in apply(calibration, recording(magnetic), tmp_path / "out.csv").warnings
    section = calibration.magnetometer
    left = corrected_magnetometer(calibration, recording(magnetic)).field - truth
    assert left == pytest.approx(np.tile(np.linalg.solve(section.M, section.current), (COUNT, 1)), abs=1e-9)


def test_magnetometer_is_corrected_at_the_temperature_of_its_imu(truth):
    drift = {"reference": 20.0, "range": [0.0, 60.0], "bias": [[0.5, 0.0, -0.2]]}
    content = with_current(8, "A").content()
    content["magnetometer"]["temperature_drift"] = drift
    calibration = Calibration.model_validate(content)
    magnetic = track(calibration, truth, np.zeros(COUNT))
    degrees = 20.0 + 30.0 * np.linspace(0.0, 1.0, 90)
    warmed = magnetic.field + 30.0 * magnetic.time[:, np.newaxis] * np.array([0.5, 0.0, -0.2])
    found = corrected_magnetometer(
        calibration, recording(MagneticTrack(magnetic.time, warmed, magnetic.current), degrees)
    )
    assert found.field == pytest.approx(truth, abs=1e-9)


def test_corrected_magnetometer_is_not_corrected_again(tmp_path, truth):
    calibration = with_current(8, "A")
    magnetic = track(calibration, truth, np.ones(COUNT), already_corrected=True)
    with pytest.raises(ProcedureError, match="was corrected already"):
        apply(calibration, recording(magnetic), tmp_path / "out.csv")


def test_live_readings_are_corrected_as_those_of_a_log(tmp_path, truth):
    calibration = with_current(8, "A")
    calibration.save(tmp_path / "unit.yaml")
    field = truth @ calibration.magnetometer.M.T + calibration.magnetometer.b
    rows = np.column_stack(
        [np.linspace(0.0, 1.0, COUNT), np.tile([0.0, 0.0, 9.8, 0.01, 0.0, 0.0], (COUNT, 1)), field]
    )
    names = "time_s,ax_mps2,ay_mps2,az_mps2,gx_radps,gy_radps,gz_radps,mx_uT,my_uT,mz_uT"
    np.savetxt(tmp_path / "unit.csv", rows, "%.17g", ",", header=names, comments="")
    source = f"replay:{tmp_path / 'unit.csv'}?speed=max"
    done = typed(
        "apply", "--live", tmp_path / "unit.yaml", source, "--to", tmp_path / "out.parquet", "--force"
    )
    assert done.code == 0, done.err
    assert open_recording(tmp_path / "out.parquet").magnetic.field == pytest.approx(truth, abs=1e-9)
    assert LACKS.replace("log", "source") in done.err
