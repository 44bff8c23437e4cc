"""A table with one axis does what it can; the guide then asks for the other poses by hand."""

from __future__ import annotations

import numpy as np

from live_benches import simulated_bench, words_of
from tumble.live import open_set
from tumble.procedures.turntable import live
from tumble.procedures.turntable.live import LiveTurntable
from tumble.procedures.turntable.table_drive import TableDrive, angles_at
from tumble.procedures.turntable.table_plan import planned
from tumble.tools.table.guarded import GuardedTable
from tumble.tools.table.registry import open_table
from tumble.tools.table.simulated import PRESETS
from turntable_sessions import typed


class OneAxis:
    """The inner axis of a table of two, as if it were all of it."""

    def __init__(self, table):
        self._table, self.axes, self.name = table, (table.axes[1],), "one-axis"

    def settled(self):
        return self._table.settled()

    def position(self):
        return self._table.position()[1:]

    def goto(self, angles, rates=None):
        return self._table.goto(np.append(self._table.position()[0], angles))


def test_a_plan_names_the_poses_for_the_hand(tmp_path):
    done = typed(
        *("turntable", "--live", "reference=udp://:45871", "target_1=udp://:45872"),
        *("--table", "simulated:one-axis", "--poses", "six-faces", "-o", tmp_path),
    )
    assert done.code == 0, done.err
    assert "by hand, after all of that: X up, X down, Y up, Y down and Z down" in done.err
    plan, poses, by_hand = planned(PRESETS["one-axis"], 5.0, live.SIX_FACES, turns=True)
    assert len(plan.angles) == 1
    assert len(poses) == 6
    assert len(by_hand) == 5


def test_a_table_hands_over_to_the_hand_when_it_has_done_what_it_can(tmp_path):
    with simulated_bench(seed=97) as bench:
        table = open_table(bench.table_address)
        plan, poses, by_hand = planned((table.axes[1],), 3.0, live.SIX_FACES, turns=False)
        turned = dict(zip((pose.name for pose in poses), angles_at(table.axes, poses)[0], strict=True))
        with GuardedTable(table, armed=True) as guarded:
            led = LiveTurntable(
                open_set(words_of(bench), keep_going=True),
                tmp_path,
                sources=bench.addresses,
                poses=poses,
                pose_seconds=3.0,
                turns=False,
                driver=TableDrive(OneAxis(guarded), plan),
            )
            asked, ticked = [], []
            for step in led.steps():
                if step.kind == "pose wanted":
                    asked.append(step.subject)
                    if step.subject in turned:
                        guarded.goto(turned[step.subject])
                elif step.kind == "pose done":
                    ticked.append(step.subject)
    assert led.is_complete
    assert asked[0].startswith("stop 1 of 1")
    assert asked[1:] == [pose.name for pose in by_hand]
    assert ticked == ["Z up", *asked[1:]]
