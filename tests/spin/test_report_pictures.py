"""Figures of a spin: every point where the result has it."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import report_spin_cases as spins
from tumble.procedures.spin.report.figures import (
    MOST_POINTS,
    force_errors,
    heading_figure,
    improvement_figure,
    level_floor_fit,
    noise_radii,
    rates_at_rest,
    scatter_figure,
    shown_blocks,
    time_figure,
)
from tumble.procedures.spin.report.sketch import lever_arm, spins_figure, top_view_figure
from tumble.report.svg import PAGE_COLOURS


def uses(svg):
    """(n, 2) places of all markers, in the order drawn."""
    found = [element for element in ElementTree.fromstring(svg).iter() if element.tag.endswith("use")]
    return np.array([(float(each.get("x")), float(each.get("y"))) for each in found])


def drawn(draw, *arguments):
    return draw(*arguments, "p")


def all_figures():
    spin = spins.spin()
    yield drawn(time_figure, spin)
    yield drawn(heading_figure, spin, spins.GRAVITY)
    yield drawn(scatter_figure, spin)
    yield drawn(improvement_figure, spin, spins.GRAVITY)
    yield drawn(top_view_figure, spin)
    yield drawn(spins_figure, spins.several())


def is_affine(shown, wanted):
    """Returns whether places on paper are the numbers, except for scale and origin."""
    design = np.column_stack([wanted, np.ones_like(wanted)])
    solution, *_ = np.linalg.lstsq(design, shown)
    return np.allclose(design @ solution, shown, atol=0.02)


def test_every_figure_is_well_formed_and_uses_page_colours():
    for svg in all_figures():
        ElementTree.fromstring(svg)
        assert not re.search(r"#[0-9a-fA-F]{6}\b", svg)
        assert set(re.findall(r"var\(--(\w+)\)", svg)) <= set(PAGE_COLOURS.values())


def test_the_scatter_has_a_point_for_every_block_where_it_belongs():
    blocks = spins.spin().blocks
    shown = uses(drawn(scatter_figure, spins.spin()))
    turning = blocks.resting < 0.5
    wanted = np.vstack([blocks.across[turning], blocks.across[~turning]])
    assert len(shown) == len(wanted)
    assert is_affine(shown[:, 0], wanted[:, 0])
    assert is_affine(shown[:, 1], wanted[:, 1])


def test_heading_figure_has_a_point_a_block_and_folds_the_heading():
    blocks = spins.spin().blocks
    shown = uses(drawn(heading_figure, spins.spin(), spins.GRAVITY))
    turning = blocks.resting < 0.5
    heading = np.degrees(blocks.heading) % 360.0
    count = len(blocks.time)
    assert len(shown) == 2 * count
    for side in range(2):
        part = shown[side * count : (side + 1) * count]
        assert is_affine(part[:, 0], np.concatenate([heading[turning], heading[~turning]]))
        force = blocks.force[:, side]
        assert is_affine(part[:, 1], np.concatenate([force[turning], force[~turning]]))


def test_a_level_floor_leaves_the_lever_arm_only():
    spin = spins.spin()
    level = level_floor_fit(spin, spins.GRAVITY)
    np.testing.assert_allclose(level, -np.outer(spin.blocks.rate**2, spins.ARM[:2]), rtol=0.0, atol=1e-9)
    assert level_floor_fit(spins.short_spin(), spins.GRAVITY) is None


def test_many_blocks_are_thinned_evenly_and_few_are_not():
    assert shown_blocks(spins.spin()).all()
    long = spins.spin(turned=400.0 * np.pi)
    kept = shown_blocks(long)
    assert 0.5 * MOST_POINTS <= kept.sum() <= MOST_POINTS
    assert len(set(np.diff(np.flatnonzero(kept)))) == 1


def test_noise_circle_holds_its_stated_share_of_means():
    seed = 20260101
    print(f"seed {seed}")
    each = round(spins.BLOCK * spins.RATE_HZ)
    samples = 0.002 * np.random.default_rng(seed).standard_normal((4000, each, 2))
    reach = np.linalg.norm(samples.mean(axis=1), axis=1)
    at_rest, _ = noise_radii(spins.spin())
    assert np.mean(reach < at_rest) == pytest.approx(0.95, abs=0.012)


def test_speeding_up_about_the_axis_does_not_widen_the_circle():
    """Scatter along the turning axis shows on each gyroscope as far as it leans that way."""
    noise, ramps = 0.002, 0.05
    scatter = np.sqrt(noise**2 + (ramps * spins.UP) ** 2)
    spin = replace(spins.spin(), noise=np.array([[0.02] * 3, [0.02] * 3, [noise] * 3, scatter]))
    at_rest, turning = noise_radii(spin)
    assert turning == pytest.approx(at_rest, rel=1e-6)


def test_rest_errors_are_those_of_readings_without_and_with_bias():
    spin = spins.spin()
    for k, rest in enumerate(spin.rests):
        before, after, _ = force_errors(spin, spins.GRAVITY)
        assert before[k] == pytest.approx(np.linalg.norm(rest.specific_force) - spins.GRAVITY)
        bias = spin.accelerometer_bias.value
        assert after[k] == pytest.approx(np.linalg.norm(rest.specific_force - bias) - spins.GRAVITY)
        before, after, _ = rates_at_rest(spin)
        assert before[k] == pytest.approx(np.linalg.norm(rest.angular_rate))
        assert after[k] == pytest.approx(np.linalg.norm(rest.angular_rate - spin.gyroscope_bias.value))
    assert len(uses(drawn(improvement_figure, spin, spins.GRAVITY))) == 4 * len(spin.rests)


def test_the_lever_arm_is_turned_into_the_floor_frame():
    arm = lever_arm(spins.spin())
    forward = np.array([1.0, 0.0, 0.0]) - spins.UP[0] * spins.UP
    forward /= np.linalg.norm(forward)
    assert arm.forward == pytest.approx(spins.ARM @ forward)
    assert arm.left == pytest.approx(spins.ARM @ np.cross(spins.UP, forward))
    assert lever_arm(spins.short_spin()) is None


def test_the_sketch_puts_the_imu_forward_and_to_the_right_where_it_is():
    svg = drawn(top_view_figure, spins.spin())
    cross = re.search(r">forward<", svg)
    assert cross
    (place,) = uses(svg)
    width, height = map(float, re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', svg).groups())
    right, up = place[0] - width / 2, height / 2 - place[1]
    arm = lever_arm(spins.spin())
    assert np.arctan2(up, right) == pytest.approx(np.arctan2(arm.forward, -arm.left), abs=0.01)
    assert "1.0300 ± 0.0031 deg" in svg


def test_a_sketch_without_tilt_and_lever_arm_shows_neither():
    svg = drawn(top_view_figure, spins.short_spin())
    assert len(uses(svg)) == 0
    assert ">uphill" not in svg


def test_the_spins_figure_has_a_point_for_every_axis_of_every_spin():
    result = spins.several()
    shown = uses(drawn(spins_figure, result))
    count = len(result.spins)
    assert len(shown) == 6 * count
    values = np.array([spin.accelerometer_bias.value for spin in result.spins])
    wanted = (values - result.accelerometer_bias.value).T.ravel()
    assert is_affine(shown[: 3 * count, 1], wanted)
