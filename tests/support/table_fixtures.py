"""Tables to command: one that notes its commands, and simulated ones behind a TCP port."""

from __future__ import annotations

from contextlib import contextmanager

import numpy as np

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


@contextmanager
def served(profile_name):
    """Address of a simulated table that speaks the words of a profile, and the table."""
    profile = load_profile(profile_name)
    axes = tuple(axis.axis(profile.units) for axis in profile.axes)
    table = SimulatedTable(axes)
    with TableServer(table, profile, "127.0.0.1", 0) as server:
        yield f"text:TCPIP::127.0.0.1::{server.port}::SOCKET?profile={profile_name}", table
