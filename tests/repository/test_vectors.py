"""Python agrees with the conformance vectors that Rust, and later C and the firmware, are held against."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from tumble import _core

VECTORS = Path(__file__).parents[2] / "vectors"


def vectors(name, precision="f64"):
    content = json.loads((VECTORS / f"{name}.json").read_text())
    return content["cases"], {key: each[precision] for key, each in content["tolerance"].items()}


def generator():
    specification = importlib.util.spec_from_file_location("generate", VECTORS / "generate.py")
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


def assert_same(found, expected, where):
    assert type(found) is type(expected), where
    if isinstance(expected, dict):
        assert found.keys() == expected.keys(), where
        for key in expected:
            assert_same(found[key], expected[key], f"{where}.{key}")
    elif isinstance(expected, list):
        assert len(found) == len(expected), where
        for i, (one, other) in enumerate(zip(found, expected, strict=True)):
            assert_same(one, other, f"{where}[{i}]")
    elif isinstance(expected, str):
        assert found == expected, where
    else:
        # Other versions of numpy and scipy differ in the last digits, and in the last step of a fit.
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-9), where


def test_the_files_are_what_their_generator_writes():
    made = generator()
    assert {path.stem for path in VECTORS.glob("*.json")} == made.VECTORS.keys()
    for name, recipe in made.VECTORS.items():
        written = json.loads((VECTORS / f"{name}.json").read_text())
        assert_same(json.loads(made.text(made.content(recipe))), written, name)


def test_corrections_agree_with_their_vectors():
    cases, tolerance = vectors("model")
    for case in cases:
        y, m, b = (np.array(case[key], dtype=np.float64) for key in ("y", "M", "b"))
        found = _core.correct(y[None, :], m, b)[0]
        np.testing.assert_allclose(found, case["corrected"], rtol=0, atol=tolerance["corrected"])


def test_readings_at_the_reference_temperature_match_the_vectors():
    cases, tolerance = vectors("temperature")
    for case in cases:
        y, b = np.array(case["y"]), np.array(case["b"])
        found = _core.at_reference(y[None, :], b, np.array([case["temperature"]]), case)[0]
        np.testing.assert_allclose(found, case["at_reference"], rtol=0, atol=tolerance["at_reference"])


def test_records_of_magnetometers_are_those_of_the_vectors():
    for case in vectors("magnetometer")[0]:
        record = {
            "identity": case["identity"],
            "sensor": "magnetometer",
            "matrix": case["M"],
            "bias": case["b"],
            "current": case["current"],
            "current_unit": case["current_unit"],
            "matrix_sigma": case["M_sigma"],
            "bias_sigma": case["b_sigma"],
        }
        content = bytes.fromhex(case["record"])
        assert _core.encode_record(record) == content
        assert _core.decode_record(content) == record


def test_normal_gravity_agrees_with_its_vectors():
    cases, tolerance = vectors("gravity")
    for case in cases:
        found = _core.normal_gravity(np.radians(case["latitude_deg"]), case["height_m"])
        assert found == pytest.approx(case["gravity"], rel=0, abs=tolerance["gravity"])


@pytest.mark.parametrize("chunk", [1, 7, 100, 10_000])
def test_rests_and_turns_agree_with_their_vectors_whatever_the_chunks(chunk):
    case, tolerance = vectors("stream")
    counts = np.array(case["counts"], dtype=np.float64)
    time = np.arange(len(counts)) * case["interval_us"] * 1e-6
    force = np.ascontiguousarray(counts[:, :3] * case["force_step"])
    rate = np.ascontiguousarray(counts[:, 3:] * case["rate_step"])
    segmenter = _core.Segmenter()
    for start in range(0, len(time), chunk):
        part = slice(start, start + chunk)
        segmenter.push(time[part], force[part], rate[part])
    unit = segmenter.finish()
    np.testing.assert_allclose(unit.rest_times, case["rests_s"], rtol=0, atol=tolerance["rests_s"])
    biases = [case["bias"]] * len(case["rests_s"])
    np.testing.assert_allclose(unit.rest_angular_rate, biases, rtol=0, atol=tolerance["bias"])
    between = unit.rest_times[1, 0] - unit.rest_times[0, 1]
    turned = unit.turn_angles[0] - between * np.array(case["bias"])
    np.testing.assert_allclose(turned, case["turn_angle"], rtol=0, atol=tolerance["turn_angle"])


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_a_spin_agrees_with_its_vectors(precision):
    case, tolerance = vectors("spin", precision)
    counts = np.array(case["counts"], dtype=np.float64)
    time = np.arange(len(counts)) * case["interval_us"] * 1e-6
    force = np.ascontiguousarray(counts[:, :3] * case["force_step"])
    rate = np.ascontiguousarray(counts[:, 3:] * case["rate_step"])
    settings = _core.SpinSettings({"gravity": case["gravity"]}, bias_instability=(0.0, 0.0))
    found, _ = _core.fit_spin(time, force, rate, np.array(case["rests_s"]), settings, precision)
    for quantity, bias in (
        ("accelerometer_bias", found["level_free"]["value"]),
        ("gyroscope_bias", found["gyroscope_bias"]["value"]),
        ("floor_tilt", found["floor_tilt"][0]),
    ):
        apart = (bias - np.array(case[quantity])) / np.array(case[f"{quantity}_sigma"])
        assert np.abs(apart).max() < tolerance[quantity], quantity


@pytest.mark.parametrize("precision", ["f64", "f32"])
def test_a_redundant_set_agrees_with_its_vectors(precision):
    case, tolerance = vectors("redundancy", precision)
    counts = [np.array(case[f"{unit}_counts"], dtype=np.float64) for unit in ("primary", "secondary")]
    time = 1.0 + np.arange(len(counts[0])) * case["interval_us"] * 1e-6
    monitor = _core.RedundancyMonitor(
        [_core.RedundancyUnit(1), _core.RedundancyUnit(2)],
        {"rest_duration": case["rest_duration_s"], "collect": case["collect_s"]},
        precision,
    )
    replay = monitor.replay(
        [time, time],
        [np.ascontiguousarray(each[:, :3] * case["force_step"]) for each in counts],
        [np.ascontiguousarray(each[:, 3:] * case["rate_step"]) for each in counts],
    )
    events = [event for _, _, event, _ in replay["events"] if event != "evaluated"]
    assert list(dict.fromkeys(events)) == case["events"]
    for record in monitor.records():
        sensor = record["sensor"]
        found = {f"{sensor}_M": ("matrix", "matrix_sigma"), f"{sensor}_b": ("bias", "bias_sigma")}
        if sensor == "accelerometer":
            found["lever_arm"] = ("lever_arm", "lever_arm_sigma")
        for quantity, (value, sigma) in found.items():
            apart = (record[value] - np.array(case[quantity])) / record[sigma]
            assert np.abs(apart).max() < tolerance[quantity], quantity
