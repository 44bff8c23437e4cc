"""Python agrees with the conformance vectors that Rust, and later C and the firmware, are held against."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tumble import _core

VECTORS = Path(__file__).parents[1] / "vectors"


def vectors(name):
    content = json.loads((VECTORS / f"{name}.json").read_text())
    return content["cases"], content["tolerance"]["f64"]


def test_corrections_agree_with_their_vectors():
    cases, tolerance = vectors("model")
    for case in cases:
        y, m, b = (np.array(case[key], dtype=np.float64) for key in ("y", "M", "b"))
        np.testing.assert_allclose(_core.correct(y[None, :], m, b)[0], case["corrected"], atol=20 * tolerance)


def test_normal_gravity_agrees_with_its_vectors():
    cases, tolerance = vectors("gravity")
    for case in cases:
        found = _core.normal_gravity(np.radians(case["latitude_deg"]), case["height_m"])
        assert found == pytest.approx(case["gravity"], abs=tolerance)


@pytest.mark.parametrize("chunk", [1, 7, 100, 10_000])
def test_rests_and_turns_agree_with_their_vectors_whatever_the_chunks(chunk):
    case, _ = vectors("stream")
    counts = np.array(case["counts"], dtype=np.float64)
    time = np.arange(len(counts)) * case["interval_us"] * 1e-6
    force = np.ascontiguousarray(counts[:, :3] * case["force_step"])
    rate = np.ascontiguousarray(counts[:, 3:] * case["rate_step"])
    segmenter = _core.Segmenter()
    for start in range(0, len(time), chunk):
        part = slice(start, start + chunk)
        segmenter.push(time[part], force[part], rate[part])
    unit = segmenter.finish()
    np.testing.assert_allclose(unit.rest_times, case["rests_s"], atol=case["boundary_tolerance_s"])
    np.testing.assert_allclose(
        unit.rest_angular_rate, [case["bias"]] * len(case["rests_s"]), atol=case["bias_tolerance"]
    )
    between = unit.rest_times[1, 0] - unit.rest_times[0, 1]
    turned = unit.turn_angles[0] - between * np.array(case["bias"])
    np.testing.assert_allclose(turned, case["turn_angle"], atol=case["turn_angle_tolerance"])
