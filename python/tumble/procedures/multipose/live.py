"""The multi-pose procedure while it happens: where to turn the unit, and how far the calibration is."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from pydantic import JsonValue

from tumble import _core
from tumble.acquisition.acquire import acquire
from tumble.foundation.errors import ProcedureError, TumbleError
from tumble.foundation.goal import Goal, GoalProgress
from tumble.foundation.recording import FloatArray, Recording
from tumble.foundation.words import LISTENING, Listening
from tumble.live import LiveChunk, LiveSet
from tumble.logs import open_recording
from tumble.logs.magnetic_rows import MagneticRows
from tumble.logs.session import SessionProcedure, recorded_so_far
from tumble.poses.by_hand import orientation_words, why_not_so_many
from tumble.poses.pose_list import angle_between
from tumble.procedures.magnetometer.messages import LITTLE_COVERED
from tumble.procedures.multipose.guide import HELD, OrientationGuide
from tumble.procedures.multipose.held import HeldRests, during, rests_by_hand
from tumble.procedures.multipose.live_field import (
    FIELD_NOW,
    FieldShown,
    LiveField,
    field_objections,
    field_shown,
    fields_met,
    is_covered,
)
from tumble.procedures.multipose.procedure import FEW_TO_CHECK, TooLittleShownError, multipose
from tumble.procedures.multipose.result import MultiposeResult
from tumble.tools.record.live_procedure import LiveProcedure
from tumble.tools.record.objections import BROKEN, Objection, broken, faults
from tumble.tools.record.presence import seconds_shown
from tumble.tools.record.procedure import SHORTEST_REST, RecordStep, UnitCondition

MultiposeStepKind: TypeAlias = Literal[
    Listening, "orientation wanted", "rest done", "progress", "warning", "done", "ended early"
]
Calibrate: TypeAlias = Callable[[Recording], MultiposeResult]
"""Runs the procedure on what there is, as `multipose` does."""

ORIENTATIONS = 18
"""Number of orientations that is enough where no goal is stated."""
MOST_RESTS = 120
"""Number of rests after which a goal is out of reach, because of bias instability."""
BEFORE_REST = 2.0
"""s of samples before a rest by which its beginning is seen."""
NOW = 0.2
"""s of the newest samples from which the orientation of the unit is reported."""


@dataclass(frozen=True, slots=True)
class MultiposeSoFar:
    """Estimates of the procedure so far."""

    result: MultiposeResult | None = None
    lacking: str = ""
    """Reason why there is no result yet."""
    goals: tuple[GoalProgress, ...] = ()
    objections: tuple[Objection, ...] = ()


@dataclass(frozen=True, slots=True)
class MultiposeStep:
    """Latest event, and the progress of the session."""

    kind: MultiposeStepKind
    elapsed: float
    """s since it began."""
    name: str
    """Name of the unit."""
    condition: UnitCondition
    rate: float
    """Hz; NaN before it is known."""
    up: FloatArray | None
    """(3,) unit vector, case frame: what is to point up next; None for however the unit lies."""
    off: float
    """deg between that and what points up now; NaN where either is not known."""
    still: float
    """s of the rest under way."""
    still_wanted: float
    orientations: int
    """That differ, so far."""
    orientations_wanted: int | None
    """Number of orientations; None where a goal decides."""
    turns: int
    """Turns from one rest to the next, so far."""
    goals: tuple[GoalProgress, ...]
    subject: str = ""
    """The orientation, or the unit, that it is about."""
    text: str = ""
    """Text of a warning or of an early end: cause and remedy."""
    field: FieldShown | None = None
    """The magnetic field; None where no magnetometer is calibrated."""


class LiveMultipose(LiveProcedure[MultiposeStep, MultiposeSoFar]):
    """One session by hand: exhaust `steps`, then calibrate what was recorded into `session`.

    `units` is read and recorded into `folder`/session; `sources` is what was typed for its one unit. It asks
    for `held` s of rest in one orientation after another: in as many `orientations`, or until the `goal` is
    met, or for `duration` s. `calibrate` finds the figures so far; with `magnetometer` it calibrates that of
    the unit too, and the field has to be met from all around. With `resume` the session that is there
    goes on.

    Raises `ProcedureError` where the goal cannot be shown, and what `Recorder` raises.
    """

    def __init__(
        self,
        units: LiveSet,
        folder: Path,
        *,
        sources: Mapping[str, str],
        serial: str = "",
        goal: Goal | None = None,
        orientations: int | None = None,
        held: float = HELD,
        duration: float | None = None,
        calibrate: Calibrate = multipose,
        magnetometer: bool = False,
        procedure: SessionProcedure | None = None,
        resume: bool = False,
    ) -> None:
        _refuse_what_no_hand_shows(goal, orientations)
        (self.name,) = sources
        super().__init__(
            units,
            folder,
            sources=sources,
            serials={self.name: serial},
            goal=goal,
            procedure=procedure or SessionProcedure(name="multipose"),
            so_far=MultiposeSoFar(),
            resume=resume,
            by_hand=True,
        )
        self.guide = OrientationGuide(held)
        self._wanted = ORIENTATIONS if goal is None and orientations is None else orientations
        self._duration = duration
        self._calibrate = calibrate
        self._field = LiveField() if magnetometer else None
        self._time = -math.inf
        self._trembled = False
        """Indicates whether the present rest trembled at any check."""
        self._held = HeldRests()
        self._asked: FloatArray | None = None
        self._asked_field: FloatArray | None = None
        self._asks_again = False
        """Indicates whether to repeat the request for an orientation."""
        self._rests_found = 0
        """Number of rests from which the running fit computes."""
        self._rests_followed = 0
        """Number of rests from which the next orientation follows."""
        self._by_will = False
        """Indicates whether it ended when the user asked for it."""
        if resume:
            self._go_on()

    @property
    def up(self) -> FloatArray | None:
        """Returns (3,) unit vector, case frame: what points up now; None before the first sample."""
        return _unit(self._newest_force()) if self.is_heard else None

    @property
    def held(self) -> tuple[FloatArray, ...]:
        """Returns (3,) unit vector, case frame, for each rest that was long enough: what pointed up."""
        return tuple(_unit(force) for force in self.guide.forces)

    @property
    def fields(self) -> tuple[FloatArray, ...]:
        """Returns (3,) unit vector, case frame, for each rest: where the magnetic field pointed."""
        result = self._so_far.result
        return fields_met(result.magnetometer if result else None)

    @property
    def is_heard(self) -> bool:
        """Returns whether the unit gave samples."""
        return bool(self._acquired.recordings())

    @property
    def is_reached(self) -> bool:
        """Returns whether the goal was reached, or without one, all orientations or the end by the user."""
        ends_by_goal = self._goal is not None and not self._unmet_field()
        return self.goal_is_met and (self._is_complete or ends_by_goal or self._by_will)

    def steps(self) -> Iterator[MultiposeStep]:
        """Guide, record and watch until all is shown, or until `stop`; give what happens as it happens.

        It ends early where the source has ended, and where the unit has been silent for half a minute.

        Raises `LogError` where the source cannot be opened, `OutputError` where the disk is full, and
        `ProcedureError` where a magnetometer is to be calibrated that gave no reading by the first rest.
        """
        yield from self._guided(self._duration)

    def _steps_of(self, step: RecordStep) -> Iterator[MultiposeStep]:
        if step.kind == LISTENING:
            yield self._step(LISTENING, step)
        elif step.kind in BROKEN:
            yield self._step("warning", step, step.unit, broken(step))
            # The rest under way is lost with the unit.
            self._asks_again = True
        elif step.kind == "done":
            yield from self._ended(step)
        else:
            yield from self._watched(step)
            yield from self._warnings(step, self._silent.objections(step))
            if reason := self._silent.reason:
                self._why_early = reason
                self._recorder.stop()
            yield self._step("progress", step)

    def _watched(self, step: RecordStep) -> Iterator[MultiposeStep]:
        [unit] = step.units
        yield from self._warnings(step, self._frozen.objections({unit.name: unit.condition == "motion"}))
        if self._field is not None:
            yield from self._warnings(step, self._field.objections(self.name, self._time))
        if unit.condition == "rest" and not self._frozen.is_frozen(unit.name):
            yield from self._rested(step)
        else:
            self._rest.end()
            self._trembled = False
            self.guide.motion()
        yield from self._found(step)
        self._end_where_all_is_shown()
        yield from self._wants(step)

    def _rested(self, step: RecordStep) -> Iterator[MultiposeStep]:
        """Adds the present rest; one that trembled counts only if it is a rest beside the others."""
        [unit] = step.units
        if self._rest.look(self._acquired.newest(self.name, SHORTEST_REST), self._time):
            self._trembled = False
            self.guide.motion()
        self._trembled = self._trembled or unit.trembles
        if self._trembled and self._rest.since is not None and self.guide.is_enough(self._still):
            newest = self._acquired.since(self.name, self._rest.since - BEFORE_REST)
            self._rest.since = max(self._rest.since, self._held.since(newest))
        if self.guide.rest(self._rest.force, self._still):
            if self._field is not None:
                self._field.refuse_without(self.name)
            seconds = self.guide.wanted_seconds + SHORTEST_REST
            self._held.keep(self._acquired.newest(self.name, seconds))
            self._finding.hurry()
            yield self._step("rest done", step, orientation_words(_unit(self._rest.force)))

    def _found(self, step: RecordStep) -> Iterator[MultiposeStep]:
        """Stores finished estimates, and starts the next ones when due."""
        if self._finding.is_running:
            return
        if (found := self._finding.take()) is not None:
            self._so_far = found
            if self._rests_found > self._rests_followed:
                self._rests_followed = self._rests_found
                self.guide.follow(found.result)
            yield from self._warnings(step, found.objections)
        if self._finding.is_due and self.is_heard and (self._field is None or self._field.is_heard):
            self._rests_found = self.guide.rests
            recording = self._acquired.recordings()[self.name]
            self._finding.begin(partial(_evaluate, recording, self._calibrate, self._goal))

    def _end_where_all_is_shown(self) -> None:
        result = self._so_far.result
        if self._is_complete or result is None or self._rests_followed < self.guide.rests:
            return
        if self._all_is_shown(result):
            self._is_complete = True
        elif self.guide.rests >= max(MOST_RESTS, 2 * (self._wanted or 0)):
            self._why_early = f"{self.guide.rests} rests did not bring it there"
        else:
            return
        self._recorder.stop()

    def _all_is_shown(self, result: MultiposeResult) -> bool:
        wanted = self._wanted or 0
        if self._goal is not None:
            enough = result.directions >= 9 + FEW_TO_CHECK
            is_met = self._field is None or is_covered(result)
            return enough and is_met and self.goal_is_met and result.directions >= wanted
        # Where gyroscope or magnetometer were not shown yet, as many orientations again may.
        is_whole = result.gyroscope is not None and (self._field is None or is_covered(result))
        patience = 1 if is_whole else 2
        return result.directions >= patience * wanted

    def _wants(self, step: RecordStep) -> Iterator[MultiposeStep]:
        """Reports the next orientation once, as soon as it is known."""
        up = self.guide.wanted
        was_asked = up is self._asked and not self._asks_again
        is_away = step.units[0].condition not in ("rest", "motion")
        if up is None or was_asked or is_away or self._is_complete:
            return
        if self._rests_followed < self.guide.rests:
            return
        self._asked, self._asks_again = up, False
        self._asked_field = self.guide.wanted_field
        yield self._step("orientation wanted", step, orientation_words(up))

    def _ended(self, step: RecordStep) -> Iterator[MultiposeStep]:
        """Finds out how far it is by all that was recorded."""
        self._by_will = self._was_stopped or step.reason == "duration"
        if self.is_heard and not self._is_complete:
            self._finding.wait()
            self._finding.take()
            self._finding.begin(
                partial(_evaluate, self._acquired.recordings()[self.name], self._calibrate, self._goal)
            )
            self._finding.wait()
            self._so_far = self._finding.take() or self._so_far
            yield from self._warnings(step, self._so_far.objections)
            self._is_complete = self._so_far.result is not None and self._all_is_shown(self._so_far.result)
        self._describe_what_was_reached()
        if self._is_complete or (self._by_will and self._goal is None):
            yield self._step("done", step)
        else:
            yield self._step("ended early", step, text=self._early())

    def _early(self) -> str:
        by_will = "stopped" if self._was_stopped else "time is up"
        missing = self._so_far.lacking or self._unmet_field() or self._unmet_goal()
        return f"{by_will if self._by_will else self._why_early}; {missing}; go on with --resume"

    def _unmet_goal(self) -> str:
        """Describes the first term of the goal that is not met, else the orientations so far."""
        for each in self._goals:
            if each.ratio > 1.0:
                reached = f"{each.term.name} has a sigma of {each.sigma:.3g} {each.unit}"
                return f"{reached}, and {each.term.sigma:g} were asked for"
        return f"{self._orientations} of {self._wanted} orientations" if self._wanted else ""

    def _unmet_field(self) -> str:
        """Describes what the field lacks; empty where it lacks nothing, or nobody asked for it."""
        result = self._so_far.result
        if self._field is None or result is None or is_covered(result):
            return ""
        if result.magnetometer is None:
            return f"the magnetometer is not calibrated: {result.magnetometer_reason}"
        share = f"{100.0 * result.magnetometer.coverage:.0f} % of all directions"
        return f"the magnetic field was met from {share}, and {100.0 * LITTLE_COVERED:.0f} % are needed"

    @property
    def _orientations(self) -> int:
        result = self._so_far.result
        return max(self.guide.orientations, result.directions if result else 0)

    def _warning(self, step: RecordStep, about: str, text: str) -> MultiposeStep:
        return self._step("warning", step, about, text)

    def _step(
        self, kind: MultiposeStepKind, step: RecordStep, subject: str = "", text: str = ""
    ) -> MultiposeStep:
        [unit] = step.units
        result = self._so_far.result
        return MultiposeStep(
            kind,
            step.elapsed,
            self.name,
            unit.condition,
            unit.rate,
            self._asked,
            self._off(),
            self._still,
            self.guide.wanted_seconds,
            self._orientations,
            self._wanted,
            len(result.turns) if result else max(0, self.guide.rests - 1),
            self._goals,
            subject,
            text,
            self._field_shown(),
        )

    def _field_shown(self) -> FieldShown | None:
        if self._field is None:
            return None
        result = self._so_far.result
        newest = self._acquired.magnetic(self.name, self._time - FIELD_NOW)
        return field_shown(result.magnetometer if result else None, newest, self._asked_field)

    @property
    def _still(self) -> float:
        """Length of the rest under way, s, of which samples came."""
        if self._rest.since is None:
            return 0.0
        span = (self._rest.since, self._time)
        return seconds_shown(self._acquired.since(self.name, span[0]).time, span)

    def _off(self) -> float:
        if self._asked is None or not self.is_heard:
            return math.nan
        return angle_between(self._newest_force(), self._asked)

    def _newest_force(self) -> FloatArray:
        force: FloatArray = self._acquired.newest(self.name, NOW).accelerometer.mean(axis=0)
        return force

    def _take(self, name: str, chunk: LiveChunk) -> None:
        self._time = float(chunk.time[-1])
        self._acquired.push(name, chunk)
        self._frozen.push(name, chunk)
        if self._field is not None:
            self._field.push(chunk)

    def _go_on(self) -> None:
        """Adds what was recorded before, and counts its rests."""
        if not recorded_so_far(self.session, self.name).samples:
            return
        segmenter = _core.Segmenter(SHORTEST_REST, by_hand=True)
        before = open_recording(f"{self.session}:{self.name}")
        track = before.magnetic
        rows = None if track is None else MagneticRows(track)
        for chunk in before.chunks():
            self._acquired.push(self.name, chunk if rows is None else rows.beside(chunk))
            segmenter.push(chunk.time, chunk.accelerometer, chunk.gyroscope)
        samples = self._acquired.since(self.name, -math.inf)
        for start, end in rests_by_hand(samples, segmenter.finish().rest_times):
            rest = during(samples, (start, end))
            self.guide.motion()
            if self.guide.rest(rest.accelerometer.mean(axis=0), end - start):
                self._held.keep(during(rest, (end - self.guide.wanted_seconds - SHORTEST_REST, end)))
        self.guide.motion()


def session_procedure(goal: str | None, operator: str, station: str, *, resume: bool) -> SessionProcedure:
    """Returns the purpose of a session as its recording keeps it; `goal` as the user typed it."""
    options: dict[str, JsonValue] = {"goal": goal} if goal else {}
    if resume:
        options["resumed"] = True
    return SessionProcedure(name="multipose", operator=operator, station=station, options=options)


def calibrated(session: LiveMultipose, options: Mapping[str, Any]) -> MultiposeResult:
    """Calibrates what a session recorded, as from its folder; `options` are those of `multipose`.

    Raises `ProcedureError`, in one line, where nothing can be calibrated; what was recorded stays.
    """
    if not session.is_heard:
        raise ProcedureError(
            f"there is nothing to calibrate, as no sample came of {session.name}; check power, cables and "
            "the address, and go on with --resume"
        )
    try:
        return multipose(str(session.session), **options)
    except TumbleError as error:
        raise ProcedureError(
            f"{error.why}; what was recorded is in {session.session}: go on with the same command and "
            "--resume",
            about=session.name,
        ) from error


def _refuse_what_no_hand_shows(goal: Goal | None, orientations: int | None) -> None:
    if orientations is not None and (why := why_not_so_many(orientations)):
        raise ProcedureError(why)
    for term in goal.terms if goal else ():
        if (term.triad, term.group) == ("accelerometer", "mounting"):
            raise ProcedureError(
                f"--until {goal.text if goal else ''}: nothing shows how the accelerometer is mounted; leave "
                "it out"
            )


def _evaluate(recording: Recording, calibrate: Calibrate, goal: Goal | None) -> MultiposeSoFar:
    """Runs the procedure on what there is; what is amiss with the unit is no want of poses."""
    name = recording.name
    try:
        objections = list(faults(name, acquire(recording)))
        result = calibrate(recording)
    except TooLittleShownError as error:
        return MultiposeSoFar(None, error.why, (), tuple(objections))
    except TumbleError as error:
        return MultiposeSoFar(None, error.why, (), (_objection(name, error),))
    objections += field_objections(result)
    return MultiposeSoFar(result, "", goal.progress([result]) if goal else (), tuple(objections))


def _objection(name: str, error: TumbleError) -> Objection:
    # Figures of one trouble change from look to look.
    return Objection(name, re.sub(r"[-\d.]+", "", error.why), error.why)


def _unit(vector: FloatArray) -> FloatArray:
    found: FloatArray = vector / np.linalg.norm(vector)
    return found
