"""History, due dates and lots from the rows of a registry, on both engines."""

from __future__ import annotations

import json

import numpy as np
import pytest

from drifting_results import LIMITS, drifting
from made_up_calibrations import BIAS_SIGMA, COMMON_SIGMA, made_up, save
from tumble.calibration.limits import Limits
from tumble.foundation.errors import TumbleError
from tumble.laboratory.parameter_history import date_of, years_of
from tumble.laboratory.registry import Registry, UnitFacts
from tumble.laboratory.report.page import HISTORY_REPORT
from turntable_sessions import typed

NAME = "accelerometer bias x"


@pytest.fixture(scope="module", params=["sqlite", "postgresql"])
def fleet(request, address_on, tmp_path_factory):
    """Six units of a model with five calibrations each, which no test changes."""
    folder = tmp_path_factory.mktemp("fleet")
    registry = Registry.create(address_on(request.param, folder), documents=str(folder / "documents"))
    registry.add(drifting(folder / "results"), facts=UnitFacts(model="M1", lot="7"))
    return registry


def parameter(history, name=NAME):
    (found,) = [each for each in history.parameters if each.measured.name == name]
    return found


def test_a_unit_over_time_is_pooled_with_its_model(fleet):
    history = fleet.history("0003")
    found = parameter(history)
    assert (len(found.measured.values), history.pooled, found.walk.steps) == (5, 6, 24)
    assert list(found.measured.dates) == sorted(found.measured.dates)
    assert found.walk.low < 0.05**2 < found.walk.high
    assert found.limit == 0.5
    assert found.probability > 0.95
    assert history.due == min(each.due for each in history.parameters if each.due) > found.measured.dates[-1]
    assert len(history.to_pandas()) == 5 * 12
    assert fleet.due("0003") == history.due


def test_tighter_limits_are_due_earlier(fleet):
    tight = Limits.model_validate({"schema": "tumble-limits/1", "accelerometer": {"bias": 0.4}})
    wide = Limits.model_validate({"schema": "tumble-limits/1", "accelerometer": {"bias": 0.6}})
    assert fleet.due("0003", tight) < fleet.due("0003", wide)


def test_what_the_reference_leaves_on_all_values_is_apart(tmp_path):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(save(tmp_path / "a", made_up()))
    series = parameter(registry.history("0042")).measured.series
    assert series.variances == pytest.approx([BIAS_SIGMA**2 - COMMON_SIGMA**2])
    assert series.common == pytest.approx(COMMON_SIGMA**2)


def test_a_unit_alone_has_no_due_date_and_the_reason_is_said(tmp_path):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(save(tmp_path / "a", made_up(limits=LIMITS)))
    found = parameter(registry.history("0042"))
    assert (found.walk, found.due, found.probability) == (None, "", None)
    done = typed("registry", "due", "0042", "--registry", tmp_path / "lab.db")
    assert done.code == 0
    assert "No due date" in done.out
    assert "too few changes" in done.out


def test_a_superseded_result_and_a_run_taken_over_count_once(registry, tmp_path):
    dates = [f"202{n}-01-01T00:00:00Z" for n in range(3)]
    made = [made_up(log=str(n), date=date, bias=(n, 0, 0)) for n, date in enumerate(dates)]
    added = registry.add(save(tmp_path / "a", *made))
    corrected = made_up(log="2", date="2022-01-02T00:00:00Z", bias=(2.5, 0, 0))
    registry.add(save(tmp_path / "b", corrected), supersedes=added[2].identity)
    with_noise = made[1].content()
    with_noise["contributions"] = [
        {"gave": ["accelerometer noise"], "method": {"procedure": "noise"}, "date": "2025-01-01T00:00:00Z"}
    ]
    with_noise["accelerometer"]["noise_density"] = [1e-3] * 3
    registry.add(save(tmp_path / "c", type(corrected).model_validate(with_noise)))
    assert parameter(registry.history("0042")).measured.values == (0.0, 1.0, 2.5)


def test_a_due_unit_ends_the_command_with_3(tmp_path):
    registry = Registry.create(tmp_path / "lab.db")
    registry.add(drifting(tmp_path / "fleet", drift=0.3), facts=UnitFacts(model="M1"))
    done = typed("registry", "due", "--model", "M1", "--registry", tmp_path / "lab.db", "--json")
    assert done.code == 3
    assert any(each["due"] for each in json.loads(done.out)["units"])


def test_the_page_of_a_unit_shows_its_due_date(fleet, tmp_path):
    history = fleet.history("0002")
    HISTORY_REPORT.write(history, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert page.count("<svg") == 1
    assert f"Due on {history.due}" in page
    assert "unit_2" in page
    assert page.count("and its limits") == 2
    assert "nan" not in page.lower().replace("nanb", "")


def test_a_lot_has_a_capability_and_a_precision(fleet):
    lot = fleet.lot(lot="7")
    latest = [parameter(fleet.history(f"{n:04d}")).measured.values[-1] for n in range(6)]
    capable = lot.capabilities[NAME]
    assert capable.units == lot.units == 6
    assert capable.cp == pytest.approx(0.5 / (3 * np.std(latest, ddof=1)))
    assert capable.cpk <= capable.cp
    assert lot.precisions[NAME].repeats == 24
    assert {row["parameter"] for row in lot.rows()} >= {NAME}


def test_a_unit_that_is_unknown_or_two_is_one_line(fleet, tmp_path):
    with pytest.raises(TumbleError, match="no unit of the registry is called so"):
        fleet.history("9999")
    for model in ("M2", "M3"):
        twin = save(tmp_path / model, made_up(serial="twin", log=model))
        fleet.add(twin, facts=UnitFacts(model=model))
    with pytest.raises(TumbleError, match="several units"):
        fleet.history("twin")


def test_a_date_survives_the_way_to_years_and_back():
    assert date_of(years_of("2026-11-25T00:00:00Z")) == "2026-11-25"
    assert np.isnan(years_of("yesterday"))
