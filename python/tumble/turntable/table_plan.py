"""What a table is to do in a live session: its plan for people, and the drive that carries it out."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from tumble.table.axes import Axis, ups
from tumble.table.bounds import parse_limits
from tumble.table.guarded import GuardedTable
from tumble.table.plan import PosePlan, in_shortest_order, plan_poses, with_turns
from tumble.table.rate_table import RateTable
from tumble.table.registry import open_table
from tumble.turntable.poses import SAME_DIRECTION, Pose, PoseList, angle_between
from tumble.turntable.table_drive import TableDrive, angles_at, stop_name

AFTER_STOP = 1.0
"""s beyond the rest that is wanted, until units are seen to rest."""


@dataclass(frozen=True, slots=True)
class TurnedTable:
    """A table, and where it is to go."""

    name: str
    table: RateTable
    limits: str
    plan: PosePlan
    poses: PoseList

    def lines(self) -> Iterator[str]:
        """Say what the driver remarks, each stop, and how long all of it takes."""
        for remark in self.table.remarks:
            yield f"{self.name}: {remark}"
        route = self.plan.route
        for number, angles in enumerate(route, start=1):
            yield f"stop {number} of {len(route)}: {stop_name(self.plan.axes, angles)}"
        yield (
            f"{len(route)} rests of {self.plan.rest:g} s and {self.plan.motion_seconds:.0f} s of motion: "
            f"{self.plan.seconds / 60.0:.1f} min"
        )

    @contextmanager
    def entered(self) -> Iterator[TableDrive]:
        """Open the table, armed; it is stopped on every way out."""
        limits = parse_limits(self.limits, self.table.axes)
        with GuardedTable(self.table, limits, armed=True) as table:
            yield TableDrive(table, self.plan)


def turned_table(
    address: str, limits: str, seconds: float, poses: PoseList | None, turns: bool
) -> TurnedTable:
    """Plan for a table: the poses that show most for their time or, where a list was given, that list.

    Raises `TableError` where no driver has that name, or the table does not reach the poses.
    """
    table = open_table(address)
    axes = GuardedTable(table, parse_limits(limits, table.axes)).axes
    return TurnedTable(address, table, limits, *planned(axes, seconds, poses, turns))


def planned(
    axes: tuple[Axis, ...], seconds: float, poses: PoseList | None, turns: bool
) -> tuple[PosePlan, PoseList]:
    """Give a plan for axes, and all poses at which it rests; arguments as those of `turned_table`."""
    rest = seconds + AFTER_STOP
    if poses is None:
        plan = plan_poses(axes, rest, gyroscope=turns)
    else:
        start = np.zeros(len(axes))
        plan = PosePlan(axes, in_shortest_order(axes, angles_at(axes, poses), start), start, rest)
        plan = with_turns(plan) if turns else plan
    return plan, _with_ends_of_turns(poses or plan.poses(), plan)


def _with_ends_of_turns(poses: PoseList, plan: PosePlan) -> PoseList:
    """Add where turns end: a few degrees beside a pose they would be taken for that pose, badly set."""
    added = list(poses)
    for angles, up in zip(plan.route, ups(plan.axes, plan.route), strict=True):
        if all(angle_between(up, pose.up) >= SAME_DIRECTION for pose in added):
            added.append(Pose(stop_name(plan.axes, angles), up))
    return poses if len(added) == len(poses) else PoseList(tuple(added), poses.source)
