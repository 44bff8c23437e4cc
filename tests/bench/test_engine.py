"""The engine runs one thing at a time, loses no event, and knows after a restart what was there."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace

import pytest

from ports import free_port
from tumble.bench import engine as engine_module
from tumble.bench.bench import Bench
from tumble.bench.engine import Engine
from tumble.bench.run_commands import CARRIED_OUT, CommandLog
from tumble.bench.run_folder import RunFolder, runs_in, unfinished
from tumble.bench.settings import BenchSettings
from tumble.bench.sources import BenchSource
from tumble.foundation import clock
from tumble.foundation.errors import ProcedureError, TumbleError
from tumble.foundation.message import message
from tumble.logs.options import ReadOptions
from tumble.tools.guided.order import RunOrder, TableOrder
from tumble.tools.guided.outcome import FurthestParameter, RunOutcome, UnitOutcome
from tumble.tools.guided.run import run_kinds
from tumble.tools.guided.view import RunAction, RunView

LOOK = 0.1
"""s between two looks of one that waits, by the simulated clock."""


class StandInRun:
    """A run that holds as many rests as the test lets it."""

    def __init__(self, order):
        self.order = order
        self.may_hold = 0
        self.is_stopped = False

    def views(self):
        (self.order.folder / "session").mkdir(exist_ok=True)
        (self.order.folder / "session" / "session.yaml").write_text("")
        for number in range(3):
            redo = RunAction("redo", message("Redo"), (f"pose {number}",))
            hold = message("Hold.")
            yield RunView(
                kind="held", elapsed=number, instruction=hold, subject=f"pose {number}", actions=(redo,)
            )
            while not (self.may_hold or self.is_stopped):
                clock.sleep(LOOK)
            if self.is_stopped:
                return
            self.may_hold -= 1
        yield RunView(kind="done", elapsed=3.0, instruction=message("Done."))

    def stop(self):
        self.is_stopped = True

    def act(self, action, subject=""):
        self.acted = (action, subject)

    def outcome(self):
        folder = self.order.folder
        furthest = FurthestParameter("accelerometer bias x", "m/s^2", math.nan, 0.1, 0.2, within=False)
        reason = message("{name} is {what}", name="a", what=message("out"))
        unit = UnitOutcome(
            name="a",
            serial="1",
            verdict="failed",
            word="fail",
            reasons=(reason,),
            furthest=(furthest,),
            page=folder / "a.html",
        )
        return RunOutcome(verdict="failed", units=(unit,), files={"report": folder / "all.html"})


class StandInKind:
    def __init__(self):
        self.runs = []

    def begin(self, order):
        if "refused" in order.options:
            raise ProcedureError("cannot be carried out")
        self.runs.append(StandInRun(order))
        return self.runs[-1]


@pytest.fixture
def kind(monkeypatch, simulated_clock):
    made = StandInKind()
    monkeypatch.setattr(engine_module, "run_kind", lambda _word: made)
    return made


@pytest.fixture
def order(tmp_path):
    return RunOrder(
        folder=tmp_path,
        sources={"a": "udp://:9000"},
        reading={"a": ReadOptions(rate=100.0)},
        table=TableOrder(address="simulated", armed=True),
        options={"seconds": 3.0},
    )


def ended(engine):
    clock.wait(engine._thread)
    return engine.state


def let_on(kind, times=1):
    while not kind.runs:
        clock.sleep(LOOK)
    kind.runs[-1].may_hold += times


def test_run_ends_in_an_outcome_that_a_restart_finds(tmp_path, kind, order):
    engine = Engine()
    engine.begin(RunFolder.begin(tmp_path, "turntable", order), order)
    with pytest.raises(TumbleError, match="under way"):
        engine.begin(RunFolder.begin(tmp_path, "turntable", order), order)
    let_on(kind, 3)
    assert ended(engine) == "result"
    assert [str(note.text) for note in engine.notes] == ["pose 0", "pose 1", "pose 2", ""]
    engine.decide("accepted")
    (run,) = [each for each in runs_in(tmp_path) if each.is_finished]
    outcome, decision = run.outcome()
    assert decision == "accepted"
    (unit,) = outcome.units
    assert str(unit.reasons[0]) == "a is out"
    assert math.isnan(unit.furthest[0].value)
    assert unit.page == run.path / "a.html"
    assert outcome.files == {"report": run.path / "all.html"}


def test_paused_run_goes_on_or_is_calibrated(tmp_path, kind, order):
    engine = Engine()
    folder = RunFolder.begin(tmp_path, "turntable", order)
    engine.begin(folder, order)
    while not engine.views:
        clock.sleep(LOOK)
    engine.pause(message("why"))
    assert ended(engine) == "paused"
    assert str(engine.trouble) == "why"
    assert unfinished(tmp_path).path == folder.path
    assert not engine.moves_table
    # One that was killed before it recorded anything hides it not.
    RunFolder.begin(tmp_path, "turntable", order)
    assert unfinished(tmp_path).path == folder.path
    engine.finish()
    assert ended(engine) == "result"
    assert unfinished(tmp_path) is None


def test_commands_stand_in_the_session_and_are_done_after_a_restart(tmp_path, kind, order):
    engine, folder = Engine(), RunFolder.begin(tmp_path, "turntable", order)
    engine.begin(folder, order)
    while not engine.views:
        clock.sleep(LOOK)
    engine.act("redo", "pose 0")
    engine.act("redo", "pose 2")
    engine.pause()
    ended(engine)
    again = Engine()
    again.adopt(folder)
    again.begin(folder, replace(order, resume=True))
    while not again.views:
        clock.sleep(LOOK)
    assert kind.runs[-1].acted == ("redo", "pose 2")
    let_on(kind, 3)
    assert ended(again) == "result"
    again.decide("accepted")
    with (folder.path / "session" / "commands.jsonl").open("a") as file:
        file.write('{"command": "cut o')
    given = [(each.command, each.subject) for each in CommandLog(folder.path).commands()]
    carried_out = [(CARRIED_OUT, "pose 0"), (CARRIED_OUT, "pose 2")]
    asked = [("redo", "pose 0"), ("redo", "pose 2"), ("pause", "")]
    assert given == [*asked, ("go on", ""), *carried_out, ("accepted", "")]
    assert CommandLog(folder.path).left(frozenset({"redo"})) == []


def go_on(engine, folder, order):
    engine.adopt(folder)
    engine.begin(folder, replace(order, resume=True))


def calibrate(engine, folder, _order):
    engine.adopt(folder)
    engine.finish()


def leave(engine, folder, _order):
    engine.adopt(folder)
    engine.leave()


def accept(engine, folder, _order):
    engine.show(folder)
    with suppress(TumbleError):
        engine.decide("accepted")


def state_below(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("act", [go_on, calibrate, leave, accept])
@pytest.mark.parametrize("name", ["", "session", "session/commands.jsonl", "outcome.json"])
def test_a_run_writes_nothing_through_a_link(tmp_path, kind, order, act, name):
    first = Engine()
    folder = RunFolder.begin(tmp_path / "bench", "turntable", order)
    first.begin(folder, order)
    let_on(kind, 3)
    assert ended(first) == "result"
    first.decide("accepted")
    if act is not accept:
        (folder.path / "outcome.json").unlink(missing_ok=name != "outcome.json")
    kind.runs.clear()
    place, outside = folder.path / name, tmp_path / "outside"
    outside.mkdir()
    if place.exists():
        place.rename(outside / "kept")
    place.symlink_to(outside / "kept")
    before = state_below(outside)
    engine = Engine()
    act(engine, folder, order)
    while engine.is_busy:
        for run in kind.runs:
            run.may_hold += 1
        clock.sleep(LOOK)
    assert act is not calibrate or "is kept" in str(engine.trouble)
    assert state_below(outside) == before
    assert place.is_symlink()


@pytest.mark.parametrize("kind", list(run_kinds()), ids=lambda kind: kind.word)
def test_no_kind_of_run_records_through_a_link(tmp_path, simulated_clock, kind):
    outside, run = tmp_path / "outside", tmp_path / "bench" / "run"
    outside.mkdir()
    run.mkdir(parents=True)
    (run / "session").symlink_to(outside)
    names = [f"{role.name}{number}" for role in kind.roles for number in range(role.fewest)]
    order = RunOrder(
        folder=run,
        sources={name: f"udp://127.0.0.1:{free_port()}" for name in names},
        roles={name: name[:-1] for name in names},
    )
    with suppress(TumbleError):
        began = kind.begin(order)
        views = began.views()
        next(views)
        began.stop()
        list(views)
    assert list(outside.iterdir()) == []


def test_refused_order_leaves_no_folder(tmp_path, kind, order):
    engine = Engine()
    refused = RunOrder(folder=tmp_path, sources={}, options={"refused": True})
    engine.begin(RunFolder.begin(tmp_path, "turntable", refused), refused)
    assert ended(engine) == "idle"
    assert str(engine.trouble) == "cannot be carried out"
    assert runs_in(tmp_path) == []


def test_table_is_disarmed_in_what_a_restart_reads(tmp_path, order):
    made = RunFolder.begin(tmp_path, "turntable", order)
    again = RunFolder.load(made.path)
    assert again.order.table == TableOrder(address="simulated", armed=False)
    assert again.order.reading == {"a": ReadOptions(rate=100.0)}
    assert again.order.sources == order.sources
    assert RunFolder.load(tmp_path) is None
    (made.path / "order.json").write_text("{")
    assert RunFolder.load(made.path) is None


def test_a_result_that_was_left_meanwhile_is_not_accepted(tmp_path, kind, order, monkeypatch):
    class SlowRegistry:
        def enter(self, _calibrations):
            bench.engine.leave()

    bench = Bench(BenchSettings(folder=tmp_path))
    monkeypatch.setattr(Bench, "registry", lambda _bench: SlowRegistry())
    try:
        bench.engine.begin(RunFolder.begin(tmp_path, "turntable", order), order)
        let_on(kind, 3)
        assert ended(bench.engine) == "result"
        with pytest.raises(TumbleError, match="left meanwhile"):
            bench.accept()
        (run,) = runs_in(tmp_path)
        assert run.outcome()[1] == ""
    finally:
        bench.close()


def test_bench_keeps_sources_and_serials_for_its_next_start(tmp_path):
    bench = Bench(BenchSettings(folder=tmp_path))
    try:
        bench.add_source(BenchSource("reference", f"udp://127.0.0.1:{free_port()}"))
        bench.add_source(BenchSource("one", f"udp://127.0.0.1:{free_port()}"))
        bench.add_source(BenchSource("two", f"udp://127.0.0.1:{free_port()}"))
        assert [bench.take_serial(text) for text in ("A", "B", "C")] == ["one", "two", ""]
        with pytest.raises(TumbleError, match="scanned already"):
            bench.take_serial("A")
        bench.answer("limits", "../limits.yaml")
        with pytest.raises(TumbleError, match="no such file"):
            bench.start()
        bench.answer("limits", "")
        bench.change_table(address="simulated:two-axis")
        bench.arm(bench.motion)
        assert bench.is_armed
    finally:
        bench.close()
    again = Bench(BenchSettings(folder=tmp_path))
    try:
        assert [(each.name, each.serial, each.role) for each in again.sources] == [
            ("reference", "", "reference"),
            ("one", "A", "target"),
            ("two", "B", "target"),
        ]
        assert again.choice.table.address == "simulated:two-axis"
        assert not again.is_armed
        assert [state.condition for state in map(again.sources.state, ("one", "two"))] == [
            "waiting",
            "waiting",
        ]
    finally:
        again.close()
