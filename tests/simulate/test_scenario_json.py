"""Conversion of a scenario for the native simulator."""

import json
import random

import numpy as np
import pytest

from tumble import _core
from tumble.tools.simulate import Grade, grade_names, simulate_turntable
from tumble.tools.simulate.scenario_json import as_json
from tumble.tools.simulate.turntable.procedure import _native
from tumble.tools.simulate.turntable.scenario import TurntableScenario


def refusal(scenario):
    with pytest.raises(ValueError, match=r"\w") as caught:
        _core.simulate_turntable(as_json(scenario))
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_unknown_or_missing_scenario_field_is_refused_with_its_place():
    scenario = _native(TurntableScenario(grades=("consumer",)))
    scenario["targets"][0]["colour"] = "red"
    assert "targets[0].colour: unknown field `colour`" in refusal(scenario)
    scenario = _native(TurntableScenario())
    del scenario["table"]["limits"]["rate"]
    assert refusal(scenario) == "table.limits: missing field `rate`"
    scenario = _native(TurntableScenario())
    scenario["mounting"] = "steep"
    assert refusal(scenario) == "mounting: needs an angle or three numbers"


def test_no_number_loses_a_bit_on_the_way():
    draw = random.Random(5)
    numbers = np.array([[draw.uniform(-1.0, 1.0) * 10.0 ** draw.randint(-300, 300) for _ in range(3)]])
    assert np.array_equal(np.array(json.loads(as_json({"numbers": numbers}))["numbers"]), numbers)
    lever_arm = tuple(draw.uniform(-1e-3, 1e-3) for _ in range(3))
    mounting = tuple(draw.uniform(-1.0, 1.0) for _ in range(3))
    given = {"grades": ("tactical",), "rest_seconds": 0.5, "g_sensitivity": False}
    session = simulate_turntable(**given, lever_arm_m={"target_1": lever_arm}, mounting_angle_deg=mounting)
    again = simulate_turntable(
        **given, lever_arm_m={"target_1": np.array(lever_arm)}, mounting_angle_deg=np.array(mounting)
    )
    assert np.array_equal(session["target_1"].samples.accelerometer, again["target_1"].samples.accelerometer)


@pytest.mark.parametrize("name", grade_names())
def test_a_grade_comes_back_from_the_simulator_as_it_was_sent(name):
    grade = Grade.named(name)
    session = simulate_turntable(grades=(grade,), rest_seconds=0.5)
    triad = session["target_1"].gyroscope
    assert triad.noise_density == grade.gyroscope.noise_density
    assert triad.bias_instability == grade.gyroscope.bias_instability
    assert triad.quantisation == grade.gyroscope.quantisation
