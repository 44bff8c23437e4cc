"""A table that goes through poses and turns by itself."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tumble.errors import TableError
from tumble.recording import FloatArray
from tumble.table.axes import Axis, ups
from tumble.table.guarded import GuardedTable
from tumble.table.plan import PosePlan, reachable
from tumble.turntable.poses import PoseList, angle_between

MOST_PASSES = 10
"""Times that the table goes everywhere for the sake of a goal."""
RESTLESS = 60.0
"""s beyond the rest that is wanted by which the units have to have rested where the table has settled."""
SAME_ANGLE = 0.01
"""deg between a pose of a list and where the table can go."""


class TableDrive:
    """Goes where a plan says, and rests there for as long as that has it."""

    def __init__(self, table: GuardedTable, plan: PosePlan) -> None:
        self._table = table
        self._plan = plan
        self._route = plan.route
        self._rest = plan.rest
        self._stop = -1
        self._passes = 1
        self._is_moving = False
        self._there_since = math.nan
        """s of the samples' clock at which the table had settled."""
        self._left_at = -math.inf
        """s of that clock at which it began to move there; -inf where it was there already."""

    @property
    def is_done(self) -> bool:
        """See `Driver`."""
        return max(self._stop, 0) >= len(self._route)

    @property
    def aim(self) -> str:
        """See `Driver`."""
        if not 0 <= self._stop < len(self._route):
            return ""
        stop = stop_name(self._table.axes, self._route[self._stop])
        return f"stop {self._stop + 1} of {len(self._route)}: {stop}"

    def advance(self, now: float, rest: float | None) -> None:
        """See `Driver`."""
        if self.is_done:
            return
        if self._is_moving:
            self._look(now)
        elif self._stop < 0 or self._has_rested(now, rest):
            self._go_on(now)
        elif now - self._there_since > RESTLESS + self._rest:
            raise TableError(
                f"{self._table.name}: is at {self.aim}, but the units are not at rest; what shakes them? "
                "See to that, and go on with --resume"
            )

    def again(self, seconds: float) -> bool:
        """See `Driver`."""
        if self._passes >= MOST_PASSES:
            return False
        self._passes += 1
        self._route, self._stop, self._rest = self._plan.route, -1, max(seconds, self._rest)
        return True

    def leave_out(self, ups: Sequence[FloatArray], turned: FloatArray) -> None:
        """See `Driver`."""
        shown = [any(angle_between(up, other) <= SAME_ANGLE for other in ups) for up in self._plan.ups]
        self._route = self._plan.left(shown, turned)

    def _has_rested(self, now: float, rest: float | None) -> bool:
        """Whether units rest here for long enough: here, as samples may come later than the table obeys."""
        if rest is None or now - rest < self._left_at:
            return False
        return min(rest, now - self._there_since) >= self._rest

    def _look(self, now: float) -> None:
        if self._table.settled():
            self._is_moving, self._there_since = False, now

    def _go_on(self, now: float) -> None:
        self._stop += 1
        if not self.is_done:
            took = self._table.goto(self._route[self._stop])
            self._is_moving = True
            self._left_at = now if took > 0.0 else -math.inf


def stop_name(axes: tuple[Axis, ...], angles: FloatArray) -> str:
    """Say where a table stands: `outer 90, inner 0 deg`."""
    degrees = np.degrees(angles).tolist()
    each = (f"{axis.name} {angle:.0f}" for axis, angle in zip(axes, degrees, strict=True))
    return f"{', '.join(each)} deg"


def angles_at(axes: tuple[Axis, ...], poses: PoseList) -> FloatArray:
    """Give angles (n, axes), rad, at which a table shows each pose; raises `TableError` where it cannot."""
    grid = reachable(axes)
    directions = ups(axes, grid)
    found = []
    for pose in poses:
        nearest = int(np.argmax(directions @ pose.up))
        if angle_between(directions[nearest], pose.up) > SAME_ANGLE:
            raise TableError(
                f"pose {pose.name!r}: the table does not come there in steps of 15 deg within its limits; "
                "take it off the list, or turn the table by hand"
            )
        found.append(grid[nearest])
    return np.array(found)
