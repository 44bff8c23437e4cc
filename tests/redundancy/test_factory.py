"""Errors from the factory: turntable calibrations that become the first stored errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from redundancy_sets import BIASED, FACING_DOWN, PRIMARY, QUICK, motion, of, record, replay, typed, units
from tumble.calibration.document import Calibration
from tumble.procedures.redundancy.factory import factory_errors
from tumble.procedures.redundancy.units import UnitSettings
from turntable_sessions import one_line

STILL = motion(moving=2.0, swing=(0.0, 0.0, 0.0), push=0.0)
SENSORS = ("accelerometer", "gyroscope")
OWN = replace(PRIMARY, accelerometer_bias=(0.03, -0.02, 0.04))


def calibration(imu, serial=""):
    """Calibration that a turntable would have given for a unit."""
    triads = {
        "accelerometer": (imu.accelerometer_scale, imu.accelerometer_bias),
        "gyroscope": (imu.gyroscope_scale, imu.gyroscope_bias),
    }
    content = {
        name: {"M": scale * np.eye(3), "b": np.array(bias), "covariance": 1e-8 * np.eye(12)}
        for name, (scale, bias) in triads.items()
    }
    return Calibration.model_validate({"name": imu.name, "serial": serial} | content)


@pytest.fixture
def typed_set(tmp_path):
    """Words for a set at rest whose units were calibrated on a turntable."""
    said = record([OWN, BIASED], 17, STILL)
    paths = [said[name].write(tmp_path / f"{name}.csv") for name in said]
    calibration(OWN).save(tmp_path / "own.yaml")
    calibration(BIASED).save(tmp_path / "found.yaml")
    own = ("--calibration", tmp_path / "own.yaml")
    return (*units(paths), *QUICK, *own, "--store", tmp_path / "kept", "-o", tmp_path / "out")


@pytest.mark.parametrize("whose", ["", "imu2="])
def test_factory_calibrated_secondary_is_not_calibrated_again(typed_set, tmp_path, whose):
    _, without = replay(*typed_set, code=None)
    assert of(without, "imu2", "triggered")
    words = (*typed_set, "--factory", f"{whose}{tmp_path / 'found.yaml'}")
    result, events = replay(*words)
    assert not of(events, "imu2", "triggered")
    assert len(of(events, "imu2", "restored")) == 2
    assert {error["sequence"] for error in result["errors"]} == {0}
    names = sorted(path.name for path in (tmp_path / "kept").iterdir())
    assert names == [
        "imu1-calibration.yaml",
        *(f"imu2-{sensor}{which}.yaml" for sensor in SENSORS for which in ("-factory", "")),
    ]
    again, events = replay(*words)
    assert len(of(events, "imu2", "restored")) == 2
    for one, other in zip(again["errors"], result["errors"], strict=True):
        np.testing.assert_allclose(one["matrix"], other["matrix"], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(
    ("corrupt", "says"),
    [
        (lambda words, found: (*words, "--factory", f"imu7={found}"), "imu7: is none of imu2"),
        (
            lambda words, found: (*words, "--factory", found, "--factory", found),
            "imu2: has two calibrations; leave one out",
        ),
        (
            lambda words, found: (*words, "--set", "largest_scale_error=0.001", "--factory", found),
            "imu2: its accelerometer is implausible",
        ),
        (lambda words, found: (*words[:-4], *words[-2:], "--factory", found), "needs --store"),
    ],
)
def test_calibration_foreign_to_the_set_is_refused_and_not_stored(typed_set, tmp_path, corrupt, says):
    done = typed("redundancy", *corrupt(typed_set, tmp_path / "found.yaml"))
    assert done.code == 2
    assert says in one_line(done.err)
    assert not list((tmp_path / "kept").glob("*"))


def test_another_error_from_the_factory_than_is_stored_is_refused(typed_set, tmp_path):
    replay(*typed_set, "--factory", tmp_path / "found.yaml")
    calibration(replace(BIASED, accelerometer_scale=1.02)).save(tmp_path / "other.yaml")
    done = typed("redundancy", *typed_set, "--factory", tmp_path / "other.yaml")
    assert done.code == 2
    assert "holds another error from the factory" in one_line(done.err)


def test_factory_error_relates_both_readings_with_both_sigmas():
    seed = 5
    print(f"seed {seed}")
    generator = np.random.default_rng(seed)
    first, second = (generator.normal(0.0, 0.02, (2, 12)) for _ in range(2))

    def relation(numbers_of_primary, numbers_of_secondary):
        def unit(name, numbers):
            triads = {
                sensor: {
                    "M": np.eye(3) + row[:9].reshape(3, 3),
                    "b": row[9:],
                    "covariance": 1e-6 * np.eye(12),
                }
                for sensor, row in zip(("accelerometer", "gyroscope"), numbers, strict=True)
            }
            return Calibration.model_validate({"name": name} | triads)

        primary, secondary = unit("imu1", numbers_of_primary), unit("imu2", numbers_of_secondary)
        mounted = UnitSettings(sensor_from_primary=FACING_DOWN)
        error, _ = factory_errors("imu2", secondary, mounted, primary)
        return primary, secondary, error

    primary, secondary, error = relation(first, second)
    truth = generator.normal(0.0, 5.0, 3)
    read = [primary.accelerometer.M @ truth + primary.accelerometer.b]
    read.append(secondary.accelerometer.M @ FACING_DOWN @ truth + secondary.accelerometer.b)
    np.testing.assert_allclose(error.matrix @ read[0] + error.bias, read[1], atol=1e-12)
    step, columns = 1e-6, []
    for which in range(2):
        for k in range(12):
            moved = [first.copy(), second.copy()]
            moved[which][0, k] += step
            _, _, other = relation(*moved)
            change = np.concatenate([(other.matrix - error.matrix).ravel(), other.bias - error.bias])
            columns.append(change / step)
    sigma = 1e-3 * np.linalg.norm(np.column_stack(columns), axis=1)
    found = np.concatenate([error.matrix_sigma.ravel(), error.bias_sigma])
    np.testing.assert_allclose(found, sigma, rtol=1e-4)


def test_calibration_of_the_primary_is_stored_and_reused(typed_set, tmp_path):
    first, _ = replay(*typed_set, code=None)
    at = typed_set.index("--calibration")
    later = (*typed_set[:at], *typed_set[at + 2 :])
    again, _ = replay(*later, code=None)
    assert again["calibration_hash"] == first["calibration_hash"] != ""
    path = tmp_path / "kept" / "imu1-calibration.yaml"
    assert f"the primary's own calibration is that of the store, {path}" in again["warnings"]
    other = calibration(OWN, serial="S-9")
    other.save(path)
    done = typed("redundancy", *later, "--set", "units.imu1.serial=S-8")
    assert done.code == 2
    assert "serial S-9" in one_line(done.err)


def test_a_damaged_calibration_in_the_store_is_one_line(typed_set, tmp_path):
    replay(*typed_set, code=None)
    path = tmp_path / "kept" / "imu1-calibration.yaml"
    path.write_text("schema: tumble-calibration/1\n: [")
    at = typed_set.index("--calibration")
    done = typed("redundancy", *typed_set[:at], *typed_set[at + 2 :])
    assert done.code == 2
    assert str(path) in one_line(done.err)


def test_unused_temperature_drift_of_a_calibration_is_reported(typed_set, tmp_path):
    drift = {"reference": 25.0, "range": [0.0, 50.0], "bias": [[1e-3, 0.0, 0.0]]}
    for name in ("own", "found"):
        content = Calibration.load(tmp_path / f"{name}.yaml").content()
        content["accelerometer"]["temperature_drift"] = drift
        Calibration.model_validate(content).save(tmp_path / f"{name}.yaml")
    result, _ = replay(*typed_set, "--factory", tmp_path / "found.yaml")
    said = [line for line in result["warnings"] if "temperature drift" in line]
    assert [line.split(" is not used")[0].split()[-1] for line in said] == ["imu1", "imu2"]
