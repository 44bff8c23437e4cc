"""A procedure that records while it guides: the parts that all such sessions have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from pydantic import JsonValue

from tumble.foundation.file_names import SESSION_FOLDER
from tumble.foundation.files import refuse_linked_folder
from tumble.foundation.goal import Goal, GoalProgress
from tumble.foundation.plain import finite_or_none
from tumble.live import LiveChunk, LiveSet
from tumble.logs.session import SessionProcedure
from tumble.tools.record.acquired import Acquisition
from tumble.tools.record.finding import Finding
from tumble.tools.record.frozen import FrozenUnits
from tumble.tools.record.objections import Objection
from tumble.tools.record.procedure import Recorder, RecordStep, halted_by_errors
from tumble.tools.record.rest import RestUnderWay
from tumble.tools.record.silence import Silence

BETWEEN_REPORTS = 0.2
"""s of the samples' clock between two looks at them."""


class HasGoals(Protocol):
    """Estimates so far."""

    @property
    def goals(self) -> tuple[GoalProgress, ...]:
        """Their progress towards what was asked for; empty before the first."""


Found = TypeVar("Found", bound=HasGoals)
Step = TypeVar("Step")


class LiveProcedure(ABC, Generic[Step, Found]):
    """Records units into `folder`/session, computes estimates meanwhile, and warns of each trouble once.

    `sources` is what was typed for each unit; `procedure` is what the session keeps of it. With `resume` the
    session that is there goes on.

    Raises what `Recorder` raises.
    """

    def __init__(
        self,
        units: LiveSet,
        folder: Path,
        *,
        sources: Mapping[str, str],
        serials: Mapping[str, str] | None,
        goal: Goal | None,
        procedure: SessionProcedure,
        so_far: Found,
        resume: bool,
        by_hand: bool = False,
    ) -> None:
        self.session = folder / SESSION_FOLDER
        refuse_linked_folder(self.session)
        self._goal = goal
        self._procedure = procedure
        self._so_far = so_far
        self._acquired = Acquisition()
        self._frozen = FrozenUnits()
        self._recorder = Recorder(
            units,
            self.session,
            typed=sources,
            serials=serials,
            resume=resume,
            on_samples=self._take,
            report_every=BETWEEN_REPORTS / units.clock_rate,
            by_hand=by_hand,
            on_failure=self._halt,
        )
        self._rest = RestUnderWay()
        self._finding: Finding[Found] = Finding()
        self._silent = Silence(lambda: units.listened)
        self._told: set[tuple[str, str]] = set()
        self._is_complete = False
        self._was_stopped = False
        self._why_early = "all sources have ended"

    def stop(self) -> None:
        """Requests `steps` to end soon; may be called by a handler of signals."""
        self._was_stopped = True
        self._recorder.stop()

    @property
    def goal_is_met(self) -> bool:
        """Returns whether there is no goal, or it was met."""
        return all(each.ratio <= 1.0 for each in self._goals)

    @property
    def _goals(self) -> tuple[GoalProgress, ...]:
        return self._so_far.goals or (self._goal.progress(()) if self._goal else ())

    def _guided(self, duration: float | None = None) -> Iterator[Step]:
        """Records until the end, or for `duration` s, and returns what happens meanwhile."""
        self._recorder.describe(self._procedure)
        try:
            with self._recorder, halted_by_errors(self._halt):
                for step in self._recorder.steps(duration):
                    yield from self._steps_of(step)
        finally:
            self._finding.close()

    def _halt(self) -> None:
        """Stops what moves; called at each error before anything is closed."""

    @abstractmethod
    def _steps_of(self, step: RecordStep) -> Iterator[Step]:
        """Steps of the procedure that follow from one of the recording."""

    @abstractmethod
    def _take(self, name: str, chunk: LiveChunk) -> None:
        """Adds samples of a unit."""

    @abstractmethod
    def _warning(self, step: RecordStep, about: str, text: str) -> Step:
        """Step that warns of a unit."""

    def _warnings(self, step: RecordStep, objections: Iterable[Objection]) -> Iterator[Step]:
        """Reports each trouble once."""
        for each in objections:
            if (each.unit, each.key) not in self._told:
                self._told.add((each.unit, each.key))
                yield self._warning(step, each.unit, each.text)

    def _describe_what_was_reached(self, further: Mapping[str, JsonValue] | None = None) -> None:
        """Keeps the sigma reached of each term of the goal, and what else certifies."""
        reached: dict[str, JsonValue] = {
            f"sigma of {each.term.name}": finite_or_none(each.sigma) for each in self._goals
        }
        options = {**self._procedure.options, **reached, **(further or {})}
        self._procedure = self._procedure.model_copy(update={"options": options})
        self._recorder.describe(self._procedure)
