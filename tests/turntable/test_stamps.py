"""Sessions whose stamps came late, or over a busy computer: errors are within their sigmas."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

import tumble
from log_fixtures import real
from tumble.tools.simulate import LiveSimulation


def sigmas_off(found, matrix, bias=None):
    """Returns the errors of M, and of b where its truth is given, in stated sigmas."""
    error = (found.M - np.array(matrix)).ravel()
    if bias is not None:
        error = np.r_[error, found.b - np.array(bias)]
    return error / np.sqrt(np.diagonal(found.covariance)[: len(error)])


@pytest.fixture(scope="module")
def jittered():
    folder = real("cases/stamp_jitter4")
    return tumble.turntable(folder / "ref.parquet", folder / "dut.parquet"), folder


def test_stamps_late_by_four_ms_leave_errors_within_sigma(jittered):
    result, folder = jittered
    truth = yaml.safe_load((folder / "truth.yaml").read_text())["dut"]
    for triad in ("accelerometer", "gyroscope"):
        off = sigmas_off(getattr(result.targets[0], triad), truth[triad]["matrix"], truth[triad]["bias"])
        print(triad, np.abs(off).max(), np.sqrt(np.mean(off**2)))
        assert np.abs(off).max() < 3.0
        assert np.sqrt(np.mean(off**2)) < 1.4


def test_stamps_that_were_fitted_are_reported_for_either_unit(jittered):
    result, _ = jittered
    said = "stamps are late by up to 4 ms; times were fitted, sampling period 10 ms"
    assert any(warning.startswith(f"ref: {said}") for warning in result.warnings)
    assert any(warning.startswith(said) for warning in result.targets[0].warnings)


@pytest.fixture(scope="module")
def busy():
    session = real("live_session_busy")
    targets = [f"{session}:target_{number}" for number in (1, 2)]
    return tumble.turntable(f"{session}:reference", targets, g_sensitivity=True)


@pytest.fixture(scope="module")
def truth_of_units():
    with LiveSimulation(
        seed=7, grades=("reference", "consumer", "industrial"), transport="tcp", rate_hz=100.0, port=0
    ) as bench:
        return bench.truth["units"]


def test_a_busy_computer_leaves_errors_within_sigma(busy, truth_of_units):
    for target in busy.targets:
        for triad in ("accelerometer", "gyroscope"):
            off = sigmas_off(getattr(target, triad), truth_of_units[target.name][triad]["M"])
            print(target.name, triad, np.abs(off).max(), np.sqrt(np.mean(off**2)))
            assert np.abs(off).max() < 3.0
            assert np.sqrt(np.mean(off**2)) < 1.4
            assert getattr(target, triad).widening == 1.0


def test_a_busy_computer_loses_no_sample_that_was_recorded(busy):
    said = [*busy.warnings, *(warning for target in busy.targets for warning in target.warnings)]
    assert not any("missing" in warning for warning in said)


def test_uncertain_pace_widens_the_gyroscope():
    session = real("live_session_busy")
    result = tumble.turntable(f"{session}:reference", f"{session}:target_2", clock="shared")
    gyroscope = result.targets[0].gyroscope
    # Taken for one clock, paces are known from arrivals alone: to some 600 ppm, of all scales alike.
    assert (np.sqrt(np.diagonal(gyroscope.covariance))[[0, 4, 8]] > 4e-4).all()
