"""A simulated bench: a rate table with five targets, one of them faulty, a hand, a robot, a redundant set."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType

import numpy as np

from tumble.bench.sources import BenchSource
from tumble.foundation import clock
from tumble.tools.demo.scene import write_limits
from tumble.tools.guided.field import FieldValue
from tumble.tools.guided.view import RunView
from tumble.tools.simulate import LiveSimulation
from tumble.tools.simulate.grade import Grade
from tumble.tools.simulate.live.files import write_set
from tumble.tools.simulate.live.ports import free_port
from tumble.tools.simulate.live.scenario import LiveScenario

FAULTY = "target_4"
"""Its accelerometer has errors far beyond the limits."""
FAULTY_SCALE = 0.2
"""1-sigma of its scale, where the limits allow a quarter of that."""
GRADES = ("reference", "consumer", "industrial", "tactical", "faulty", "industrial")
REST = 40.0
"""s for which a robot stands still before it turns."""
SEED = 7
SET, SET_FILE = "redundancy", "set.yaml"
"""Word of the runs that watch the set, and the file with the mounting of its units."""


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """One simulation, and the names of its units on the bench."""

    scenario: LiveScenario
    kind: str = ""
    """Word of the only procedure it is for."""
    prefix: str = ""

    def named(self, unit: str) -> str:
        return f"{self.prefix}{unit}"


class SimulatedBench:
    """Serves simulated units over datagrams while it is entered, and a table over TCP.

    `speed` is how many simulated s there are in one of ours. Motions that end begin anew.
    """

    def __init__(self, folder: Path, *, speed: float = 1.0, rate: float = 200.0) -> None:
        self._folder = folder
        shared = LiveScenario(
            seed=SEED, speed=speed, rate_hz=rate, table_port=0, clock_skew_ppm=20.0, jitter_seconds=0.0005
        )
        parts = (
            _Part(replace(shared, grades=tuple(map(_grade, GRADES)))),
            _Part(replace(shared, motion="hand", told=True, rest_seconds=3.0), "multipose", "hand_"),
            _Part(replace(shared, motion="spin", rest_seconds=REST), "spin", "robot_"),
            _Part(replace(shared, motion="flight"), SET),
        )
        # A motion that begins anew does so on the same ports.
        self._parts = tuple(
            replace(part, scenario=replace(part.scenario, port=_ports(part))) for part in parts
        )
        self._asked: tuple[float, float, float] | None = None
        """Direction to which the hand turns."""
        self._stack = ExitStack()
        self._running: dict[_Part, LiveSimulation] = {}
        self._ends = threading.Event()
        self.sources: tuple[BenchSource, ...] = ()
        self.table = ""
        """Address of the table."""

    def __enter__(self) -> SimulatedBench:
        write_limits(self._folder)
        for part in self._parts:
            self._running[part] = simulation = LiveSimulation(part.scenario, self._folder).__enter__()
            self._stack.callback(self._leave, part)
            self.table = self.table or simulation.table_address or ""
            if part.kind == SET:
                write_set(simulation, self._folder / SET_FILE)
        self.sources = tuple(self._found())
        thread = clock.thread(self._keep_going, name="simulated bench")
        thread.start()
        self._stack.callback(clock.wait, thread)
        self._stack.callback(self._ends.set)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    def obey(self, word: str, view: RunView) -> None:
        """Turns the simulated hand to where a run of `word` asks a person to turn the unit."""
        for part, simulation in self._running.items():
            wanted = view.bodies[0].up_wanted if view.bodies else None
            if part.kind == word and simulation.hand is not None and wanted not in (None, self._asked):
                self._asked = wanted
                simulation.hand.go_to(np.array(wanted))

    @staticmethod
    def answers(word: str) -> dict[str, FieldValue]:
        """Returns the answers that suit the simulated units, for a kind of run."""
        return {"settings": SET_FILE} if word == SET else {}

    def _found(self) -> Iterator[BenchSource]:
        for part, simulation in self._running.items():
            for unit, address in simulation.addresses.items():
                yield BenchSource(
                    part.named(unit), address, _serial(part.named(unit)), kind=part.kind, origin="found"
                )

    def _leave(self, part: _Part) -> None:
        self._running[part].__exit__(None, None, None)

    def _keep_going(self) -> None:
        """Begins motions that have ended anew, on the same ports."""
        while not clock.wait(self._ends, 0.5):
            for part, simulation in self._running.items():
                if simulation.wait(0.0):
                    simulation.__exit__(None, None, None)
                    self._running[part] = LiveSimulation(part.scenario, self._folder).__enter__()


def _ports(part: _Part) -> int:
    """Returns the first of as many free ports in a row as the part has units."""
    count = len(part.scenario.usual_grades)
    while True:
        free = [free_port(part.scenario.host) for _ in range(count)]
        if free == list(range(free[0], free[0] + count)):
            return free[0]


def _grade(name: str) -> str | Grade:
    if name != "faulty":
        return name
    usual = Grade.named("industrial")
    return replace(usual, name=name, accelerometer=replace(usual.accelerometer, scale_error=FAULTY_SCALE))


def _serial(name: str) -> str:
    """Serial number of a reference; those of targets are for the operator to scan."""
    return "REF-0001" if name == "reference" else ""
