"""A table that goes through poses and turns by itself."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal, TypeAlias, TypeGuard

import numpy as np

from tumble.foundation.errors import TableError
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import join
from tumble.poses.pose_list import Pose, PoseList, angle_between
from tumble.tools.table.axes import Axis, ups
from tumble.tools.table.guarded import GuardedTable, HaltedTableError
from tumble.tools.table.plan import PosePlan, reachable
from tumble.tools.table.rate_runs import RateRun, Sweep

MOST_PASSES = 10
"""Times that the table goes everywhere for the sake of a goal."""
RESTLESS = 60.0
"""s beyond the rest that is wanted by which the units have to have rested where the table has settled."""
SAME_ANGLE = 0.01
"""deg between a pose of a list and where the table can go."""


@dataclass(frozen=True, slots=True)
class Position:
    """A stop at angles, for a rest or only to set out from."""

    angles: FloatArray
    """(axes,) rad."""
    rests: bool = True
    """Indicates whether the units rest there."""


Stop: TypeAlias = Position | RateRun
TableMotion: TypeAlias = Literal["none", "to angles", "to a rate", "to rest"]


class TableDrive:
    """Goes to the poses of a plan and rests there for its times; then makes the runs."""

    def __init__(self, table: GuardedTable, plan: PosePlan, runs: Sequence[RateRun] = ()) -> None:
        self._table = table
        self._plan = plan
        self._all_runs = tuple(runs)
        self._rest = plan.rest
        self._passes = 1
        self._stops = self._stops_of(plan.route)
        self._stop = -1
        self._motion: TableMotion = "none"
        self._is_at_rate = False
        self._whole_turns = np.zeros(len(table.axes))
        """rad that runs left on axes without limits."""
        self._there_since = math.nan
        """s of the samples' clock at which the table had settled."""
        self._left_at = -math.inf
        """s of that clock at which it began to move there; -inf where it was there already."""

    @property
    def is_done(self) -> bool:
        """See `Driver`."""
        return max(self._stop, 0) >= len(self._stops)

    @property
    def aim(self) -> str:
        """See `Driver`."""
        if not 0 <= self._stop < len(self._stops):
            return ""
        return f"stop {self._stop + 1} of {len(self._stops)}: {self._name(self._stops[self._stop])}"

    @property
    def aimed_up(self) -> FloatArray | None:
        """Direction (3,) in the frame of the table that points up where it is or goes; None during a run."""
        stop = self._stops[self._stop] if 0 <= self._stop < len(self._stops) else None
        return ups(self._table.axes, stop.angles[np.newaxis])[0] if isinstance(stop, Position) else None

    def halt(self) -> None:
        """See `Driver`."""
        self._table.halt()

    def advance(self, now: float, rest: float | None) -> None:
        """See `Driver`."""
        with suppress(HaltedTableError):
            self._advance(now, rest)

    def _advance(self, now: float, rest: float | None) -> None:
        if self.is_done:
            return
        if self._motion != "none":
            self._look(now)
        elif self._stop < 0 and not self._table.settled():
            # A session that was stopped goes on while the table may still come to rest.
            return
        elif self._stop < 0 or self._has_done(self._stops[self._stop], now, rest):
            self._leave(now)
        elif (
            isinstance(self._stops[self._stop], Position) and now - self._there_since > RESTLESS + self._rest
        ):
            raise TableError(
                f"{self._table.name}: is at {self.aim}, but the units are not at rest; what shakes them? "
                "See to that, and go on with --resume"
            )

    def again(self, seconds: float) -> bool:
        """See `Driver`."""
        if self._passes >= MOST_PASSES:
            return False
        self._passes += 1
        self._all_runs = self._all_runs if seconds > 0.0 else ()
        self._stops, self._stop = self._stops_of(self._plan.route), -1
        self._rest = max(seconds, self._rest)
        return True

    def leave_out(self, ups: Sequence[FloatArray], turned: FloatArray) -> None:
        """See `Driver`."""
        shown = [any(angle_between(up, other) <= SAME_ANGLE for other in ups) for up in self._plan.ups]
        self._stops = self._stops_of(self._plan.left(shown, turned))

    def shows(self, up: FloatArray) -> bool:
        """See `Driver`."""
        # The ends of turns are rests too, and what lies between others may have been left out as made.
        return any(angle_between(up, other) <= SAME_ANGLE for other in ups(self._plan.axes, self._plan.route))

    def _stops_of(self, route: FloatArray) -> list[Stop]:
        return [*map(Position, route), *stops_of_runs(self._all_runs)]

    def _has_done(self, stop: Stop, now: float, rest: float | None) -> bool:
        if isinstance(stop, Position):
            return not stop.rests or self._has_rested(now, rest)
        return isinstance(stop, Sweep) or now - self._there_since >= stop.seconds

    def _has_rested(self, now: float, rest: float | None) -> bool:
        """Returns whether units rest here for long enough; samples may come later than the table obeys."""
        if rest is None or now - rest < self._left_at:
            return False
        return min(rest, now - self._there_since) >= self._rest

    def _look(self, now: float) -> None:
        if not self._table.settled():
            return
        if self._motion == "to rest":
            self._count_whole_turns()
            self._go(now)
        else:
            self._is_at_rate = self._motion == "to a rate"
            self._motion, self._there_since = "none", now

    def _leave(self, now: float) -> None:
        """Leaves a stop for the next one; an axis at a rate goes over to its next rate, or to rest first."""
        self._stop += 1
        next_stop = None if self.is_done else self._stops[self._stop]
        if self._is_at_rate and not _holds_a_rate(next_stop):
            self._table.rate(np.zeros(len(self._table.axes)))
            self._motion, self._is_at_rate, self._left_at = "to rest", False, now
        else:
            self._go(now)

    def _go(self, now: float) -> None:
        """Begins the motion to the stop that is due."""
        self._motion = "none"
        if self.is_done:
            return
        stop, axes = self._stops[self._stop], self._table.axes
        fastest = np.array([axis.limits.rate for axis in axes])
        took = math.inf
        self._motion = "to angles"
        if isinstance(stop, Position):
            took = self._table.goto(stop.angles + self._whole_turns)
        elif isinstance(stop, Sweep):
            self._table.goto(stop.end + self._whole_turns, _only(stop.axis, abs(stop.rate), fastest))
        else:
            self._table.rate(_only(stop.axis, stop.rate, np.zeros(len(axes))))
            self._motion = "to a rate"
        self._left_at = now if took > 0.0 else -math.inf

    def _count_whole_turns(self) -> None:
        """Keeps the whole turns that a run made, so that no later motion takes them back."""
        last = self._stops[self._stop - 1]
        if isinstance(last, RateRun):
            turned = self._table.position() - last.start
            self._whole_turns = _only(
                last.axis, math.tau * np.round(turned[last.axis] / math.tau), self._whole_turns
            )

    def _name(self, stop: Stop) -> str:
        axes = self._table.axes
        if isinstance(stop, Position):
            return stop_name(axes, stop.angles)
        return f"{axes[stop.axis].name} at {math.degrees(stop.rate):.6g} deg/s"


def stops_of_runs(runs: Sequence[RateRun]) -> list[Stop]:
    """Returns runs at constant rate, where each sets out from, and a rest before and after those of one axis.

    Runs of an axis without limits follow each other without a rest; a sweep sets out from one end of its
    range.
    """
    stops: list[Stop] = []
    for run in runs:
        last = stops[-1] if stops else None
        if not (_holds_a_rate(run) and _holds_a_rate(last) and np.array_equal(last.start, run.start)):
            stops.append(Position(run.start, rests=_holds_a_rate(run)))
        stops.append(run)
    return [*stops, Position(runs[0].start, rests=_holds_a_rate(runs[0]))] if runs else []


def _holds_a_rate(stop: Stop | None) -> TypeGuard[RateRun]:
    return isinstance(stop, RateRun) and not isinstance(stop, Sweep)


def _only(axis: int, value: float, others: FloatArray) -> FloatArray:
    """Returns (axes,) numbers: `value` at one axis, those of `others` elsewhere."""
    return np.where(np.arange(len(others)) == axis, value, others)


def stop_name(axes: tuple[Axis, ...], angles: FloatArray) -> str:
    """Names a stop of the table: `outer 90, inner 0 deg`."""
    degrees = np.degrees(angles).tolist()
    each = (f"{axis.name} {angle:.0f}" for axis, angle in zip(axes, degrees, strict=True))
    return f"{', '.join(each)} deg"


def angles_at(axes: tuple[Axis, ...], poses: PoseList) -> tuple[FloatArray, tuple[Pose, ...]]:
    """Returns angles (n, axes), rad, at which a table shows poses, and the poses where it does not come.

    Raises `TableError` where it comes to none.
    """
    grid = reachable(axes)
    directions = ups(axes, grid)
    found, left = [], []
    for pose in poses:
        nearest = int(np.argmax(directions @ pose.up))
        if angle_between(directions[nearest], pose.up) <= SAME_ANGLE:
            found.append(grid[nearest])
        else:
            left.append(pose)
    if not found:
        raise TableError(
            f"poses {join([pose.name for pose in left])}: the table comes to none of them in steps of 15 deg "
            "within its limits; give others, or turn the table by hand"
        )
    return np.array(found), tuple(left)
