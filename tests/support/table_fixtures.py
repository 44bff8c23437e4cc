"""Tables to command: one that notes its commands, and simulated ones behind a TCP port."""

from __future__ import annotations

import threading
from contextlib import contextmanager

import numpy as np

from patience import PATIENCE
from tumble.foundation import clock
from tumble.tools.simulate.live.table_server import TableServer
from tumble.tools.table.profile import load_profile
from tumble.tools.table.simulated import PRESETS, SimulatedTable


class Clock:
    """The time of a table, s, which goes on by command."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


class NotingTable(SimulatedTable):
    """Notes every command; fails at a call of the name in `fails`, with that error."""

    def __init__(self, axes=PRESETS["two-axis"], now=clock.now, fails=None):
        super().__init__(axes, now)
        self.told = []
        self.fails = fails or {}
        self.left = False

    def __exit__(self, *error):
        self.left = True

    def _note(self, name):
        self.told.append(name)
        if name in self.fails:
            raise self.fails[name]

    def enable(self):
        self._note("enable")

    def goto(self, *figures):
        self._note("goto")
        super().goto(*figures)

    def rate(self, *figures):
        self._note("rate")
        super().rate(*figures)

    def settled(self):
        if "settled" in self.fails:
            raise self.fails["settled"]
        return super().settled()

    def position(self):
        if "position" in self.fails:
            raise self.fails["position"]
        return super().position()

    def stop(self):
        self.told.append("stop")
        if "stop" in self.fails:
            raise self.fails["stop"]
        super().rate(np.zeros(len(self.axes)), np.ones(len(self.axes)))


class ObservedTable:
    """Notes what a simulated table is commanded by whoever, so that a test waits for it."""

    def __init__(self, table):
        self.table = table
        self.told = []
        self._changed = threading.Condition()
        for name in ("move", "turn", "stop"):
            setattr(table, name, self._noting(name, getattr(table, name)))

    def _noting(self, name, act):
        def noted(*figures):
            act(*figures)
            # A simulated table turns at no rate to stop.
            if name != "turn" or np.any(figures[1]):
                with self._changed:
                    self.told.append(name)
                    self._changed.notify_all()

        return noted

    def wait(self, condition, patience=PATIENCE):
        """Waits until what was commanded fulfils a condition."""
        with self._changed:
            assert self._changed.wait_for(lambda: condition(self.told), patience), self.told

    def wait_until_it_moves(self):
        self.wait(lambda told: told and told[-1] != "stop")

    def wait_until_it_is_stopped(self):
        self.wait(lambda told: told and told[-1] == "stop")


@contextmanager
def served(profile_name):
    """Address of a simulated table that speaks the words of a profile, and the table."""
    profile = load_profile(profile_name)
    axes = tuple(axis.axis(profile.units) for axis in profile.axes)
    table = SimulatedTable(axes)
    with TableServer(table, profile, "127.0.0.1", 0) as server:
        yield f"text:TCPIP::127.0.0.1::{server.port}::SOCKET?profile={profile_name}", table
