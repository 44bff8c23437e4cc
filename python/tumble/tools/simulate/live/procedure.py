"""A live bench: a scenario in, units and a table out that are read and commanded over real lines."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from tumble.foundation import clock
from tumble.live.address import CLOCK_RATE
from tumble.tools.simulate.live.fault import LiveFault, refuse_unknown_units
from tumble.tools.simulate.live.hand import JOINTS, Hand, joints_from_own, unit_in_hand
from tumble.tools.simulate.live.outlet import MavlinkOutlet, Outlet, PtyOutlet, TcpOutlet, UdpOutlet
from tumble.tools.simulate.live.playback import names_of, playback
from tumble.tools.simulate.live.ports import free_port
from tumble.tools.simulate.live.samples import NONE, Feed, Samples, delays, disturbed, shown
from tumble.tools.simulate.live.scenario import LiveScenario
from tumble.tools.simulate.live.table_server import TableServer
from tumble.tools.simulate.live.table_units import TableUnit, units_on
from tumble.tools.simulate.multipose.files import multipose_truth
from tumble.tools.simulate.turntable.files import truth_content
from tumble.tools.table.profile import load_profile
from tumble.tools.table.simulated import SimulatedTable

TICK = 0.005
"""s between two rounds in which samples are made and sent."""
BETWEEN_PROBES = 0.05
"""s between two looks whether somebody listens."""
REMEMBERED = 10.0
"""s for which the table knows where it was."""
WAY = b"way"
"""Distinguishes the random numbers of lines from those of units."""


class LiveUnit:
    """A unit that is read: its samples, what is wrong with them, their way, and the line."""

    def __init__(self, name: str, number: int, feed: Feed, outlet: Outlet, scenario: LiveScenario) -> None:
        self.name = name
        self.sent = 0
        """Samples that left."""
        self._feed = feed
        self._outlet = outlet
        self._scenario = scenario
        self.faults = tuple(scenario.faults.get(name, ()))
        self._random = np.random.default_rng([scenario.seed, number, *WAY])
        self._garble = np.random.default_rng([scenario.seed, number, *b"garble"])
        self._last = NONE
        self._waiting, self._due = NONE, np.empty(0)
        self._plugged = True

    @property
    def address(self) -> str:
        """Address from which it is read."""
        address, speed = self._outlet.address, self._scenario.speed
        mark = "&" if "?" in address else "?"
        return address if speed == 1.0 else f"{address}{mark}{CLOCK_RATE}={speed:g}"

    @property
    def lost(self) -> int:
        """Samples that its line did not take."""
        return self._outlet.lost

    def advance(self, now: float) -> None:
        """Generates samples up to `now`, and sends those that are due."""
        self._plug(now)
        self._take(now)
        ready = int(np.searchsorted(self._due, now, side="right"))
        if ready == 0:
            return
        leaving = self._waiting.where(slice(0, ready))
        self._waiting, self._due = self._waiting.where(slice(ready, None)), self._due[ready:]
        share = self._at(now, "garbled")
        self._outlet.send(leaving, self._garble if share else None, share)
        self.sent += ready

    def is_heard(self) -> bool:
        """Returns whether a client listens, as far as that can be known."""
        return self._outlet.is_heard()

    def close(self) -> None:
        """Closes the line for good."""
        self._outlet.unplug()

    def _take(self, now: float) -> None:
        taken = self._feed.until(now)
        if len(taken) == 0:
            return
        taken = disturbed(shown(taken, self._scenario.uptime), self.faults, self._last)
        self._last = self._last.then(taken).where(slice(-1, None))
        due = np.concatenate([self._due, taken.taken + self._delays(taken)])
        # A late sample delays those after it: samples on one line do not overtake.
        self._due = np.maximum.accumulate(due)
        self._waiting = self._waiting.then(taken)

    def _delays(self, taken: Samples) -> np.ndarray[Any, np.dtype[np.float64]]:
        scenario = self._scenario
        way = scenario.delay_seconds + scenario.jitter_seconds * self._random.standard_exponential(len(taken))
        if (batch := scenario.batch_seconds) > 0.0:
            way += np.ceil(taken.taken / batch) * batch - taken.taken
        return np.asarray(way + delays(taken, self.faults))

    def _plug(self, now: float) -> None:
        plugged = self._at(now, "unplugged") == 0.0
        if plugged != self._plugged:
            self._outlet.plug() if plugged else self._outlet.unplug()
            self._plugged = plugged

    def _at(self, now: float, kind: str) -> float:
        """Magnitude of a fault at a time, 0 where there is none; 1 for a fault without magnitude."""
        for fault in self.faults:
            start, end = fault.span
            if fault.kind == kind and start <= now < end:
                return fault.bad or 1.0
        return 0.0


class LiveSimulation:
    """Serves a table and units while it is entered; `wait` until it ends by itself.

    A table moves on command; any other motion begins once a client listens to a unit.

    `changes` are fields of `LiveScenario`, set on top of it or of its defaults. `folder` is where
    pseudo-terminals are linked.

    Raises `ScenarioError`, in one line, where a figure makes no sense or a port is taken.
    """

    def __init__(
        self,
        scenario: LiveScenario | None = None,
        folder: Path | str = ".",
        **changes: Any,  # noqa: ANN401
    ) -> None:
        self.scenario = replace(scenario or LiveScenario(), **changes)
        self.table: SimulatedTable | None = None
        """Table of the motion, or the joints of a hand."""
        self.truth: Mapping[str, Any] = {}
        """Truth of the units, as in `truth.yaml`."""
        self.lag = 0.0
        """s, at most, by which serving fell behind."""
        self.error: BaseException | None = None
        """Error that ended the simulation, where that was a bug."""
        self.hand: Hand | None = None
        """Hand of the motion; its direction can be commanded."""
        self._folder = Path(folder)
        self.units_on_table: Mapping[str, TableUnit] = {}
        """Units on a table with their motion; empty where there is none."""
        self._units: list[LiveUnit] = []
        self._server: TableServer | None = None
        self._stack = ExitStack()
        self._ended = threading.Event()
        self._end = self.scenario.end
        self._began = 0.0
        self._one_port = 0
        """That all units share, by MAVLink."""
        refuse_unknown_units(dict(self.scenario.faults), names_of(self.scenario))  # type: ignore[arg-type]

    def __enter__(self) -> LiveSimulation:
        with ExitStack() as stack:
            feeds = self._feeds(stack)
            for number, (name, feed) in enumerate(feeds.items()):
                unit = LiveUnit(name, number, feed, self._outlet(number, name), self.scenario)
                stack.callback(unit.close)
                self._units.append(unit)
            self._began = clock.now() if self._server is not None else 0.0
            thread = clock.thread(self._serve, name="bench")
            thread.start()
            stack.callback(clock.wait, thread)
            stack.callback(self._ended.set)
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()
        if self.error is not None and error is None:
            raise self.error

    @property
    def units(self) -> tuple[LiveUnit, ...]:
        """The units, the reference or the primary first."""
        return tuple(self._units)

    @property
    def addresses(self) -> dict[str, str]:
        """Address of each unit, by its name, for `--live`."""
        return {unit.name: unit.address for unit in self._units}

    @property
    def table_address(self) -> str | None:
        """Address of the table for `--table`; None where there is none."""
        if self._server is None:
            return None
        profile = self.scenario.table_profile
        return f"text:TCPIP::{self.scenario.host}::{self._server.port}::SOCKET?profile={profile}"

    def now(self) -> float:
        """Returns the bench's clock, s since it began."""
        return self.scenario.speed * (clock.now() - self._began) if self._began else 0.0

    def wait(self, timeout: float | None = None) -> bool:
        """Waits until it has ended, or for `timeout` s; whether it has ended."""
        return clock.wait(self._ended, timeout)

    def stop(self) -> None:
        """Requests the end of the simulation."""
        self._ended.set()

    def _feeds(self, stack: ExitStack) -> Mapping[str, Feed]:
        faults: dict[str, tuple[LiveFault, ...]] = {
            name: tuple(each) for name, each in self.scenario.faults.items()
        }
        if self.scenario.motion == "hand":
            return self._feed_in_hand(stack, faults)
        if self.scenario.motion != "table":
            played = playback(self.scenario, faults)
            self.truth = played.truth
            self._end = min(self._end, played.duration + 1.0)
            return played.feeds
        profile = load_profile(self.scenario.table_profile)
        axes = tuple(axis.axis(profile.units) for axis in profile.axes)
        self.table = SimulatedTable(axes, self.now, profile.name)
        session, feeds, noise = units_on(self.table, self.scenario, faults)
        self.units_on_table = feeds
        stack.callback(noise.close)
        content = truth_content(session)
        self.truth = {key: content[key] for key in content if key not in ("rests", "duration")}
        self._server = TableServer(self.table, profile, self.scenario.host, self.scenario.table_port)
        stack.enter_context(self._server)
        return feeds

    def _feed_in_hand(
        self, stack: ExitStack, faults: Mapping[str, tuple[LiveFault, ...]]
    ) -> Mapping[str, Feed]:
        self.table = SimulatedTable(JOINTS, self.now, "hand")
        found, feed, noise = unit_in_hand(self.table, self.scenario, faults)
        stack.callback(noise.close)
        self.hand = Hand(self.table, self.scenario, joints_from_own(found))
        content = multipose_truth(found)
        self.truth = {key: content[key] for key in content if key != "duration"}
        (name,) = names_of(self.scenario)
        return {name: feed}

    def _outlet(self, number: int, name: str) -> Outlet:
        scenario = self.scenario
        port = scenario.port + number if scenario.port else 0
        match scenario.transport:
            case "pty":
                return PtyOutlet(self._folder / name)
            case "tcp":
                return TcpOutlet(scenario.host, port)
            case "mavlink":
                self._one_port = self._one_port or scenario.port or free_port(scenario.host)
                return MavlinkOutlet(scenario.host, self._one_port, number)
        return UdpOutlet(scenario.host, port)

    def _serve(self) -> None:
        try:
            for now in self._rounds():
                if self.hand is not None and not self.hand.advance(now):
                    return
                for unit in self._units:
                    unit.advance(now)
                if self.table is not None:
                    self.table.forget_before(now - REMEMBERED * max(1.0, self.scenario.speed))
        except BaseException as error:
            self.error = error
        finally:
            self._ended.set()

    def _rounds(self) -> Iterator[float]:
        self._await_listener()
        due = clock.now()
        while not self._ended.is_set():
            now = self.now()
            yield min(now, self._end)
            if now >= self._end:
                return
            due += TICK
            wait = due - clock.now()
            self.lag = max(self.lag, -wait)
            if wait > 0.0:
                clock.wait(self._ended, wait)
            else:
                due = clock.now()

    def _await_listener(self) -> None:
        """Begins once somebody listens: nobody holds still for a program that is not there yet."""
        if self._began:
            return
        latest = clock.now() + self.scenario.end / self.scenario.speed
        while not any(unit.is_heard() for unit in self._units) and clock.now() < latest:
            if clock.wait(self._ended, BETWEEN_PROBES):
                return
        self._began = clock.now()
