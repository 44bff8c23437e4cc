"""Laws of all simulators: a seed decides each byte, a mistake is one line, JSON names each file."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import pytest
import yaml

from flight_units import CALM
from tumble import simulate_flight, simulate_spin
from tumble.foundation.errors import TumbleError
from tumble.tools.simulate import (
    Fault,
    FlightUnit,
    ScenarioError,
    SimulatedDisturbance,
    Step,
    simulate_turntable,
)
from tumble.tools.simulate.flight.scenario import FlightScenario, Vibration
from tumble.tools.simulate.live.scenario import LiveScenario
from tumble.tools.simulate.magnetometer.procedure import MagneticScenario
from tumble.tools.simulate.plateaus.scenario import PlateausScenario
from tumble.tools.simulate.scenario import BOUNDS
from tumble.tools.simulate.spin.scenario import SpinScenario
from tumble.tools.simulate.static.scenario import StaticScenario
from tumble.tools.simulate.thermal.scenario import ThermalScenario
from tumble.tools.simulate.turntable.scenario import TurntableScenario
from turntable_sessions import one_line, typed

SUPPORT = str(Path(__file__).parents[1] / "support")
QUICK = {
    "turntable": ("--rest", "0.5", "--rate", "50", "--clocks", "apart"),
    "flight": ("--rest", "2", "--duration", "6", "--flights", "2"),
    "spin": ("--plan", "rest 5, 1 turns"),
    "multipose": ("--orientations", "12", "--rate", "50"),
    "magnetometer": ("--orientations", "12", "--rate", "50"),
    "static": ("--duration", "60s", "--rate", "50"),
    "thermal": ("--duration", "10min"),
    "plateaus": ("--rest", "0.5", "--rate", "50"),
}
"""Options with which each simulator takes no time."""
MISTAKES = (
    ("turntable", ("--grades", "toy"), "unknown grade 'toy'"),
    ("turntable", ("--rate", "0"), "rate_hz is 0; give 1 to 10000"),
    ("turntable", ("--seed", "-3"), "seed is -3"),
    ("turntable", ("--visits", "Q up"), "unknown pose 'Q up'"),
    ("turntable", ("--fault", "target_1:broken"), "unknown fault 'broken'"),
    ("turntable", ("--fault", "target_1:gap:start=soon"), "start needs a number, found 'soon'"),
    ("turntable", ("--fault", "target_1:gap:colour=red"), "unknown key 'colour'"),
    ("turntable", ("--fault", "target_7:gap"), "unknown unit 'target_7'"),
    ("turntable", ("--poses", "nowhere.yaml"), "nowhere.yaml: no such pose list"),
    ("flight", ("--unit", "cheap"), "primary: unknown grade 'cheap'"),
    (
        "flight",
        ("--unit", "consumer:colour=red"),
        "--unit consumer:colour=red: unknown key 'colour'; known are lever-arm",
    ),
    ("flight", ("--unit", "consumer:lever-arm=1,2"), "lever-arm 1,2: needs 3 numbers"),
    ("flight", ("--unit", "consumer:rate=fast"), "rate fast: needs a number"),
    ("flight", ("--unit", "consumer:rate=-5"), "primary: rate_hz is -5"),
    (
        "flight",
        ("--fault", "wing:dead"),
        "--fault wing: unknown unit; there are primary, secondary_1, secondary_2",
    ),
    ("flight", ("--fault", "primary:gone"), "unknown fault 'gone'"),
    ("flight", ("--sway", "1,1"), "--sway 1,1: needs 3 numbers"),
    ("flight", ("--mounting", "a,b,c"), "--mounting a,b,c: needs 3 numbers"),
    ("flight", ("--intensity", "7"), "intensity is 7"),
    ("flight", ("--vibration", "-1"), "vibration: specific_force is -1"),
    ("flight", ("--vibration-at-rest", "2"), "vibration: at_rest is 2"),
    ("flight", ("--duration", "nan"), "motion_seconds is nan"),
    ("flight", ("--flights", "0"), "flights is 0"),
    ("flight", ("--rest", "1e12"), "do not fit into memory"),
    ("spin", ("--plan", "rest 5, 3 tuns"), "step '3 tuns' is not a step"),
    ("spin", ("--plan", "rest 5, drive 8 tilt"), "step 'drive 8 tilt' is not a step"),
    ("spin", ("--gyroscope-bias", "0.1,0.2"), "--gyroscope-bias 0.1,0.2: needs 3 numbers"),
    ("spin", ("--disturb", "sil@9"), "--disturb sil@9"),
    ("spin", ("--disturb", "sill@soon"), "--disturb sill@soon"),
    ("spin", ("--mounting", "1,2"), "--mounting 1,2: needs 3 numbers"),
    ("spin", ("--fault", "gone"), "unknown fault 'gone'"),
    ("spin", ("--fault", "saturated:size=-1"), "size needs to be positive, found -1"),
    ("spin", ("--fault", "scale:size=nan"), "size needs to be a finite number, found nan"),
    ("spin", ("--plan", ""), "the plan has no step"),
    ("spin", ("--still", "nan"), "a rest of nan s"),
    ("spin", ("--turn-rate", "-1"), "turn_rate is -1"),
    ("multipose", ("--orientations", "0"), "--orientations 0: give 1 to 1000"),
    ("magnetometer", ("--rate", "0"), "rate is 0; give 1 to 10000"),
    ("static", ("--gyroscope", "x"), "--gyroscope x: write TERM=VALUE"),
    ("thermal", ("--gyroscope", "x"), "--gyroscope x: needs numbers"),
    ("plateaus", ("--temperatures", "x"), "--temperatures x: needs numbers"),
)
"""Simulator, what is typed, and the mistake in it."""
NONSENSE = (
    (
        simulate_turntable,
        {"grades": ("navigation",)},
        "unknown grade 'navigation'; known are consumer, industrial",
    ),
    (simulate_turntable, {"visits": ("W up",)}, "unknown pose 'W up'; known are X up, X down"),
    (simulate_turntable, {"tipped_deg": {"W up": 1.0}}, "unknown pose 'W up'"),
    (
        simulate_turntable,
        {"faults": {"target_9": Fault("gap")}},
        "unknown unit 'target_9'; known are reference, target_1",
    ),
    (simulate_turntable, {"rate_hz": {"target": 100.0}}, "unknown unit 'target'"),
    (simulate_turntable, {"seed": -1}, "seed is -1"),
    (simulate_turntable, {"rest_seconds": 0.0}, "time at rest, s, has to be positive, found 0"),
    (simulate_turntable, {"rate_hz": -1.0}, "rate_hz is -1; give 1 to 10000"),
    (simulate_turntable, {"rate_hz": float("nan")}, "rate_hz is nan; give finite numbers"),
    (
        simulate_turntable,
        {"rate_hz": {"target_1": float("inf")}},
        "rate_hz is inf; give 1 to 10000",
    ),
    (simulate_turntable, {"rate_hz": "fast"}, "rate_hz is 'fast'; give a number"),
    (
        simulate_turntable,
        {"turn_profile": "square"},
        "table.profile: unknown variant `square`, expected `smooth` or `trapezoid`",
    ),
    (simulate_turntable, {"seed": 1.5}, "seed is 1.5; give a whole number"),
    (simulate_turntable, {"lever_arm_m": {"reference": (0.1, 0.2)}}, "reference.lever_arm: invalid length 2"),
    (simulate_turntable, {"rest_seconds": 1000000000.0}, "samples a unit do not fit into memory"),
    (simulate_turntable, {"visits": ()}, "there is no pose to turn to"),
    (simulate_turntable, {"table_error_deg": -1.0}, "table_error_deg is -1; give 0 to 180"),
    (
        simulate_turntable,
        {"faults": {"target_1": Fault("scale", size=-1.0)}},
        "factor of a scale fault has to be positive",
    ),
    (simulate_flight, {"seed": -1}, "seed is -1"),
    (simulate_flight, {"motion": "boat"}, "unknown motion 'boat'; known are quadrotor, vehicle"),
    (simulate_flight, {"units": ()}, "there is no unit"),
    (
        simulate_flight,
        {"units": (FlightUnit(), FlightUnit(grade="cheap"))},
        "secondary_1: unknown grade 'cheap'",
    ),
    (simulate_flight, {"units": (FlightUnit(rate_hz=0.0),)}, "primary: rate_hz is 0"),
    (
        simulate_flight,
        {"units": (FlightUnit(lever_arm_m=(0.1, float("nan"), 0.0)),)},
        "primary: lever_arm_m is (0.1, nan, 0.0)",
    ),
    (
        simulate_flight,
        {"units": (FlightUnit(mounting_deg=(0.1, 0.0)),)},
        "primary: mounting_deg has 2 numbers",
    ),
    (simulate_flight, {"units": (FlightUnit(latency_seconds=-1.0),)}, "primary: latency_seconds is -1"),
    (simulate_flight, {"units": (FlightUnit(clock_skew_ppm=1000000.0),)}, "primary: clock_skew_ppm is 1e+06"),
    (simulate_flight, {"flights": 0}, "flights is 0"),
    (simulate_flight, {"stops": -1}, "stops is -1"),
    (simulate_flight, {"motion_seconds": 3.0, "stops": 9}, "motion_seconds is 3 with 9 stops"),
    (simulate_flight, {"rest_seconds": 0.0}, "rest_seconds is 0"),
    (simulate_flight, {"rest_seconds": 1000000000.0}, "do not fit into memory"),
    (simulate_flight, {"intensity": 1.5}, "intensity is 1.5"),
    (simulate_flight, {"intensity": float("nan")}, "intensity is nan"),
    (simulate_flight, {"turning": -0.1}, "turning is -0.1"),
    (simulate_flight, {"sway": (1.0, 2.0, 0.0)}, "sway is"),
    (simulate_flight, {"sway": (1.0, 1.0)}, "sway is"),
    (simulate_flight, {"ground_tilt_deg": 70.0}, "ground_tilt_deg is 70"),
    (simulate_flight, {"latitude_deg": 91.0}, "latitude_deg is 91"),
    (simulate_flight, {"warm_up_seconds": 0.0}, "warm_up_seconds is 0"),
    (simulate_flight, {"vibration": replace(CALM, specific_force=-1.0)}, "vibration: specific_force is -1"),
    (simulate_flight, {"vibration": replace(CALM, at_rest=2.0)}, "vibration: at_rest is 2"),
    (simulate_flight, {"vibration": replace(CALM, band_hz=(90.0, 60.0))}, "vibration: band_hz is 90 to 60"),
    (simulate_flight, {"vibration": replace(CALM, tones_hz=(900.0,))}, "vibration: a tone at 900 Hz"),
    (
        simulate_flight,
        {"vibration": replace(CALM, angular_rate=float("inf"))},
        "vibration: angular_rate is inf",
    ),
    (simulate_spin, {"plan": ()}, "the plan has no step"),
    (simulate_spin, {"plan": (Step("rest", 0.0),)}, "a rest of 0 s"),
    (simulate_spin, {"plan": (Step("turn", turns=0.0),)}, "a turn of 0 turns"),
    (simulate_spin, {"turn_rate": 0.0}, "turn_rate is 0"),
    (simulate_spin, {"turn_rate": float("nan")}, "turn_rate is nan"),
    (simulate_spin, {"grade": "cheap"}, "unknown grade 'cheap'"),
    (simulate_spin, {"unevenness": 1.5}, "unevenness is 1.5"),
    (simulate_spin, {"rate_hz": 0.1}, "rate_hz is 0.1"),
    (simulate_spin, {"floor_tilt_deg": -1.0}, "floor_tilt_deg is -1"),
    (simulate_spin, {"plan": (Step("rest", 1000000000.0),)}, "do not fit into memory"),
    (
        simulate_spin,
        {"plan": (Step("drive", 5.0, floor_tilt_deg=-2.0),)},
        "a drive to a floor that tilts by -2 deg",
    ),
    (
        simulate_spin,
        {"plan": (Step("drive", 5.0, uphill_deg=float("inf")),)},
        "a drive with a number that is not finite",
    ),
    (simulate_spin, {"roll_deg": float("nan")}, "roll_deg is nan"),
    (simulate_spin, {"lever_arm_m": (0.1, float("inf"), 0.0)}, "lever_arm_m is (0.1, inf, 0.0)"),
    (simulate_spin, {"gyroscope_bias": (0.1, 0.0)}, "gyroscope_bias has 2 numbers"),
    (simulate_spin, {"accelerometer_noise": -0.1}, "accelerometer_noise is -0.1"),
    (simulate_spin, {"accelerometer_range": 0.0}, "accelerometer_range is 0"),
    (simulate_spin, {"latitude_deg": 91.0}, "latitude_deg is 91"),
    (simulate_spin, {"disturbances": [SimulatedDisturbance.lifted(float("nan"))]}, "not finite"),
    (
        simulate_spin,
        {"disturbances": [SimulatedDisturbance.lifted(-3.0)]},
        "a disturbance at -3 s, before the recording",
    ),
    (
        simulate_spin,
        {"disturbances": [SimulatedDisturbance.lifted(500.0)]},
        "at 500 s, but the recording ends at 47.26 s",
    ),
    (MagneticScenario, {"seed": -1}, "seed is -1; give 0 to"),
    (MagneticScenario, {"rate": float("nan")}, "rate is nan; give 1 to 10000"),
    (MagneticScenario, {"still": -1.0}, "still is -1; give 0 to 3600"),
    (MagneticScenario, {"strength": 0.0}, "strength is 0; give 1 to 1000"),
    (MagneticScenario, {"dip": 91.0}, "dip is 91; give -90 to 90"),
    (MagneticScenario, {"noise": float("inf")}, "noise is inf; give 0 to 1000"),
    (MagneticScenario, {"disturbed": 19}, "rest 19 is none of 1 to 18"),
)
"""Simulator, changes of its scenario, and the mistake in them."""


SCENARIOS = (
    *(TurntableScenario, FlightScenario, SpinScenario, StaticScenario, ThermalScenario),
    *(PlateausScenario, MagneticScenario, LiveScenario, FlightUnit, Vibration),
)
PARTS = {
    FlightUnit: lambda part: FlightScenario(units=(part,)),
    Vibration: lambda part: FlightScenario(vibration=part),
}
"""Scenarios that hold a part, which is checked within them."""
NUMERIC = re.compile(r"\b(int|float|Triple|Powers|Terms)\b")


def numbers_of(scenario):
    """Names of the fields that hold numbers."""
    found = [each for each in fields(scenario) if NUMERIC.search(each.type)]
    return [each.name for each in found]


def test_each_number_of_a_scenario_has_bounds():
    lacking = {f"{each.__name__}.{name}" for each in SCENARIOS for name in numbers_of(each)} - {
        f"{each.__name__}.{name}" for each in SCENARIOS for name in BOUNDS
    }
    assert lacking == set()


CASES = [(each, name) for each in SCENARIOS for name in numbers_of(each)]


@pytest.mark.parametrize(("scenario", "name"), CASES, ids=[f"{each.__name__}-{name}" for each, name in CASES])
def test_a_number_beyond_its_bounds_is_refused_in_one_line(scenario, name):
    least, largest = BOUNDS[name]
    usual = CALM if scenario is Vibration else scenario()
    for value in (least - 1.0 - abs(least), 2.0 * largest + 1.0, float("nan"), float("inf"), "x"):
        nested = {"Mapping": {"reference": value}, "Terms": {"white noise": value}}
        kind = next(each.type for each in fields(scenario) if each.name == name)
        given = next((nested[word] for word in nested if word in kind), value)
        if re.search("Triple|tuple|Sequence|Powers", kind) and "Mapping" not in kind:
            given = {"gaps": ((0.0, value),), "band_hz": (value, value)}.get(name, (value, value, value))
        with pytest.raises(ScenarioError) as caught:
            PARTS.get(scenario, lambda part: part)(replace(usual, **{name: given}))
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("word", QUICK)
def test_every_simulator_refuses_a_seed_below_zero(word, tmp_path):
    done = typed("simulate", word, *QUICK[word], "--seed", "-1", "-o", tmp_path / "out")
    assert done.code == 2
    assert "seed is -1; give 0 to" in one_line(done.err)


def simulate(word, folder, *more):
    return typed("simulate", word, *QUICK[word], "-o", folder, *more)


def contents(folder):
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory):
    """Folder with what another process writes, whose sets have another order."""
    folder = tmp_path_factory.mktemp("elsewhere")
    code = "import json, sys; from turntable_sessions import typed\n"
    code += "for words in json.loads(sys.argv[1]): assert typed('simulate', *words).code == 0"
    every = [[word, *QUICK[word], "--seed", "4", "-o", str(folder / word)] for word in QUICK]
    path = {"PYTHONPATH": os.pathsep.join([SUPPORT, *sys.path]), "PYTHONHASHSEED": "1"}
    command = [sys.executable, "-c", code, json.dumps(every)]
    subprocess.run(command, check=True, env=os.environ | path)
    return folder


@pytest.mark.parametrize("word", QUICK)
def test_json_names_every_file_that_was_written(word, tmp_path):
    done = simulate(word, tmp_path, "--seed", "3", "--json")
    found = json.loads(done.out)
    assert sorted(found["files"].values()) == sorted(str(path) for path in tmp_path.iterdir())
    assert found["seed"] == 3
    truth = yaml.safe_load((tmp_path / "truth.yaml").read_text())
    stated = found.keys() & truth.keys() - {"schema", "seed", "files"}
    assert {name: found[name] for name in stated} == {name: truth[name] for name in stated}


@pytest.mark.parametrize("word", QUICK)
def test_a_seed_decides_every_byte_in_any_process(word, elsewhere, tmp_path):
    simulate(word, tmp_path / "again", "--seed", "4")
    simulate(word, tmp_path / "other", "--seed", "5")
    again, other = contents(tmp_path / "again"), contents(tmp_path / "other")
    assert again == contents(elsewhere / word)
    assert again.keys() == other.keys()
    alike = {name for name in again if again[name] == other[name]}
    assert alike <= {"poses.yaml", "units.yaml"} | {name for name in alike if name.endswith("/poses.yaml")}


@pytest.mark.parametrize("word", QUICK)
def test_a_folder_that_cannot_be_written_is_one_line(word, tmp_path):
    (tmp_path / "file").write_text("mine")
    done = simulate(word, tmp_path / "file")
    assert done.code == 2
    assert str(tmp_path / "file") in one_line(done.err)
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize(("word", "words", "mistake"), MISTAKES)
def test_a_mistake_is_one_line_and_writes_nothing(word, words, mistake, tmp_path):
    done = typed("simulate", word, *words, "-o", tmp_path / "out")
    assert done.code == 2
    assert mistake in one_line(done.err)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("simulator", "changes", "mistake"), NONSENSE)
def test_a_scenario_that_makes_no_sense_is_refused_in_one_line(simulator, changes, mistake):
    with pytest.raises(ScenarioError) as caught:
        simulator(**changes)
    assert mistake in str(caught.value)
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, TumbleError)
