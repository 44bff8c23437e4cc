"""The turntable procedure while it happens: what to do next, what is found so far, who is loose or silent."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal, Protocol, TypeAlias

import numpy as np

from tumble.acquisition.acquire import acquire, rests_of
from tumble.foundation.errors import ProcedureError, TumbleError
from tumble.foundation.goal import Goal, GoalProgress
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import LISTENING, Listening, join
from tumble.live import LiveChunk, LiveSet
from tumble.logs import open_recording
from tumble.logs.session import Session, SessionProcedure, recorded_so_far
from tumble.poses.pose_list import SIX_FACES, PoseList
from tumble.procedures.turntable.guide import Guide, WantedPose, WantedTurn
from tumble.procedures.turntable.procedure import open_session
from tumble.procedures.turntable.session_poses import keep_poses
from tumble.procedures.turntable.so_far import OpenSession, SoFar, evaluate
from tumble.tools.record.live_procedure import LiveProcedure
from tumble.tools.record.objections import BROKEN, Objection, broken
from tumble.tools.record.presence import frozen_while_others_moved, seconds_shown
from tumble.tools.record.procedure import SHORTEST_REST, RecordStep, UnitCondition, UnitProgress
from tumble.tools.record.silence import Absence

TurntableStepKind: TypeAlias = Literal[
    Listening,
    "pose wanted",
    "pose done",
    "turn wanted",
    "turn done",
    "progress",
    "warning",
    "done",
    "ended early",
]
POSE_SECONDS = 10.0
"""s at each pose if nothing is stated."""
REFERENCE = "reference"
"""Name of the unit that is the reference if none is named."""
TIPPED_AFTER = 4.0
"""s at rest off all poses, after which that is reported."""
NOW = 0.2
"""s of the newest samples from which the attitude of the reference is reported."""
LONGEST_GAP = 0.1
"""s between two samples over which the gyroscope's last word holds."""
MARGIN, LARGEST_STEP = 1.1, 4.0
"""Margin on the rest that sigma asks for, and the largest factor of one extension."""
LONGEST_POSE = 1800.0
"""s at each pose that a goal may take; bias instability lets none go below what it lets go."""
MOST_TURNS = 100


@dataclass(frozen=True, slots=True)
class UnitAtPose:
    """Progress of one target at one pose."""

    name: str
    """Name of the target."""
    seconds: float
    """Duration of rests of which it gave samples."""
    done: bool


@dataclass(frozen=True, slots=True)
class PoseProgress:
    """Progress of one pose."""

    name: str
    seconds: float
    """Duration of rests of which all units gave samples."""
    wanted: float
    """s."""
    done: bool
    """Indicates whether each unit has shown it."""
    units: tuple[UnitAtPose, ...] = ()
    """Each target."""


@dataclass(frozen=True, slots=True)
class TurnProgress:
    """Progress of turns about one axis of the reference, one way."""

    name: str
    """`+x` ... `-z`."""
    count: int
    wanted: int
    done: bool


@dataclass(frozen=True, slots=True)
class UnitState:
    """Present state of one unit."""

    name: str
    condition: UnitCondition
    rate: float
    """Hz; NaN before it is known."""


@dataclass(frozen=True, slots=True)
class TurntableStep:
    """Latest event, and the progress of the session."""

    kind: TurntableStepKind
    elapsed: float
    """s since it began."""
    poses: tuple[PoseProgress, ...]
    turns: tuple[TurnProgress, ...]
    units: tuple[UnitState, ...]
    goals: tuple[GoalProgress, ...]
    at: str
    """Pose at which the table rests; empty where it rests at none, or moves."""
    subject: str = ""
    """The pose, the turn or the unit that it is about."""
    text: str = ""
    """Text of a warning or of an early end: cause and remedy; of a repeated request for a pose: its
    reason."""
    table: str = ""
    """Place where an automatic table is or goes; empty before it goes anywhere, and without one."""


class Driver(Protocol):
    """Takes the table through poses and turns, in place of a hand."""

    @property
    def is_done(self) -> bool:
        """Indicates whether the table has been at every pose."""

    @property
    def aim(self) -> str:
        """Name of the place where the table is or goes."""

    def advance(self, now: float, rest: float | None) -> None:
        """Advances without waiting; `now` and the duration of the present rest are s of the samples.

        Raises `TableError` where the table does not obey.
        """

    def halt(self) -> None:
        """Stops the table for good, from any thread; raises `TableError` where that is not answered."""

    def shows(self, up: FloatArray) -> bool:
        """Returns whether the table goes where this direction, (3,) in its frame, points up."""

    def again(self, seconds: float) -> bool:
        """Repeats all stops, for so many s of rest; returns False where that was done often enough."""

    def leave_out(self, ups: Sequence[FloatArray], turned: FloatArray) -> None:
        """Removes stops that were recorded: rests with these directions up, and turns.

        `ups` are (3,) in the frame of the table, `turned` (n, 3) rad by which the reference turned between
        one rest and the next.
        """


class LiveTurntable(LiveProcedure[TurntableStep, SoFar]):
    """One session on a table: exhaust `steps`, then calibrate what was recorded into `session`.

    `units` are read and recorded into `folder`/session; `sources` is what was typed for each of them. The
    unit of the name `reference` shows how the table stands, which is asked for `pose_seconds` of rest at each
    of `poses` and, with `turns`, for a turn about each axis, both ways. Each pose is asked for again until
    every target has given samples of as much rest there. With a `goal` it then asks for as much more as that
    takes. `open_reference` fits the reference for the figures so far. A `driver` turns the
    table. With `resume` the session that is there goes on.

    Raises `ProcedureError` where there is no such reference or nothing beside it, and what `Recorder` raises.
    """

    def __init__(
        self,
        units: LiveSet,
        folder: Path,
        *,
        sources: Mapping[str, str],
        serials: Mapping[str, str] | None = None,
        reference: str = REFERENCE,
        poses: PoseList = SIX_FACES,
        pose_seconds: float = POSE_SECONDS,
        turns: bool = True,
        goal: Goal | None = None,
        open_reference: OpenSession | None = None,
        driver: Driver | None = None,
        procedure: SessionProcedure | None = None,
        resume: bool = False,
    ) -> None:
        if reference not in sources:
            raise ProcedureError(
                f"no unit {reference!r}; name one so, or say --reference NAME, one of {', '.join(sources)}"
            )
        if len(sources) == 1:
            raise ProcedureError("no target was given; name at least one unit besides the reference")
        super().__init__(
            units,
            folder,
            sources=sources,
            serials=serials,
            goal=goal,
            procedure=procedure or SessionProcedure(name="turntable"),
            so_far=SoFar(),
            resume=resume,
        )
        self._targets = tuple(name for name in sources if name != reference)
        self.guide = Guide.of(poses, pose_seconds, turns=turns, targets=self._targets)
        self._reference = reference
        self._poses = poses
        self._open_reference = open_reference or partial(open_session, poses=None)
        self._driver = driver
        self._time = -math.inf
        self._on_pose = -math.inf
        """s at which the table last rested at a pose; a rest is seen to end a little late."""
        self._asked = ""
        self._finding_is_final = False
        self._found_last = False
        """Indicates whether the last estimate includes all that was asked for."""
        self._missing = Absence(lambda: units.listened)
        """Absence of targets that alone lack something."""
        self._redone: dict[str, float] = {}
        """s of the samples before which rests at a pose no longer count, by its name."""
        if resume:
            self._go_on()

    @property
    def poses(self) -> PoseList:
        """The poses that are wanted."""
        return self._poses

    @property
    def is_for_hand(self) -> bool:
        """Returns whether hands turn the table: there is no driver, or it cannot show what is left."""
        return self._driver is None

    def up(self) -> FloatArray | None:
        """Returns about which direction (3,) of the reference points up; None before its first samples."""
        if not math.isfinite(self._time):
            return None
        force: FloatArray = self._acquired.newest(self._reference, NOW).accelerometer.mean(axis=0)
        length = float(np.linalg.norm(force))
        return force / length if length > 0.0 else None

    def redo(self, pose: str) -> None:
        """Asks for a pose once more in full; between two steps, and while no table turns the units.

        The samples from there stay in the recording, and count in the calibration.
        """
        for each in self.guide.poses:
            if each.name == pose:
                self._redone[pose] = self._time
                each.forget()
                self._asked = ""

    @property
    def was_stopped(self) -> bool:
        """Returns whether `stop` ended it."""
        return self._was_stopped and not self._is_complete

    @property
    def heard(self) -> frozenset[str]:
        """Names of the units that gave samples."""
        return frozenset(self._acquired.recordings())

    @property
    def not_shown(self) -> tuple[str, ...]:
        """Names of the poses at which the table never rested."""
        return tuple(each.name for each in self.guide.poses if each.table.seconds == 0.0)

    @property
    def missed(self) -> str:
        """Poses that targets have missed, by the target; empty where none has."""
        return "; ".join(f"{name} missed {join(poses)}" for name, poses in self.guide.missed.items())

    @property
    def is_complete(self) -> bool:
        """Returns whether all that was asked for was done."""
        return self._is_complete

    def steps(self) -> Iterator[TurntableStep]:
        """Guide, record and watch until all is done, or until `stop`; give what happens as it happens.

        It ends early where all sources have ended, and where no unit has sent anything for `GONE_AFTER`.

        Raises `LogError` where a source cannot be opened, `OutputError` where the disk is full, `TableError`
        where the table does not obey.
        """
        keep_poses(self.session, self._poses)
        yield from self._guided()

    def _halt(self) -> None:
        if self._driver is not None:
            self._driver.halt()

    def _steps_of(self, step: RecordStep) -> Iterator[TurntableStep]:
        if step.kind == LISTENING:
            yield self._step(LISTENING, step)
        elif step.kind in BROKEN:
            yield from self._broken(step)
        elif step.kind == "done":
            yield from self._ended(step)
        else:
            yield from self._watched(step)
            yield from self._silence(step)
            yield self._step("progress", step)

    def _ended(self, step: RecordStep) -> Iterator[TurntableStep]:
        if not (self._is_complete or self._was_stopped):
            # Samples that came last, and a log that came all at once, are still unchecked.
            self._tick_what_was_recorded()
            yield from self._found_at_last(step)
            self._is_complete = self._all_is_done and self.goal_is_met
            self._note_what_was_reached()
        elif self._was_stopped:
            self._note_what_was_reached()
        if self._is_complete:
            yield self._step("done", step)
        elif not self._was_stopped:
            yield self._step("ended early", step, text=f"{self._why_early}; {self._what_is_missing()}")

    def _silence(self, step: RecordStep) -> Iterator[TurntableStep]:
        """Reports at once that all units are silent, and ends the session where that lasts."""
        yield from self._warnings(step, list(self._silent.objections(step)))
        if reason := self._silent.reason:
            self._end_early(reason)

    def _end_early(self, why: str) -> None:
        self._why_early = why
        self._recorder.stop()

    def _what_is_missing(self) -> str:
        guide = self.guide
        turns = [f"turns about {each.name}" for each in guide.turns if not each.is_done]
        missing = [*(each.name for each in guide.poses if not each.is_rested), *turns]
        shown = f"not shown long enough: {join(missing)}" if missing else ""
        if said := [text for text in (shown, self.missed) if text]:
            return f"{'; '.join(said)}; go on with --resume"
        if not self.goal_is_met:
            return "the goal was not reached; go on with --resume"
        return "go on with --resume"

    def _broken(self, step: RecordStep) -> Iterator[TurntableStep]:
        yield self._step("warning", step, step.unit, broken(step))

    def _watched(self, step: RecordStep) -> Iterator[TurntableStep]:
        moving = {unit.name: unit.condition == "motion" for unit in step.units}
        frozen = list(self._frozen.objections(moving))
        if any((each.unit, each.key) not in self._told for each in frozen):
            # A frozen stretch is no rest, so the rests so far are counted without it.
            self._tick_what_was_recorded()
        yield from self._warnings(step, frozen)
        self.guide.away = frozenset(unit.name for unit in step.units if self._is_away(unit))
        at = self.guide.at
        rest = self._note_rest(step)
        if at is not None and self.guide.at is None:
            yield from self._warnings(step, list(self._missed_at(at)))
        if rest is not None:
            force, seconds = rest
            for each in self.guide.rest(force, seconds, self._shown_by_targets()):
                self._finding.hurry()
                kind: TurntableStepKind = "pose done" if isinstance(each, WantedPose) else "turn done"
                yield self._step(kind, step, each.name)
            if self.guide.at is not None:
                self._on_pose = self._time
            elif self._time - max(self._on_pose, self._time - seconds) > TIPPED_AFTER:
                yield from self._warnings(step, [self._tipped()])
        yield from self._found(step)
        if self._all_is_done:
            yield from self._end_or_go_on(step)
        if self._driver is not None and math.isfinite(self._time):
            self._driver.advance(self._time, rest[1] if rest else None)
            missed = self._driver.is_done and self.guide.wanted is not None
            if missed and self._is_for_hand(self._driver, self.guide.wanted):
                # From here on hands are at the table.
                self._driver = None
            elif missed and not self._send_again(self._driver):
                self._end_early("the table was everywhere again and again")
        yield from self._wants(step)
        self._wait_for_targets()

    def _is_away(self, unit: UnitProgress) -> bool:
        """Returns whether no samples come from a target that could show a pose."""
        is_there = unit.condition in ("rest", "motion") and not self._frozen.is_frozen(unit.name)
        return unit.name != self._reference and not is_there

    def _shown_by_targets(self) -> dict[str, float]:
        """Returns s of the rest under way that each target has shown."""
        since = self._time if self._rest.since is None else self._rest.since
        return {
            name: 0.0
            if name in self.guide.away
            else seconds_shown(self._acquired.since(name, since).time, (since, self._time))
            for name in self._targets
        }

    def _missed_at(self, pose: WantedPose) -> Iterator[Objection]:
        """Names the targets that did not show a pose which the table leaves."""
        for name in pose.lacking if pose.is_rested else ():
            text = (
                f"missed {pose.name}: {pose.targets[name].seconds:.1f} of {pose.wanted:.1f} s came of it; "
                "the pose is asked for again"
            )
            yield Objection(name, f"missed {pose.name} {pose.table.done}", text)

    def _wait_for_targets(self) -> None:
        """Ends where all is done but what targets lack that stay away."""
        if self._driver is not None and not self._driver.is_done:
            waits = False
        else:
            waits = self.guide.wanted is None and not self.guide.is_done
        if not waits:
            self._missing.end()
        elif self._missing.lasts:
            away = join([name for name in self.guide.missed if name in self.guide.away])
            self._end_early(f"{away} did not return")

    def _is_for_hand(self, driver: Driver, wanted: WantedPose | WantedTurn | None) -> bool:
        """Returns whether the table does not show what is wanted next."""
        return isinstance(wanted, WantedTurn) or (wanted is not None and not driver.shows(wanted.pose.up))

    def _send_again(self, driver: Driver) -> bool:
        """Sends the table to the missing stops; returns whether it may go."""
        may = driver.again(0.0)
        self._leave_out_what_was_shown(driver)
        # The missing stop may be the end of a turn, which is no stop of its own.
        return may and (not driver.is_done or driver.again(0.0))

    def _wants(self, step: RecordStep) -> Iterator[TurntableStep]:
        """Reports the next step once."""
        wanted = self.guide.wanted
        name = self._driver.aim if self._driver is not None else wanted.name if wanted is not None else ""
        if name and name != self._asked:
            self._asked = name
            is_turn = isinstance(wanted, WantedTurn)
            yield self._step("turn wanted" if is_turn else "pose wanted", step, name, self._why_again(wanted))

    def _why_again(self, wanted: WantedPose | WantedTurn | None) -> str:
        """Returns the targets that missed a repeated pose."""
        if self._driver is not None or not isinstance(wanted, WantedPose):
            return ""
        if wanted is self.guide.at or not wanted.is_rested:
            return ""
        lacking = [name for name in wanted.lacking if name not in self.guide.away]
        return f"{join(lacking)} missed it"

    @property
    def _all_is_done(self) -> bool:
        return self.guide.is_done and (self._driver is None or self._driver.is_done)

    def _note_rest(self, step: RecordStep) -> tuple[FloatArray, float] | None:
        """Returns specific force and length, s, of the rest under way; None while anything moves."""
        here = {unit.name: unit.condition for unit in step.units}
        heard = [each for each in here.values() if each in ("rest", "motion")]
        if here[self._reference] != "rest" or "motion" in heard:
            if self._rest.end():
                self.guide.motion()
            return None
        if self._rest.look(self._acquired.newest(self._reference, SHORTEST_REST), self._time):
            self.guide.motion()
        return self._rest.force, self._rest.seconds(self._time)

    def _tipped(self) -> Objection:
        text = (
            f"rests {self.guide.tip:.1f} deg from {self.guide.nearest}, the nearest pose, and counts for "
            "none; level the table, or give the poses with --poses"
        )
        return Objection(self._reference, f"tipped {self._rest.since}", text)

    def _take(self, name: str, chunk: LiveChunk) -> None:
        if name == self._reference:
            if math.isfinite(self._time):
                steps = np.minimum(np.diff(chunk.time, prepend=self._time), LONGEST_GAP)
                self.guide.turn((chunk.gyroscope - self._rest.rate).T @ steps)
            self._time = float(chunk.time[-1])
        self._acquired.push(name, chunk)
        self._frozen.push(name, chunk)

    def _found(self, step: RecordStep) -> Iterator[TurntableStep]:
        """Stores finished estimates, and starts the next ones when due."""
        if self._finding.is_running:
            return
        if (found := self._finding.take()) is not None:
            self._so_far, self._found_last = found, self._finding_is_final
            yield from self._warnings(step, found.objections)
        is_final = self._all_is_done and not self._found_last
        if is_final or self._finding.is_due:
            self._begin_to_find(is_final)

    def _found_at_last(self, step: RecordStep) -> Iterator[TurntableStep]:
        """Finds out how far it is by all that was recorded."""
        self._finding.wait()
        self._finding.take()
        self._begin_to_find(is_final=True)
        self._finding.wait()
        yield from self._found(step)

    def _begin_to_find(self, is_final: bool) -> None:
        recordings = self._acquired.recordings()
        if self._reference not in recordings:
            return
        self._finding_is_final = is_final
        self._finding.begin(
            partial(
                evaluate,
                recordings,
                self._reference,
                self._open_reference,
                self._poses,
                self._goal,
                complete=all(each.table.seconds > 0.0 for each in self.guide.poses),
            )
        )

    def _end_or_go_on(self, step: RecordStep) -> Iterator[TurntableStep]:
        """Ends once all is done; with a goal that is not met, asks for more where more would do."""
        if not self._found_last:
            return
        self._found_last = False
        missed = [each for each in self._goals if each.ratio > 1.0]
        if missed and self._ask_for_more(missed):
            return
        if missed:
            yield from self._warnings(step, [self._out_of_reach(missed[0])])
        self._is_complete = True
        self._note_what_was_reached()
        self._recorder.stop()

    def _ask_for_more(self, missed: list[GoalProgress]) -> bool:
        """Want as much more as the goal takes; whether that is within reason."""
        by_rest = [each.ratio for each in missed if not each.term.needs_turns]
        by_turns = [each.ratio for each in missed if each.term.needs_turns]
        rested = max(each.wanted for each in self.guide.poses)
        turned = max((each.wanted for each in self.guide.turns), default=0)
        if by_rest and rested >= LONGEST_POSE:
            return False
        if by_rest:
            self.guide.want_longer(min(MARGIN * max(by_rest) ** 2, LARGEST_STEP))
        if self._driver is not None:
            return self._driver.again(max(each.wanted - each.seconds for each in self.guide.poses))
        if by_turns and not 0 < turned < MOST_TURNS:
            return False
        if by_turns:
            self.guide.want_more_turns(min(MARGIN * max(by_turns) ** 2, LARGEST_STEP))
        self._asked = ""
        return True

    def _out_of_reach(self, missed: GoalProgress) -> Objection:
        text = (
            f"{missed.term.name} has a sigma of {missed.sigma:.3g} {missed.unit}, and {missed.term.sigma:g} "
            "were asked for; longer rests and more turns do not bring it there"
        )
        return Objection(missed.target, f"out of reach {missed.term.name}", text)

    def _note_what_was_reached(self) -> None:
        """Keeps the sigmas that were reached, and the poses that targets missed."""
        missed = self.guide.missed.items()
        self._describe_what_was_reached({f"poses missed by {name}": join(poses) for name, poses in missed})

    def _warning(self, step: RecordStep, about: str, text: str) -> TurntableStep:
        return self._step("warning", step, about, text)

    def _step(
        self, kind: TurntableStepKind, step: RecordStep, subject: str = "", text: str = ""
    ) -> TurntableStep:
        guide = self.guide
        return TurntableStep(
            kind,
            step.elapsed,
            tuple(_progress(each) for each in guide.poses),
            tuple(TurnProgress(each.name, each.done, each.wanted, each.is_done) for each in guide.turns),
            tuple(UnitState(each.name, each.condition, each.rate) for each in step.units),
            self._so_far.goals,
            guide.at.name if guide.at else "",
            subject,
            text,
            self._driver.aim if self._driver is not None else "",
        )

    def _go_on(self) -> None:
        """Adds what was recorded before, and ticks what its rests and turns show."""
        for name in Session.load(self.session).names:
            if recorded_so_far(self.session, name).samples:
                for chunk in open_recording(f"{self.session}:{name}").chunks():
                    self._acquired.push(name, chunk)
        self._tick_what_was_recorded()
        if self._driver is not None:
            self._leave_out_what_was_shown(self._driver)

    def _tick_what_was_recorded(self) -> None:
        """Ticks poses and turns by all samples there are."""
        recording = self._acquired.recordings().get(self._reference)
        if recording is None:
            return
        try:
            shown = acquire(recording).acquired
        except TumbleError:
            # Too little to be anything; more comes.
            return
        self.guide.begin_anew()
        rests = rests_of(shown)
        spans = [(rest.start, rest.end) for rest in rests]
        samples = {name: self._acquired.since(name, -math.inf) for name in self._targets}
        frozen = {name: list(frozen_while_others_moved(each, spans)) for name, each in samples.items()}
        turned = [np.zeros(3), *shown.turn_angles][: len(rests)]
        for rest, span, angle in zip(rests, spans, turned, strict=True):
            self.guide.motion()
            self.guide.turn(angle)
            targets = {name: seconds_shown(samples[name].time, span, frozen[name]) for name in self._targets}
            deque(self.guide.rest(rest.specific_force, rest.end - rest.start, targets), maxlen=0)
            if self.guide.at is not None and rest.start < self._redone.get(self.guide.at.name, -math.inf):
                self.guide.at.forget()
        self.guide.motion()

    def _leave_out_what_was_shown(self, driver: Driver) -> None:
        """Removes recorded stops from the plan of the table."""
        recording = self._acquired.recordings().get(self._reference)
        try:
            turned = (
                np.array(acquire(recording).acquired.turn_angles)
                if recording is not None
                else np.empty((0, 3))
            )
        except TumbleError:
            turned = np.empty((0, 3))
        driver.leave_out([each.pose.up for each in self.guide.poses if each.is_done], turned)


def _progress(pose: WantedPose) -> PoseProgress:
    units = tuple(
        UnitAtPose(name, each.seconds, each.seconds >= pose.wanted) for name, each in pose.targets.items()
    )
    return PoseProgress(pose.name, pose.seconds, pose.wanted, pose.is_done, units)
