"""Properties of a calibration over temperature: its errors, its tests, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

import tumble
from compare_units import UNITS
from plateau_units import REFERENCE, UP_AND_BACK, PlateauUnit
from repetitions import repetitions
from tumble.calibration.document import Calibration
from tumble.foundation.errors import TumbleError
from tumble.tools.exchange.procedure import export, import_calibrations
from tumble.tools.plateaus.report.page import PLATEAUS_REPORT
from tumble.tools.simulate import simulate_plateaus

SEED = 34
GRID = np.array([-20.0, -5.0, 10.0, 40.0, 55.0, 70.0])
BIAS, SCALE = (1e-4, 2e-6), (1e-5,)


def found(unit, temperatures=UP_AND_BACK, **options):
    return tumble.plateaus(unit.sessions(temperatures), reference=REFERENCE, **options)


def test_errors_are_those_of_the_bound_and_intervals_hold_the_truth():
    count = repetitions(240)
    generator = np.random.default_rng(SEED)
    print(f"seed {SEED}")
    curves, bounds, parameters = [], [], []
    for _ in range(count):
        unit = PlateauUnit(generator, bias=BIAS, scale=SCALE, triads=UNITS[:1])
        (triad,) = found(unit)
        values, sigma = triad.at(GRID)
        true = np.array([unit.at("accelerometer", each) for each in GRID])
        gain = (true[:, :1] / unit.truth["accelerometer"][0]) - 1.0
        curves.append((values - np.hstack([np.repeat(gain, 3, axis=1), true[:, 9:]])) / sigma)
        chosen = [[each.order for each in scores if each.chosen] for scores in triad.orders.values()]
        if chosen == [[2]] * 3 + [[1]] * 3:
            bounds.append(curves[-1])
        solution = np.concatenate([triad.M.ravel(), triad.b]) - unit.truth["accelerometer"]
        parameters.append(solution / np.sqrt(np.diag(triad.covariance)[:12]))
    # With the order of the truth the covariance is that of the Cramer-Rao bound.
    assert len(bounds) > 0.6 * count
    assert np.sqrt(np.mean(np.square(bounds))) < 1.05
    slack = 2.5 * np.sqrt(0.95 * 0.05 / (3 * count))
    for errors in (np.array(curves)[:, :, :3], np.array(curves)[:, :, 3:], np.array(parameters)):
        assert 0.93 - slack < np.mean(np.abs(errors) < 1.96) < 0.97 + slack


def test_file_and_device_record_correct_as_the_result_does(tmp_path):
    unit = PlateauUnit(np.random.default_rng(SEED), bias=BIAS, scale=SCALE)
    calibration = found(unit).calibration
    calibration.save(tmp_path / "unit.yaml")
    assert Calibration.load(tmp_path / "unit.yaml") == calibration
    drift = calibration.gyroscope.temperature_drift
    assert len(drift.covariance) == 12 + 3 * len(drift.bias) + 3 * len(drift.scale)
    record = tmp_path / "unit.bin"
    record.write_bytes(export(calibration, "record", {"identity": "5"}).content)
    (on_device,) = import_calibrations(record)
    for temperature in (-40.0, -20.0, 3.0, 70.0):
        case = np.array([[9.8, 0.3, -2.0], [0.1, -9.7, 1.0]])
        readings = [
            case @ unit.at(triad, np.clip(temperature, -20.0, 70.0))[:9].reshape(3, 3).T
            + unit.at(triad, np.clip(temperature, -20.0, 70.0))[9:]
            for triad, _, _ in UNITS
        ]
        corrected = calibration.correct(*readings, temperature)
        assert np.abs(np.array(corrected) - case).max() < 5e-3
        assert np.abs(np.array(on_device.correct(*readings, temperature)) - corrected).max() < 5e-6


def test_angles_that_change_are_reported_as_not_modelled():
    unit = PlateauUnit(np.random.default_rng(SEED), bias=BIAS, turn=2e-5)
    result = found(unit)
    changing = {each.group: each for each in result["accelerometer"].constancies}
    assert changing["mounting"].changes
    assert not changing["non-orthogonality"].changes
    turn = np.linalg.norm(changing["mounting"].change)
    assert turn == pytest.approx(np.degrees(2e-5 * 90.0), rel=0.3)
    (warning,) = [line for line in result.warnings if line.startswith("accelerometer mounting changes by")]
    assert "not modelled" in warning


def test_plateaus_that_differ_up_and_down_show_hysteresis():
    unit = PlateauUnit(np.random.default_rng(SEED), bias=BIAS)
    legs = (0, 1, 1, 1, 1, -1, -1, -1)
    temperatures = (*UP_AND_BACK[:5], 50.0, 25.0, 0.0)
    sessions = [
        unit.calibration(each, shift=0.5 * leg * 2e-3) for each, leg in zip(temperatures, legs, strict=True)
    ]
    result = tumble.plateaus(sessions, reference=REFERENCE)
    triad = result["accelerometer"]
    assert np.abs(triad.hysteresis - 2e-3).max() < 4.5 * triad.hysteresis_sigma.max()
    assert (triad.at(np.array([25.0]))[1][0, 3:] > 9e-4).all()
    assert any("differs at one temperature" in line for line in result.warnings)


def test_rise_alone_leaves_hysteresis_unknown():
    result = found(PlateauUnit(np.random.default_rng(SEED)), UP_AND_BACK[:5])
    assert result.verdict == "partly measured"
    assert np.isnan(result["gyroscope"].hysteresis).all()
    assert any(line.startswith("hysteresis is not known") for line in result.warnings)


def test_sessions_that_scatter_widen_the_bias_alone():
    unit = PlateauUnit(np.random.default_rng(SEED), bias=BIAS)
    shifts = 2e-3 * np.random.default_rng(SEED).normal(size=len(UP_AND_BACK))
    sessions = [unit.calibration(each, shift=shift) for each, shift in zip(UP_AND_BACK, shifts, strict=True)]
    result = tumble.plateaus(sessions)
    widening = result["accelerometer"].widening
    assert widening["bias"] > 3.0
    assert widening["mounting"] == widening["scale"] == 1.0
    assert any("sessions scatter" in line and "leave it on" in line for line in result.warnings)


def test_a_gyroscope_that_showed_bias_alone_has_bias_alone():
    unit = PlateauUnit(np.random.default_rng(SEED), bias=BIAS)
    sessions = unit.sessions()
    for each in sessions:
        spread = each.gyroscope.covariance.copy()
        spread[:9], spread[:, :9] = np.nan, np.nan
        object.__setattr__(each.gyroscope, "covariance", spread)
        object.__setattr__(each.gyroscope, "estimated", ("bias",))
    result = tumble.plateaus(sessions, reference=REFERENCE)
    triad = result["gyroscope"]
    assert len(triad.scale) == 0
    assert np.abs(triad.bias[0] - BIAS[0]).max() < 1e-5
    assert np.isnan(np.diag(triad.covariance)[:9]).all()
    section = result.calibration.gyroscope
    assert section.K is None
    assert np.isnan(section.covariance[0, 0])
    assert np.isfinite(section.temperature_drift.bias_sigma[0]).all()
    assert len(triad.predictions) == 4
    assert PLATEAUS_REPORT.render(result).count("not observable") == 4 + 3


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"temperatures": (20.0, 21.0, 60.0)},
            "calibrations at 2 different temperatures; give 3",
        ),
        ({"unheated": True}, "does not state its temperature"),
        ({"serial": "8"}, "are of units 7 and 8"),
        ({"method": {"procedure": "multipose"}}, "are of different procedures, multipose and turntable"),
        ({"gyroscope": True}, "has no gyroscope, which others have"),
        ({"covariance": True}, "states no covariance of the accelerometer"),
        ({"verdict": "model not met"}, "has the verdict 'model not met' .*: its errors are larger"),
    ],
)
def test_what_cannot_be_put_together_is_refused_in_one_line(change, message):
    unit = PlateauUnit(np.random.default_rng(SEED))
    changes = dict(change)
    temperatures = changes.pop("temperatures", UP_AND_BACK)
    sessions = unit.sessions(temperatures)
    if changes.pop("gyroscope", False):
        unit.triads = UNITS[:1]
    unheated = changes.pop("unheated", False)
    without_covariance = changes.pop("covariance", False)
    content = unit.calibration(temperatures[-1], **changes).content()
    if unheated:
        del content["temperature"]
    if without_covariance:
        del content["accelerometer"]["covariance"]
    with pytest.raises(TumbleError, match=message) as caught:
        tumble.plateaus([*sessions[:-1], Calibration.model_validate(content)])
    assert "\n" not in str(caught.value)


def test_a_magnetometer_is_fitted_over_temperature_too():
    simulated = simulate_plateaus(
        seed=SEED,
        temperatures=(-20.0, 25.0, 70.0),
        rate_hz=50.0,
        magnetometer=(0.02,),
        magnetometer_scale=(1e-4,),
    )
    calibrations = [
        tumble.turntable(session.reference, session.targets, poses=None).calibration
        for session in simulated.sessions()
    ]
    result = tumble.plateaus(calibrations)
    triad = result["magnetometer"]
    assert np.abs((triad.bias[0] - 0.02) / np.sqrt(np.diag(triad.covariance)[12:15])).max() < 4.0
    assert triad.scale[0] == pytest.approx(1e-4, rel=0.3)
    section = result.calibration.magnetometer
    assert section.temperature_drift.reference == pytest.approx(25.0, abs=0.1)
    with_gap = [calibrations[0].model_copy(update={"magnetometer": None}), *calibrations[1:]]
    without = tumble.plateaus(with_gap)
    assert [each.triad for each in without] == ["accelerometer", "gyroscope"]
    assert any("magnetometer is left out" in warning for warning in without.warnings)
