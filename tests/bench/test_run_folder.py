"""Files of a bench that a power cut, another version or somebody else left: known, or none, never a trace."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hostile import few, for_long
from tumble.bench.authority import acting
from tumble.bench.bench import STATE, Bench
from tumble.bench.run_folder import ORDER, OUTCOME, RunFolder, runs_in
from tumble.bench.settings import BenchSettings
from tumble.bench.sources import BenchSource
from tumble.foundation.message import message
from tumble.logs.options import ReadOptions
from tumble.tools.guided.order import RunOrder, TableOrder
from tumble.tools.guided.outcome import FurthestParameter, RunOutcome, UnitOutcome

OTHERS = st.sampled_from([None, 0, -1, 1e308, True, "", "../x", [], {}, [1], {"a": 1}, [[]], {"text": 1}])


@pytest.fixture
def folder(tmp_path):
    """A folder with a run and its outcome, and with the state of a bench."""
    order = RunOrder(
        folder=tmp_path,
        sources={"a": "udp://127.0.0.1:29411"},
        reading={"a": ReadOptions(accelerometer_scale=(1.0, 2.0, 3.0), serial="1")},
        options={"rate": 10.0, "field": True, "limits": "limits.yaml"},
        table=TableOrder(address="simulated:two-axis"),
    )
    run = RunFolder.begin(tmp_path, "turntable", order)
    furthest = (FurthestParameter("accelerometer bias x", "m/s^2", 0.1, 0.01),)
    unit = UnitOutcome(name="a", verdict="passed", word="pass", furthest=furthest, page=run.path / "a.html")
    reason = message("{unit} was not turned", unit="a")
    run.keep_outcome(RunOutcome(verdict="passed", units=(unit,), reasons=(reason,)))
    bench = Bench(BenchSettings(folder=tmp_path, host="127.0.0.1", port=0))
    with acting(lambda: True):
        bench.add_source(BenchSource("reference", "udp://127.0.0.1:29411", "R-1"))
    bench.close()
    return tmp_path


def test_a_run_comes_back_from_its_folder_as_it_was(folder):
    (run,) = runs_in(folder)
    outcome, decision = run.outcome()
    assert decision == ""
    assert replace(run.order, folder=folder).reading["a"].accelerometer_scale == (1.0, 2.0, 3.0)
    assert run.order.options == {"rate": 10.0, "field": True, "limits": "limits.yaml"}
    assert [type(each) for each in run.order.options.values()] == [float, bool, str]
    assert str(outcome.reasons[0]) == "a was not turned"
    assert outcome.units[0].page == run.path / "a.html"


@st.composite
def changed(draw, content):
    """Plain data with a few values of other types, and without some keys."""
    if draw(st.integers(0, 14)) == 0:
        return draw(OTHERS)
    if isinstance(content, dict):
        return {key: draw(changed(each)) for key, each in content.items() if draw(st.integers(0, 30))}
    return [draw(changed(each)) for each in content] if isinstance(content, list) else content


def test_files_of_other_contents_are_no_run_and_no_state(folder):
    files = {path: json.loads(path.read_text()) for path in folder.rglob("*.json")}
    assert {path.name for path in files} == {ORDER, OUTCOME, STATE}
    run = next(path.parent for path in files if path.name == ORDER)

    @few
    @given(st.data())
    def check(data):
        for path, content in files.items():
            found = data.draw(changed(content)) if path.name != STATE else content
            path.write_text(json.dumps(found))
        for each in runs_in(folder):
            shown = each.outcome()
            assert each.path == run
            assert isinstance(each.order.sources, dict)
            assert shown is None or all(isinstance(unit.page, Path | None) for unit in shown[0].units)

    for_long(check, 0.5)


@pytest.mark.parametrize(
    "content", ["{}", '{"sources": [], "choice": []}', '{"sources": [{"name": {}}]}', "{1}"]
)
def test_a_state_of_other_contents_is_forgotten(folder, content):
    (folder / STATE).write_text(content)
    bench = Bench(BenchSettings(folder=folder, host="127.0.0.1", port=0))
    assert len(bench.sources) == 0
    bench.close()
