"""Motion of a table in a live session: its plan for people, and the drive that carries it out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.foundation.words import join
from tumble.poses.pose_list import SAME_DIRECTION, Pose, PoseList, angle_between
from tumble.procedures.turntable.table_drive import Position, TableDrive, angles_at, stop_name, stops_of_runs
from tumble.tools.table.axes import Axis, ups
from tumble.tools.table.bounds import parse_limits
from tumble.tools.table.guarded import GuardedTable
from tumble.tools.table.plan import PosePlan, in_shortest_order, plan_poses, with_turns
from tumble.tools.table.rate_runs import RateRun, lines_of_runs, plan_rates, seconds_of_runs
from tumble.tools.table.rate_table import RateTable
from tumble.tools.table.registry import open_table

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
    runs: tuple[RateRun, ...] = ()
    """Runs at constant rate, after the poses."""
    by_hand: tuple[Pose, ...] = ()
    """Poses where the table does not come: the units are turned over by hand, after all else."""

    def lines(self) -> Iterator[str]:
        """Describes what the driver remarks, each stop, and how long all of it takes."""
        for remark in self.table.remarks:
            yield f"{self.name}: {remark}"
        route = self.plan.route
        for number, angles in enumerate(route, start=1):
            yield f"stop {number} of {len(route)}: {stop_name(self.plan.axes, angles)}"
        yield (
            f"{len(route)} rests of {self.plan.rest:g} s and {self.plan.motion_seconds:.0f} s of motion: "
            f"{self.plan.seconds / 60.0:.1f} min"
        )
        if self.runs:
            yield from lines_of_runs(self.plan.axes, self.runs)
            seconds = seconds_of_runs(self.plan.axes, self.runs)
            yield f"{len(self.runs)} turns at constant rate: {seconds / 60.0:.1f} min besides"
        if self.by_hand:
            yield f"by hand, after all of that: {join([pose.name for pose in self.by_hand])}"

    @contextmanager
    def entered(self) -> Iterator[TableDrive]:
        """Opens the table, armed; it is stopped on every way out."""
        limits = parse_limits(self.limits, self.table.axes)
        with GuardedTable(self.table, limits, armed=True) as table:
            yield TableDrive(table, self.plan, self.runs)


def turned_table(
    address: str,
    limits: str,
    seconds: float,
    poses: PoseList | None,
    turns: bool,
    documents: Mapping[str, str] | None = None,
) -> TurnedTable:
    """Plan for a table: the poses that show most for their time or, where a list was given, that list.

    Raises `TableError` where no driver has that name, or the table does not reach the poses or rates.
    """
    table = open_table(address, documents)
    axes = GuardedTable(table, parse_limits(limits, table.axes)).axes
    plan, stops, by_hand = planned(axes, seconds, poses, turns)
    runs = plan_rates(axes, poses.rates, poses.rate_seconds) if poses else ()
    rests = [stop.angles for stop in stops_of_runs(runs) if isinstance(stop, Position) and stop.rests]
    return TurnedTable(address, table, limits, plan, _with_rests(stops, axes, rests), runs, by_hand)


def planned(
    axes: tuple[Axis, ...], seconds: float, poses: PoseList | None, turns: bool
) -> tuple[PosePlan, PoseList, tuple[Pose, ...]]:
    """Plan for axes, all poses that are wanted, and those by hand; arguments as of `turned_table`."""
    rest = seconds + AFTER_STOP
    by_hand: tuple[Pose, ...] = ()
    if poses is None:
        plan = plan_poses(axes, rest, gyroscope=turns)
    else:
        start = np.zeros(len(axes))
        angles, by_hand = angles_at(axes, poses)
        plan = PosePlan(axes, in_shortest_order(axes, angles, start), start, rest)
        # Poses that are held by hand leave unknown how much turns of the table gain.
        plan = with_turns(plan) if turns and not by_hand else plan
    return plan, _with_rests(poses or plan.poses(), axes, plan.route), by_hand


def _with_rests(
    poses: PoseList, axes: tuple[Axis, ...], rests: Sequence[FloatArray] | FloatArray
) -> PoseList:
    """Adds where else the units rest: a few degrees beside a pose it would count as that pose, badly set."""
    added = list(poses)
    for angles in rests:
        (up,) = ups(axes, angles[np.newaxis])
        if all(angle_between(up, pose.up) >= SAME_DIRECTION for pose in added):
            added.append(Pose(stop_name(axes, angles), up))
    return poses if len(added) == len(poses) else replace(poses, poses=tuple(added))
