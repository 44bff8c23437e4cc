"""A bench that is killed between any two operations on files: a restart finds all that it had reported."""

from __future__ import annotations

import random
import socket
from contextlib import closing, suppress

import pytest

from killed_operations import killed_at
from made_up_calibrations import made_up
from ports import free_port
from repetitions import SOAK, drawn_seed
from tumble.bench import engine as engine_module
from tumble.bench.bench import Bench
from tumble.bench.run_folder import ACCEPTED, runs_in
from tumble.bench.settings import BenchSettings
from tumble.bench.sources import BenchSource, BenchSources
from tumble.calibration.document import Calibration
from tumble.foundation import clock
from tumble.foundation.message import message
from tumble.laboratory.registry import Registry
from tumble.tools.guided.outcome import RunOutcome, UnitOutcome
from tumble.tools.guided.view import RunView
from turntable_sessions import typed

DAYS = 25 if SOAK else 1
KILLS = 4
"""Kills of one day."""
MOST_OPERATIONS = 80
"""Operations of a day, and some beyond."""
NAMES = ["reference", "one"]
FILE = "unit.yaml"


class QuickRun:
    """A run that records at once, and calibrates what it has recorded."""

    def __init__(self, order):
        self._order = order

    def views(self):
        session = self._order.folder / "session"
        session.mkdir(exist_ok=True)
        (session / "session.yaml").write_text("")
        yield RunView(kind="done", elapsed=1.0, instruction=message("Done."))

    def stop(self):
        """Has nothing to stop."""

    def outcome(self):
        made_up().save(self._order.folder / FILE)
        unit = UnitOutcome(name="unit", verdict="passed", word="pass", calibration=self._order.folder / FILE)
        return RunOutcome(verdict="passed", units=(unit,))


class QuickKind:
    begin = QuickRun


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Gives settings of a new bench with a registry, whose runs take no time."""
    monkeypatch.setattr(engine_module, "run_kind", lambda _word: QuickKind)
    monkeypatch.setattr(BenchSources, "watch", lambda _self, _on: None)

    def made(number):
        registry = tmp_path / f"{number}.db"
        typed("registry", "init", registry, "--laboratory", "Inertial laboratory")
        return BenchSettings(folder=tmp_path / f"bench-{number}", registry=str(registry))

    return made


def day(settings, reports, ports):
    """Works as an operator does, from where the bench is; `reports` gets a letter for what a page shows.

    Sources have a port each: a fork would choose that of another fork again.
    """
    with closing(Bench(settings)) as bench:
        bench.choose("turntable")
        for name, port in zip(NAMES, ports, strict=True):
            if name not in [each.name for each in bench.sources]:
                bench.add_source(BenchSource(name, f"udp://127.0.0.1:{port}"))
        reports.send(b"s")
        engine, finished = bench.engine, [run for run in bench.earlier() if run.is_finished]
        if bench.offered is not None:
            bench.adopt_offer()
            engine.finish()
        elif finished:
            engine.show(finished[0])
        else:
            bench.start()
        if engine._thread is not None:
            clock.wait(engine._thread)
        assert engine.state == "result", engine.trouble
        reports.send(b"r")
        bench.accept()
        reports.send(b"a")


def look(settings, reported):
    """Compares what a restart finds with what was reported."""
    with closing(Bench(settings)) as bench:
        found = [each.name for each in bench.sources]
    runs = [run for run in runs_in(settings.folder) if run.is_finished]
    outcomes = [run.outcome() for run in runs]
    assert len(runs) <= 1
    assert None not in outcomes
    for run in runs:
        assert Calibration.load(run.path / FILE).content() == made_up().content()
    entered = len(list(Registry(settings.registry).list()))
    assert entered <= len(runs)
    if b"s" in reported:
        assert found == NAMES
    if b"r" in reported:
        assert [outcome.units[0].verdict for outcome, _ in outcomes] == ["passed"]
    if b"a" in reported:
        assert [decision for _, decision in outcomes] == [ACCEPTED]
        assert entered == 1


def test_a_killed_bench_loses_and_doubles_nothing(place):
    chance = random.Random(drawn_seed())
    for each in range(DAYS):
        settings, reported = place(each), b""
        ports = [free_port() for _ in NAMES]
        ours, told = socket.socketpair(type=socket.SOCK_DGRAM)
        ours.setblocking(False)
        for number in [*(chance.randrange(1, MOST_OPERATIONS) for _ in range(KILLS)), 0]:
            print(each, number)
            killed_at(lambda now=settings, to=told, at=ports: day(now, to, at), number)
            with suppress(BlockingIOError):
                while True:
                    reported += ours.recv(1)
            look(settings, reported)
        assert b"a" in reported
