"""Parameters of firmware that follow temperature correct as Tumble does, by the formulas of the firmware."""

import re

import numpy as np
import pytest

from exchange_units import calibration, samples
from tumble.tools.exchange.procedure import export


def text_of(unit, to, **settings):
    exported = export(unit, to, {name.replace("_", "-"): str(value) for name, value in settings.items()})
    return exported.content.decode(), exported


def parameters(text, separator, name, value):
    lines = [re.split(separator, line) for line in text.splitlines() if not line.startswith("#")]
    return {fields[name]: float(fields[value]) for fields in lines}


def vector(found, names):
    return np.array([found[names.format(axis)] for axis in "XYZ"])


def close(found, expected, tolerance):
    assert np.abs(found - expected).max() < tolerance


@pytest.mark.parametrize("temperature", [-30.0, 5.0, 30.0, 80.0])
def test_px4_subtracts_what_temperature_does_once(temperature):
    unit = calibration(11, parts=("scale",), over_temperature=True)
    text, _ = text_of(unit, "px4", accelerometer_id=1, gyroscope_id=2)
    found = parameters(text, "\t", 2, 3)
    force, rate = samples(1)
    true_force, _ = unit.correct(force, rate, temperature)
    # temperature_compensation.cpp: the temperature is held within TMIN and TMAX
    held = min(max(temperature, found["TC_A0_TMIN"]), found["TC_A0_TMAX"]) - found["TC_A0_TREF"]
    thermal = sum(
        np.array([found[f"TC_A0_X{power}_{axis}"] for axis in range(3)]) * held**power for power in range(4)
    )
    offset, scale = vector(found, "CAL_ACC0_{}OFF"), vector(found, "CAL_ACC0_{}SCALE")
    assert found["TC_A_ENABLE"] == found["TC_G_ENABLE"] == 1.0
    close((force - thermal - offset) * scale, true_force, 1e-5)


@pytest.mark.parametrize("temperature", [-30.0, 5.0, 30.0, 80.0])
def test_ardupilot_parameters_correct_as_tumble_at_any_temperature(temperature):
    unit = calibration(3, parts=("scale",), over_temperature=True)
    text, _ = text_of(unit, "ardupilot", instance=2)
    found = parameters(text, ",", 0, 1)
    force, rate = samples(3)
    true_force, _ = unit.correct(force, rate, temperature)

    def held(degrees):
        return min(max(degrees, found["INS_TCAL2_TMIN"]), found["INS_TCAL2_TMAX"]) - 35.0

    def polynomial(degrees):
        # AP_InertialSensor_tempcal.cpp: coefficients times 1e-6 about 35 degC
        powers = (vector(found, f"INS_TCAL2_ACC{k}_" + "{}") * held(degrees) ** k for k in (1, 2, 3))
        return 1e-6 * sum(powers)

    thermal = polynomial(temperature) - polynomial(found["INS_ACC2_CALTEMP"])
    offset, scale = vector(found, "INS_ACC2OFFS_{}"), vector(found, "INS_ACC2SCAL_{}")
    close((force - thermal - offset) * scale, true_force, 2e-5)
    assert found["INS_GYR_CAL"] == 0.0
