"""A table is armed for one motion and one holder of the bench: any other motion needs it anew."""

from __future__ import annotations

import math
from types import FunctionType

import pytest

from ports import free_port
from tumble.bench import engine as engine_module
from tumble.bench.authority import NotOperatorError, Shared, acting
from tumble.bench.bench import Bench
from tumble.bench.engine import Engine
from tumble.bench.fleet_view import FleetView
from tumble.bench.log.procedure_panel import Workplace
from tumble.bench.registry_view import RegistryView
from tumble.bench.run_folder import RunFolder
from tumble.bench.settings import BenchSettings
from tumble.bench.sources import BenchSource, BenchSources
from tumble.foundation.errors import TumbleError
from tumble.tools.guided.order import RunOrder, TableOrder
from tumble.tools.table.profile import profile_text
from tumble.tools.table.registry import open_table

POSES = "schema: tumble-poses/1\nposes:\n- {name: Z up, up: [0, 0, 1]}\n"


@pytest.fixture
def bench(tmp_path):
    (tmp_path / "poses.yaml").write_text(POSES)
    found = Bench(BenchSettings(folder=tmp_path))
    found.add_source(BenchSource("reference", f"udp://127.0.0.1:{free_port()}"))
    found.add_source(BenchSource("one", f"udp://127.0.0.1:{free_port()}"))
    found.change_table(address="simulated:two-axis", limits="rate=10")
    found.answer("poses", "poses.yaml")
    yield found
    found.close()


def handed_over(bench):
    one, other = (bench.access.enter("", "") for _ in range(2))
    bench.access.beat(one.key)
    bench.arm(bench.motion)
    bench.access.ask(other.key)
    bench.access.hand_over(one.key, other.number)


CHANGES = {
    "address": lambda bench: bench.change_table(address="simulated:one-axis"),
    "limits of motion": lambda bench: bench.change_table(limits="rate=11"),
    "time at each pose": lambda bench: bench.answer("pose_seconds", 3.0),
    "turns": lambda bench: bench.answer("turns", False),
    "pose list": lambda bench: bench.answer("poses", ""),
    "kind of run": lambda bench: bench.choose("multipose"),
    "holder": handed_over,
}


@pytest.mark.parametrize("change", CHANGES)
def test_any_change_of_the_motion_disarms_the_table(bench, change):
    bench.arm(bench.motion)
    assert bench.is_armed
    CHANGES[change](bench)
    assert not bench.is_armed


def test_a_pose_list_that_was_written_anew_moves_no_table(bench, tmp_path):
    bench.arm(bench.motion)
    (tmp_path / "poses.yaml").write_text(POSES.replace("[0, 0, 1]", "[0, 0, -1]"))
    with pytest.raises(TumbleError, match="what the table was armed for has changed"):
        bench.start()
    assert not bench.is_armed
    assert bench.engine.state == "idle"


@pytest.fixture
def profile(bench, tmp_path):
    """A profile of the user, which the table of the bench is named by."""
    path = tmp_path / "profiles" / "ours.yaml"
    path.parent.mkdir()
    path.write_text(profile_text("scpi"))
    bench.change_table(address=f"text:TCPIP::127.0.0.1::9::SOCKET?profile={path}")
    return path


def faster(path):
    """Writes a profile anew, with a higher rate."""
    path.write_text(path.read_text().replace("rate: 60.0", "rate: 170.0"))


def test_a_profile_that_was_written_anew_moves_no_table(bench, profile):
    bench.arm(bench.motion)
    faster(profile)
    with pytest.raises(TumbleError, match="what the table was armed for has changed"):
        bench.start()
    assert not bench.is_armed


def test_the_table_is_opened_with_the_profile_it_was_armed_for(bench, profile, monkeypatch):
    orders = []
    monkeypatch.setattr(bench.engine, "begin", lambda _folder, order: orders.append(order))
    bench.arm(bench.motion)
    bench.start()
    faster(profile)
    (table,) = (order.table for order in orders)
    armed, anew = open_table(table.address, table.documents), open_table(table.address)
    assert [round(math.degrees(each.axes[0].limits.rate)) for each in (armed, anew)] == [60, 170]


@pytest.mark.parametrize("file", ["profile", "poses"])
def test_a_paused_run_goes_on_with_the_files_that_were_shown(bench, profile, tmp_path, monkeypatch, file):
    orders, poses = [], tmp_path / "poses.yaml"
    table = TableOrder(address=bench.choice.table.address)
    order = RunOrder(folder=tmp_path, sources={}, options={"poses": str(poses)}, table=table)
    bench.engine.adopt(RunFolder.begin(tmp_path, "turntable", order))
    shown = bench.paused_motion
    if file == "profile":
        faster(profile)
    else:
        poses.write_text(POSES.replace("[0, 0, 1]", "[0, 0, -1]"))
    with pytest.raises(TumbleError, match="what the table was armed for has changed"):
        bench.resume(armed=shown)
    monkeypatch.setattr(bench.engine, "begin", lambda _folder, order: orders.append(order))
    bench.resume(armed=bench.paused_motion)
    assert orders[0].table.documents == {"profile": profile.read_text()}


def test_what_is_changed_and_changed_back_stays_disarmed(bench):
    bench.arm(bench.motion)
    bench.change_table(address="simulated:one-axis")
    bench.change_table(address="simulated:two-axis")
    assert not bench.is_armed
    bench.arm(bench.motion)
    bench.choose("multipose")
    bench.choose("turntable")
    assert not bench.is_armed


def test_a_table_is_armed_for_one_start(bench, monkeypatch):
    orders = []

    class Kind:
        def begin(self, order):
            orders.append(order)
            raise TumbleError("not in this test")

    monkeypatch.setattr(engine_module, "run_kind", lambda _word: Kind())
    for _ in range(2):
        if not orders:
            bench.arm(bench.motion)
        bench.start()
        bench.engine._thread.join()
    armed, by_hand = orders
    assert (armed.table.address, armed.table.limits, armed.table.armed) == (
        "simulated:two-axis",
        "rate=10",
        True,
    )
    assert by_hand.table is None


def test_a_paused_run_moves_no_other_table_than_was_shown(bench, tmp_path):
    table = TableOrder(address="simulated:two-axis")
    order = RunOrder(folder=tmp_path, sources={}, table=table)
    bench.engine.adopt(RunFolder.begin(tmp_path, "turntable", order))
    shown = bench.paused_motion
    assert shown.table == table
    bench.change_table(address="simulated:one-axis")
    for armed in (shown, None):
        with pytest.raises(TumbleError, match="what the table was armed for has changed"):
            bench.resume(armed=armed)
    assert bench.engine.state == "paused"


def test_only_those_who_may_operate_stop_a_run(tmp_path, monkeypatch):
    bench = Bench(BenchSettings(folder=tmp_path, host="127.0.0.2"))
    paused = []
    monkeypatch.setattr(bench.engine, "pause", paused.append)
    bench.engine.state = "running"
    with acting(lambda: False):
        bench.stop(bench.access.enter(bench.access.viewer_token, ""))
        assert paused == []
        bench.stop(bench.access.enter(bench.access.token, ""))
        assert len(paused) == 1
    bench.engine.state = "idle"
    monkeypatch.undo()
    bench.close()


def test_results_of_a_procedure_are_written_for_the_operator_only(tmp_path):
    workplace = Workplace(tmp_path, is_bound=True)
    assert workplace.place("again") == tmp_path / "again"
    with acting(lambda: False), pytest.raises(NotOperatorError):
        workplace.place("again")


@pytest.mark.parametrize("kind", [Bench, Engine, BenchSources, RegistryView, FleetView])
def test_each_method_of_shared_state_is_a_query_or_guarded(kind):
    assert issubclass(kind, Shared)
    guarded = [
        name
        for name, each in vars(kind).items()
        if isinstance(each, FunctionType)
        and hasattr(each, "__wrapped__")
        and not hasattr(each, "is_query")
        and not name.startswith("_")
    ]
    assert guarded
    nobody = object.__new__(kind)
    with acting(lambda: False):
        for name in guarded:
            with pytest.raises(NotOperatorError):
                getattr(nobody, name)()
        with pytest.raises(NotOperatorError):
            nobody.anything = 1
