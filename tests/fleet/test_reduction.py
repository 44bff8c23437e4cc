"""Summaries over units: who moved beyond chance, drift that is known, values that are counted once."""

import numpy as np

from made_up_fleets import NAME, U, outcomes_of
from repetitions import repetitions
from tumble.fleet.parts import Outcome, write_parts
from tumble.fleet.places import FileStore
from tumble.fleet.reduction import FALSE_DISCOVERIES, summarize
from tumble.fleet.report.page import FLEET_REPORT
from tumble.fleet.summary_document import result_content


def store_of(folder, values, years=(0, 1)):
    """Writes results of units: `values` is (units, calibrations), `years` are counted from 2020."""
    store = FileStore(str(folder))
    write_parts(store, outcomes_of(values, [2020 + year for year in years], "lot"))
    return store


def test_share_of_false_discoveries_is_as_stated(tmp_path):
    shares, found = [], 0
    fleets = repetitions(80)
    for seed in range(fleets):
        draws = np.random.default_rng(seed)
        first = draws.normal(0.0, 0.02, 200)
        moved = np.where(np.arange(200) < 10, 8e-3, 0.0)
        values = np.stack([first, first + moved], axis=1) + draws.normal(0.0, U, (200, 2))
        # Without dates there is no drift in (15): a change is held against measurement alone.
        store = FileStore(str(tmp_path / str(seed)))
        outcomes = [
            Outcome(
                key=f"{unit:08d}{k:08d}".encode(), place="", unit=f"unit{unit}", verdict="calibrated",
                parameters=({"name": NAME, "unit": "m/s^2", "value": float(value), "u": U, "common": 0.0},),
            )
            for unit, own in enumerate(values)
            for k, value in enumerate(own)
        ]  # fmt: skip
        write_parts(store, outcomes)
        named = {each.name for each in summarize(store).moved}
        true = {f"unit{unit}" for unit in range(10)}
        shares.append(len(named - true) / max(1, len(named)))
        found += len(named & true)
    sigma = np.std(shares, ddof=1) / np.sqrt(fleets)
    # The rule gives 5 % of the 95 % that did not move.
    assert abs(np.mean(shares) - 0.95 * FALSE_DISCOVERIES) < 4.0 * sigma + 1e-9, (
        f"{np.mean(shares)} ± {sigma}"
    )
    assert found / (10 * fleets) > 0.95


def test_drift_of_a_model_is_found_and_explains_changes(tmp_path):
    draws = np.random.default_rng(3)
    steps = draws.normal(0.0, 5e-3, (60, 4))
    values = np.cumsum(steps, axis=1) + draws.normal(0.0, U, (60, 4))
    summary = summarize(store_of(tmp_path, values, years=(0, 1, 2, 3)))
    [drift] = summary.drift
    assert drift.walk.low < 5e-3**2 < drift.walk.high
    assert drift.walk.units == 60
    assert [(each.lot, each.walk.units) for each in summary.lot_drift] == [("lot0", 30), ("lot1", 30)]
    assert all(each.walk.low < 5e-3**2 < each.walk.high for each in summary.lot_drift)
    printed = result_content(summary, "results", {})["lot_drift"]
    assert [(each["lot"], each["q"]) for each in printed] == [
        (each.lot, each.walk.q) for each in summary.lot_drift
    ]
    # Units that only drift as all of their model do are no outliers, but for one in twenty fleets.
    assert len(summary.moved) <= 1
    assert summary.tested == 60


def test_input_computed_twice_counts_once(tmp_path):
    store = store_of(tmp_path, np.zeros((4, 2)))
    [first] = outcomes_of(np.zeros((1, 1)), [2020])
    again = [Outcome(key=first.key, place=first.place, unit=first.unit, verdict="calibrated")]
    write_parts(store, again)
    assert summarize(store).inputs == 8


def test_mended_failure_leaves_no_trace(tmp_path):
    store = FileStore(str(tmp_path))
    key, other = b"k" * 16, b"o" * 16
    write_parts(store, [Outcome(key, "a", failure="cannot be read", transient=True), Outcome(other, "b")])
    write_parts(store, [Outcome(key, "a", verdict="calibrated")])
    assert summarize(store).failures == {}
    assert summarize(store).inputs == 2


def test_page_shows_each_part_and_escapes_names(tmp_path):
    values = np.zeros((12, 2))
    values[:, 1] = np.where(np.arange(12) == 3, 0.5, 0.0)
    store = store_of(tmp_path / "r", values + np.random.default_rng(0).normal(0, U, (12, 2)))
    write_parts(store, [Outcome(b"x" * 16, "<script>alert(1)</script>", failure="<b>bad</b>")])
    path = tmp_path / "fleet.html"
    FLEET_REPORT.write(summarize(store), path)
    text = path.read_text()
    assert "<script>alert(1)" not in text
    assert "&lt;b&gt;bad&lt;/b&gt;" in text
    assert "unit3" in text
    assert text.count("<svg") >= 1
