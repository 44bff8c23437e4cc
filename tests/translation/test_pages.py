"""Pages of results in Chinese, one of each kind, as they were looked at last."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

import compare_units
import report_fixtures as sessions
import report_redundancy_cases as missions
import report_spin_cases as spins
import tumble
from align_motions import Motion, Sensor, drawn, recordings
from drifting_results import drifting
from plateau_units import PlateauUnit
from report_reader import Page
from tumble.foundation.provenance import UNKNOWN
from tumble.foundation.translation import speaking
from tumble.laboratory.registry import Registry, UnitFacts
from tumble.laboratory.report.page import HISTORY_REPORT
from tumble.procedures.align.procedure import align
from tumble.procedures.align.report.page import ALIGN_REPORT
from tumble.procedures.magnetometer.report.page import MAGNETOMETER_REPORT
from tumble.procedures.multipose.report.page import MULTIPOSE_REPORT
from tumble.procedures.noise.report.page import NOISE_REPORT
from tumble.procedures.redundancy.report.page import REDUNDANCY_REPORT
from tumble.procedures.spin.report.page import SPIN_REPORT
from tumble.procedures.thermal.report.page import THERMAL_REPORT
from tumble.procedures.turntable.report.pages import records_of, render_batch, render_target
from tumble.tools.compare.report.page import COMPARE_REPORT
from tumble.tools.plateaus.report.page import PLATEAUS_REPORT


def rendered(report, result):
    found = replace(result, provenance=UNKNOWN)
    return lambda: report.render(found)


def turntable():
    batch = sessions.batch()
    return lambda: render_target(batch, batch.targets[0])


def batch():
    found = sessions.batch()
    return lambda: render_batch(found, records_of(found))


def aligned():
    units = recordings(Motion(71), (Sensor(rate_hz=100.0), drawn(71, rate_hz=100.0)), 30.0)
    return rendered(ALIGN_REPORT, align(units[0], units[1:]))


def compared():
    generator = np.random.default_rng(5)
    unit = compare_units.truth(generator)
    result = tumble.compare([compare_units.drawn(generator, unit), compare_units.drawn(generator, unit)])
    return lambda: COMPARE_REPORT.render(result)


PAGES = {
    "turntable": lambda _: turntable(),
    "batch": lambda _: batch(),
    "spin": lambda _: rendered(SPIN_REPORT, spins.several()),
    "redundancy": lambda _: rendered(REDUNDANCY_REPORT, missions.mission()),
    "align": lambda _: aligned(),
    "multipose": lambda _: rendered(
        MULTIPOSE_REPORT, tumble.multipose(tumble.simulate_multipose(seed=7).recording)
    ),
    "magnetometer": lambda _: rendered(
        MAGNETOMETER_REPORT, tumble.magnetometer(tumble.simulate_magnetometer(seed=7).recording)
    ),
    "noise": lambda _: rendered(
        NOISE_REPORT, tumble.noise(tumble.simulate_static(duration=360.0, seed=3).recording)
    ),
    "thermal": lambda _: rendered(THERMAL_REPORT, tumble.thermal(tumble.simulate_thermal(seed=3).recording)),
    "compare": lambda _: compared(),
    "plateaus": lambda _: rendered(
        PLATEAUS_REPORT, tumble.plateaus(PlateauUnit(np.random.default_rng(5), bias=(1e-4,)).sessions())
    ),
    "history": lambda folder: history(folder),
}


def history(folder):
    registry = Registry.create(folder / "lab.db")
    registry.add(drifting(folder / "fleet"), facts=UnitFacts(model="M1", lot="7"))
    found = registry.history("0003")
    return lambda: HISTORY_REPORT.render(found)


def lines(page):
    words = (" ".join(text.split()) for text in Page(page).text)
    return "\n".join(word for word in words if word)


def numbers(page):
    """Those of two digits or more: words such as `one sigma` have a digit in Chinese."""
    return Counter(re.findall(r"\d+\.\d+|\d{2,}", lines(page)))


@pytest.mark.parametrize("name", PAGES)
def test_a_chinese_page_has_the_numbers_of_the_english_one(name, snapshot, tmp_path):
    render = PAGES[name](tmp_path)
    english = render()
    with speaking("zh-CN"):
        chinese = render()
    assert '<html lang="en">' in english
    assert '<html lang="zh-CN">' in chinese
    assert numbers(chinese) == numbers(english)
    assert re.findall(r"<(\w+)", chinese) == re.findall(r"<(\w+)", english)
    assert lines(chinese) == snapshot
