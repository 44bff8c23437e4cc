"""Remaining steps of a live session: poses of the list, then turns about each axis, both ways."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from tumble.foundation.recording import FloatArray
from tumble.poses.pose_list import Pose, PoseList, angle_between
from tumble.procedures.turntable.matching import LARGEST_TIP

SHORTEST_TURN = math.radians(80.0)
"""rad about an axis that count as a turn: a quarter, minus the error of hands."""
REST_AFTER_TURN = 2.0
"""s at rest after which a turn is over: a turn is measured from rest to rest."""


@dataclass(slots=True)
class RestTime:
    """Time for which one unit has shown a pose."""

    done: float = 0.0
    """s of rests that have ended."""
    now: float = 0.0
    """s of the rest under way."""

    @property
    def seconds(self) -> float:
        """Rests so far, s."""
        return self.done + self.now

    def end(self) -> None:
        """Ends the rest under way."""
        self.done, self.now = self.seconds, 0.0


@dataclass(slots=True)
class WantedPose:
    """A pose, for how long the table has rested there, and for how long each target has shown it."""

    pose: Pose
    wanted: float
    """s, of each unit."""
    table: RestTime = field(default_factory=RestTime)
    targets: dict[str, RestTime] = field(default_factory=dict)
    told: bool = False
    """Indicates whether its completion was reported."""

    @property
    def name(self) -> str:
        """Name in the list."""
        return self.pose.name

    @property
    def seconds(self) -> float:
        """Rests so far that all units have shown, s."""
        return min(each.seconds for each in self._each)

    @property
    def is_rested(self) -> bool:
        """Returns whether the table has rested there for as long as wanted, whichever targets showed it."""
        return self.table.seconds >= self.wanted

    @property
    def is_done(self) -> bool:
        """Returns whether each unit has shown it for as long as wanted."""
        return self.seconds >= self.wanted

    @property
    def lacking(self) -> tuple[str, ...]:
        """Names of the targets that have not shown it for as long as wanted."""
        return tuple(name for name, each in self.targets.items() if each.seconds < self.wanted)

    def is_wanted(self, away: Collection[str]) -> bool:
        """Returns whether the table is to rest there while these targets are away."""
        return not (self.is_rested and set(self.lacking) <= set(away))

    def forget(self) -> None:
        """Forgets what was shown."""
        for each in self._each:
            each.done = each.now = 0.0
        self.told = False

    def leave(self) -> None:
        """Ends the rest under way."""
        for each in self._each:
            each.end()

    @property
    def _each(self) -> tuple[RestTime, ...]:
        return (self.table, *self.targets.values())


@dataclass(slots=True)
class WantedTurn:
    """A turn about one axis of the reference, one way."""

    axis: int
    sign: int
    wanted: int = 1
    done: int = 0

    @property
    def name(self) -> str:
        """`+x`: counter-clockwise about x, seen from its tip."""
        return f"{'+' if self.sign > 0 else '-'}{'xyz'[self.axis]}"

    @property
    def is_done(self) -> bool:
        """Returns whether as many turns as wanted were made."""
        return self.done >= self.wanted


@dataclass(slots=True)
class Guide:
    """Ticks poses and turns, in any order, as the reference shows them and each target has seen them.

    `rest` and `motion` take in rest and motion, `turn` every angle turned; `away` names the targets that give
    no samples now.
    """

    poses: list[WantedPose]
    turns: list[WantedTurn]
    at: WantedPose | None = None
    """Pose at which the table rests now; None while it moves, or rests at no pose of the list."""
    tip: float = math.nan
    """deg between the rest under way and the nearest pose."""
    nearest: str = ""
    away: frozenset[str] = frozenset()
    _turned: FloatArray = field(default_factory=lambda: np.zeros(3))
    _turn_taken: bool = True

    @classmethod
    def of(cls, poses: PoseList, seconds: float, *, turns: bool, targets: Collection[str] = ()) -> Guide:
        """Want so many s at each pose of each target and, with `turns`, a turn about each axis both ways."""
        each = [WantedTurn(axis, sign) for axis in range(3) for sign in (1, -1)] if turns else []
        wanted = [WantedPose(pose, seconds, targets={name: RestTime() for name in targets}) for pose in poses]
        return cls(wanted, each)

    @property
    def wanted(self) -> WantedPose | WantedTurn | None:
        """Next step: poses, then turns, then poses that a target missed; None when no step remains.

        A step that only absent targets lack waits for their return.
        """
        if self.at is not None and self.at.is_wanted(self.away):
            return self.at
        everything: list[WantedPose | WantedTurn] = [
            *(pose for pose in self.poses if not pose.is_rested),
            *(turn for turn in self.turns if not turn.is_done),
            *(pose for pose in self.poses if pose.is_wanted(self.away)),
        ]
        return next(iter(everything), None)

    @property
    def is_done(self) -> bool:
        """Returns whether all poses and turns are done, by each unit."""
        return all(pose.is_done for pose in self.poses) and all(turn.is_done for turn in self.turns)

    @property
    def missed(self) -> dict[str, list[str]]:
        """Poses at which the table has rested and that a target has not shown, by the target."""
        shown = [(pose.name, pose.lacking) for pose in self.poses if pose.is_rested]
        names = dict.fromkeys(name for _, lacking in shown for name in lacking)
        return {name: [pose for pose, lacking in shown if name in lacking] for name in names}

    def begin_anew(self) -> None:
        """Forgets what was shown, not what is wanted."""
        for pose in self.poses:
            pose.forget()
        for turn in self.turns:
            turn.done = 0
        self.motion()
        self._turned, self._turn_taken = np.zeros(3), True

    def turn(self, angle: FloatArray) -> None:
        """Adds a turn of the reference, (3,) rad about its axes."""
        self._turned = self._turned + angle

    def motion(self) -> None:
        """Reports to the guide that the table moves."""
        self._turn_taken = False
        if self.at is not None:
            self.at.leave()
        self.at, self.tip = None, math.nan

    def rest(
        self, force: FloatArray, seconds: float, targets: Mapping[str, float] | None = None
    ) -> Iterator[WantedPose | WantedTurn]:
        """Adds the present rest of this specific force, (3,) m/s^2, and duration; returns what it completes.

        `targets` are s of samples that each target has given of it.
        """
        if not self._turn_taken and seconds >= REST_AFTER_TURN:
            self._turn_taken = True
            yield from self._ticked_turns()
        angles = [angle_between(force, each.pose.up) for each in self.poses]
        best = int(np.argmin(angles))
        self.tip, self.nearest = angles[best], self.poses[best].name
        self.at = self.poses[best] if self.tip <= LARGEST_TIP else None
        if self.at is None:
            return
        self.at.table.now = seconds
        for name, each in (targets or {}).items():
            self.at.targets[name].now = each
        if self.at.is_done and not self.at.told:
            self.at.told = True
            yield self.at

    def want_longer(self, factor: float) -> None:
        """Want the time at each pose to be so many times what it was."""
        for each in self.poses:
            each.wanted = factor * max(each.table.seconds, each.wanted)
            each.told = False

    def want_more_turns(self, factor: float) -> None:
        """Want so many times the turns there were."""
        for each in self.turns:
            each.wanted = math.ceil(factor * max(each.done, each.wanted))

    def _ticked_turns(self) -> Iterator[WantedTurn]:
        turned, self._turned = self._turned, np.zeros(3)
        for each in self.turns:
            if each.sign * turned[each.axis] >= SHORTEST_TURN:
                each.done += 1
                if each.done == each.wanted:
                    yield each
