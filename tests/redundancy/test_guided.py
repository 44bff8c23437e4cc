"""A set that a page watches: what is wrong and why, and the files that a replay of its session gives."""

from __future__ import annotations

import json

import pytest

import tumble
from redundancy_sets import BIASED, PRIMARY, SOUND, motion, record
from simulated_clock import SimulatedClock
from tumble.tools.guided.figures import DeviationFigure, EventFigure, StateFigure
from tumble.tools.guided.order import RunOrder
from tumble.tools.guided.run import run_kind

CHANGES = "collect=20; collect_timeout=60; evaluate_every=5"
SETTINGS = {"collect": 20.0, "collect_timeout": 60.0, "evaluate_every": 5.0}


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """Logs of a set, one unit biased and one that goes silent, replayed as fast as can be."""
    folder = tmp_path_factory.mktemp("logs")
    units = record([PRIMARY, BIASED, SOUND], 11, motion())
    units["imu3"] = units["imu3"].part(end=38.0)
    return {name: f"replay:{unit.write(folder / f'{name}.csv')}?speed=max" for name, unit in units.items()}


def order_of(folder, sources, **options):
    return RunOrder(
        folder=folder,
        sources=sources,
        roles={name: "primary" if name == "imu1" else "secondary" for name in sources},
        serials={"imu1": "0815"},
        options={"changes": CHANGES, **options},
    )


@pytest.fixture(scope="module")
def run(sources, tmp_path_factory):
    """Views and outcome of a watch, and its folder."""
    folder = tmp_path_factory.mktemp("set")
    with SimulatedClock():
        guided = run_kind("redundancy").begin(order_of(folder, sources))
        return list(guided.views()), guided.outcome(), folder


def figure_of(view, kind):
    return next(each for each in view.figures if isinstance(each, kind))


def test_units_are_shown_with_state_deviation_and_cause(run):
    views, _, _ = run
    rows = {row.name: row for row in figure_of(views[-1], StateFigure).rows}
    assert rows["imu1"].is_source
    assert "adopted" in str(rows["imu2"].cells[2])
    assert " of " in str(rows["imu2"].cells[0])
    assert rows["imu3"].healthy is False
    assert "late" in str(rows["imu3"].why)
    assert "Look for gaps in its log" in str(rows["imu3"].why)
    lamps = {lamp.name: lamp.state for lamp in views[-1].lamps}
    assert lamps == {"imu1": "good", "imu2": "good", "imu3": "faulty"}
    assert "imu3" in str(views[-1].instruction)


def test_deviations_are_drawn_against_their_thresholds(run):
    views, _, _ = run
    figure = figure_of(views[-1], DeviationFigure)
    assert figure.threshold == 1.0
    series = {each.name: each for each in figure.series}
    assert series["imu2"].value[0] > 1.0
    assert series["imu2"].value[-1] < 1.0
    assert all(time >= 0.0 for time in series["imu2"].time)


def test_a_fault_is_a_warning_and_an_event_of_the_list(run):
    views, _, _ = run
    warned = [view for view in views if view.kind == "warning"]
    assert [view.subject for view in warned] == ["imu3"]
    assert str(warned[0].warning).startswith("imu3: Unhealthy: late")
    lines = figure_of(views[-1], EventFigure).lines
    assert [line.time for line in lines] == sorted((line.time for line in lines), reverse=True)
    assert any(line.is_fault and line.unit == "imu3" for line in lines)


def test_files_are_those_of_a_replay_of_the_session(run):
    _, outcome, folder = run
    again = tumble.redundancy("imu1", ["imu2", "imu3"], log=folder / "session", settings=SETTINGS)
    files = again.save(folder / "again")
    events = [path.read_text(encoding="utf-8") for path in (outcome.files["events"], files["events"])]
    assert events[0] == events[1]
    assert any(json.loads(line)["event"] == "adopted" for line in events[0].splitlines())
    (calibrated,) = (unit for unit in outcome.units if unit.calibration)
    found = tumble.Calibration.load(calibrated.calibration)
    assert found.hash() == again.calibration_of("imu2").hash()


def test_outcome_names_the_worst_unit_and_why(run):
    _, outcome, _ = run
    units = {unit.name: unit for unit in outcome.units}
    assert (units["imu2"].verdict, units["imu2"].word) == ("passed", "adopted")
    assert (units["imu3"].verdict, units["imu3"].word) == ("failed", "unhealthy")
    assert "late" in str(units["imu3"].reasons[0])
    assert units["imu1"].serial == "0815"


@pytest.mark.usefixtures("simulated_clock")
@pytest.mark.parametrize("is_commanded", [False, True])
def test_set_is_calibrated_on_command_of_the_page(sources, tmp_path, is_commanded):
    pair = {name: sources[name] for name in ("imu1", "imu2")}
    never = "collect=20; collect_timeout=60; evaluate_every=none; evaluate_after_start=false"
    guided = run_kind("redundancy").begin(order_of(tmp_path, pair, changes=never))
    views = guided.views()
    actions = {action.name for action in next(views).actions}
    if is_commanded:
        guided.act("evaluate")
    last = list(views)[-1]
    assert actions == {"evaluate", "return to primary"}
    calibration = str(figure_of(last, StateFigure).rows[1].cells[2])
    assert calibration == ("adopted" if is_commanded else "")
