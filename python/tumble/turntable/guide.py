"""What a live session still needs: poses of the list, then turns about each axis, both ways."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from tumble.recording import FloatArray
from tumble.turntable.matching import LARGEST_TIP
from tumble.turntable.poses import Pose, PoseList, angle_between

SHORTEST_TURN = math.radians(80.0)
"""rad about an axis that count as a turn: a quarter, less what hands miss."""
REST_AFTER_TURN = 2.0
"""s at rest after which a turn is over: a turn is measured from rest to rest."""


@dataclass(slots=True)
class WantedPose:
    """A pose, and for how long the table has rested there."""

    pose: Pose
    wanted: float
    """s."""
    done: float = 0.0
    """s of rests that have ended."""
    now: float = 0.0
    """s of the rest under way."""
    told: bool = False
    """Whether it was said to be done."""

    @property
    def name(self) -> str:
        """As the list has it."""
        return self.pose.name

    @property
    def seconds(self) -> float:
        """Rest so far, s."""
        return self.done + self.now

    @property
    def is_done(self) -> bool:
        """Whether that is as long as wanted."""
        return self.seconds >= self.wanted


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
        """Whether there were as many as wanted."""
        return self.done >= self.wanted


@dataclass(slots=True)
class Guide:
    """Ticks poses and turns, in any order, as the reference shows them.

    Tell it of rest and motion with `rest` and `motion`, and of every angle turned with `turn`.
    """

    poses: list[WantedPose]
    turns: list[WantedTurn]
    at: WantedPose | None = None
    """Where the table rests now; None while it moves, or rests at no pose of the list."""
    tip: float = math.nan
    """deg between the rest under way and the nearest pose."""
    nearest: str = ""
    _turned: FloatArray = field(default_factory=lambda: np.zeros(3))
    _turn_taken: bool = True

    @classmethod
    def of(cls, poses: PoseList, seconds: float, *, turns: bool) -> Guide:
        """Want each pose for so many s and, with `turns`, one turn about each axis either way."""
        each = [WantedTurn(axis, sign) for axis in range(3) for sign in (1, -1)] if turns else []
        return cls([WantedPose(pose, seconds) for pose in poses], each)

    @property
    def wanted(self) -> WantedPose | WantedTurn | None:
        """What to do next: the first pose that is not done, then the first turn; None when all is done."""
        if self.at is not None and not self.at.is_done:
            return self.at
        everything: list[WantedPose | WantedTurn] = [*self.poses, *self.turns]
        return next((each for each in everything if not each.is_done), None)

    def begin_anew(self) -> None:
        """Forget what was shown, not what is wanted."""
        for pose in self.poses:
            pose.done = pose.now = 0.0
            pose.told = False
        for turn in self.turns:
            turn.done = 0
        self.motion()
        self._turned, self._turn_taken = np.zeros(3), True

    def turn(self, angle: FloatArray) -> None:
        """Take in what the reference turned, (3,) rad about its axes."""
        self._turned = self._turned + angle

    def motion(self) -> None:
        """Take in that the table moves."""
        self._turn_taken = False
        if self.at is not None:
            self.at.done += self.at.now
            self.at.now = 0.0
        self.at, self.tip = None, math.nan

    def rest(self, force: FloatArray, seconds: float) -> Iterator[WantedPose | WantedTurn]:
        """Take in a rest with this specific force, (3,) m/s^2, that is so long by now; give what it ticks."""
        if not self._turn_taken and seconds >= REST_AFTER_TURN:
            self._turn_taken = True
            yield from self._ticked_turns()
        angles = [angle_between(force, each.pose.up) for each in self.poses]
        best = int(np.argmin(angles))
        self.tip, self.nearest = angles[best], self.poses[best].name
        self.at = self.poses[best] if self.tip <= LARGEST_TIP else None
        if self.at is None:
            return
        self.at.now = seconds
        if self.at.is_done and not self.at.told:
            self.at.told = True
            yield self.at

    def want_longer(self, factor: float) -> None:
        """Want the time at each pose to be so many times what it was."""
        for each in self.poses:
            each.wanted = factor * max(each.seconds, each.wanted)
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
