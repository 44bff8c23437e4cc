"""Files of a bench that a power cut, another version or somebody else left: known, or none, never a trace."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hostile import few, for_long
from ports import free_port
from tumble.bench import run_folder
from tumble.bench.authority import acting
from tumble.bench.bench import STATE, Bench
from tumble.bench.run_commands import COMMANDS, CommandLog
from tumble.bench.run_folder import ORDER, OUTCOME, RunFolder, runs_in
from tumble.bench.settings import BenchSettings
from tumble.bench.sources import BenchSource
from tumble.foundation.errors import PlaceError
from tumble.foundation.message import message
from tumble.foundation.translation import LANGUAGES, speaking, translated
from tumble.logs.options import ReadOptions
from tumble.tools.guided.order import RunOrder, TableOrder
from tumble.tools.guided.outcome import FurthestParameter, RunOutcome, UnitOutcome

OTHERS = st.sampled_from([None, 0, -1, 1e308, True, "", "../x", [], {}, [1], {"a": 1}, [[]], {"text": 1}])


@pytest.fixture
def folder(tmp_path):
    """A folder with a run and its outcome, and with the state of a bench."""
    order = RunOrder(
        folder=tmp_path,
        sources={"a": f"udp://127.0.0.1:{free_port()}"},
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
        bench.add_source(BenchSource("reference", f"udp://127.0.0.1:{free_port()}", "R-1"))
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


def test_an_order_is_read_again_only_once_it_has_changed(folder, monkeypatch):
    (before,) = runs_in(folder)
    read, reads = run_folder.read_whole, []
    monkeypatch.setattr(run_folder, "read_whole", lambda *given: reads.append(given) or read(*given))
    assert runs_in(folder) == [before]
    assert reads == []
    path = before.path / ORDER
    path.write_text(path.read_text().replace("turntable", "multipose"))
    (after,) = runs_in(folder)
    assert (after.word, len(reads)) == ("multipose", 1)


def test_commands_are_known_however_long_their_file(folder):
    (run,) = runs_in(folder)
    path = run.path / "session" / COMMANDS
    path.parent.mkdir()
    log = CommandLog(run.path)
    log.add("redo", "pose 0")
    with path.open("ab") as file:
        for each in (b"\xff\xfe", b"[" * 100_000, b'{"command": {}, "elapsed": "x"}', b"x" * (5 << 20)):
            file.write(each + b"\n")
    log.add("redo", "pose 1")
    assert [each.subject for each in log.left(frozenset({"redo"}))] == ["pose 0", "pose 1"]
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(PlaceError, match="is a device or a pipe"):
        log.left(frozenset({"redo"}))


HOSTILE_MESSAGES = (
    {"text": "{unit:>9999999}", "values": {"unit": "a"}},
    {"text": "{unit.__class__.__init__}", "values": {"unit": "a"}},
    {"text": "{0} {unit[0]} {unit!r} {", "values": {"unit": "a"}},
    {"text": "{unit} was not turned", "values": {"other": "a"}},
    {"text": "{unit}" * 10_000, "values": {"unit": "x" * 10_000}},
    {"text": "{unit}" * 100, "values": {"unit": {"text": "{unit}" * 100, "values": {"unit": "x" * 1000}}}},
    {"text": "{unit} was not turned", "values": {"unit": "\x1b[31m{unit}"}},
)


@pytest.mark.parametrize("language", LANGUAGES)
def test_places_of_a_stored_message_are_names_and_no_more(folder, language):
    (path,) = folder.rglob(OUTCOME)
    content, shown = json.loads(path.read_text()), []
    for each in HOSTILE_MESSAGES:
        content["outcome"]["reasons"] = [each]
        path.write_text(json.dumps(content))
        found = runs_in(folder)[0].outcome()
        if found is None:
            continue
        (reason,) = found[0].reasons
        with speaking(language):
            shown += [str(reason), translated(reason.text, **reason.values)]
    assert len(shown) == 10
    assert max(map(len, shown)) < 100


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
    "content", ["{%s}", '{%s, "sources": [], "choice": []}', '{%s, "sources": [{"name": {}}]}', "{%s, 1}"]
)
def test_a_state_of_other_contents_is_forgotten(folder, content):
    (folder / STATE).write_text(content % '"software": "tumble bench"')
    bench = Bench(BenchSettings(folder=folder, host="127.0.0.1", port=0))
    assert len(bench.sources) == 0
    bench.close()
