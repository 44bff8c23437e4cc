"""The noise procedure while it records: deviations of what stood still so far, and how long it lasts yet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from tumble.acquisition.acquire import acquire
from tumble.foundation import clock
from tumble.foundation.goal import GoalProgress
from tumble.foundation.recording import Chunk
from tumble.foundation.units import TRIADS
from tumble.foundation.words import LISTENING, Listening, length_of_time
from tumble.live import LiveChunk, LiveSet
from tumble.logs import open_recording
from tumble.logs.session import SessionProcedure, recorded_so_far
from tumble.procedures.noise.procedure import channels_of
from tumble.procedures.noise.result import ChannelNoise
from tumble.procedures.noise.samples import StillSamples
from tumble.tools.record.live_procedure import LiveProcedure
from tumble.tools.record.objections import BROKEN, Objection, broken
from tumble.tools.record.procedure import SHORTEST_REST, RecordStep, UnitProgress

NoiseStepKind: TypeAlias = Literal[Listening, "found", "progress", "warning", "done", "ended early"]
FoundNoise: TypeAlias = Mapping[str, tuple[ChannelNoise, ...]]
"""Channels of each unit, by its name."""

BETWEEN_LOOKS = 1.0
"""s between two estimates, unless the samples have doubled."""
FEWEST_SECONDS = 2.0
"""s at rest from which deviations are estimated."""
DISTURBED = "disturbed"
"""Key of what is reported of a unit that moves."""


@dataclass(frozen=True, slots=True)
class NoiseSoFar:
    """Estimates so far."""

    channels: FoundNoise
    goals: tuple[GoalProgress, ...] = ()


@dataclass(frozen=True, slots=True)
class NoiseStep:
    """Latest event, and the progress of the session."""

    kind: NoiseStepKind
    elapsed: float
    """s since it began."""
    units: tuple[UnitProgress, ...]
    still: Mapping[str, float]
    """s at rest of each unit, by its name."""
    wanted: float | None
    """s at rest that are wanted; None until the user ends it."""
    channels: FoundNoise
    """Newest estimates; none of a unit before the first."""
    subject: str = ""
    """Name of the unit that it is about."""
    text: str = ""
    """Text of a warning or of an early end: cause and remedy."""


class LiveNoise(LiveProcedure[NoiseStep, NoiseSoFar]):
    """One still log of several units: exhaust `steps`, then find the noise of what is in `session`.

    `units` is read and recorded into `folder`/session, until each was at rest for `wanted` s, or until
    `stop`. Memory does not grow with that time. With `resume` the session that is there goes on.

    Raises what `Recorder` raises.
    """

    def __init__(
        self,
        units: LiveSet,
        folder: Path,
        *,
        sources: Mapping[str, str],
        serials: Mapping[str, str] | None = None,
        wanted: float | None = None,
        procedure: SessionProcedure | None = None,
        resume: bool = False,
    ) -> None:
        super().__init__(
            units,
            folder,
            sources=sources,
            serials=serials,
            goal=None,
            procedure=procedure or SessionProcedure(name="noise"),
            so_far=NoiseSoFar({}),
            resume=resume,
        )
        self._wanted = wanted
        self._samples = {name: _UnitSamples() for name in sources}
        self._looked_at, self._looked_when = 0.0, -math.inf
        """s at rest, and s of the clock, of the newest estimate."""
        if resume:
            self._go_on()

    @property
    def is_reached(self) -> bool:
        """Returns whether all units were at rest as long as wanted, or the user ended it where he decides."""
        return self._is_complete

    @property
    def received(self) -> tuple[str, ...]:
        """Names of the units that gave samples."""
        return tuple(name for name, unit in self._samples.items() if unit.is_received)

    def steps(self) -> Iterator[NoiseStep]:
        """Records and estimates until all is shown, or until `stop`; gives what happens as it happens.

        It ends early where all sources have ended, and where all have been silent for half a minute.

        Raises `LogError` where a source cannot be opened, `OutputError` where the disk is full.
        """
        yield from self._guided()

    def _steps_of(self, step: RecordStep) -> Iterator[NoiseStep]:
        if step.kind == LISTENING:
            yield self._step(LISTENING, step)
        elif step.kind in BROKEN:
            yield self._step("warning", step, step.unit, broken(step))
        elif step.kind == "done":
            yield from self._ended(step)
        else:
            yield from self._watched(step)
            yield from self._warnings(step, self._silent.objections(step))
            if reason := self._silent.reason:
                self._why_early = reason
                self._recorder.stop()
            yield self._step("progress", step)

    def _watched(self, step: RecordStep) -> Iterator[NoiseStep]:
        for unit in step.units:
            moved = self._samples[unit.name].look(at_rest=unit.condition == "rest")
            yield from self._warnings(step, _disturbed(unit, moved))
        yield from self._found(step)
        if self._wanted is not None and self._still_of_all >= self._wanted and not self._is_complete:
            self._is_complete = True
            self._recorder.stop()

    def _found(self, step: RecordStep) -> Iterator[NoiseStep]:
        """Keeps finished estimates, and starts the next ones when due."""
        if self._finding.is_running:
            return
        if (found := self._finding.take()) is not None:
            self._so_far = found
            yield self._step("found", step)
        if self._is_due:
            self._look()

    @property
    def _is_due(self) -> bool:
        has_doubled = self._still_of_all >= 2.0 * max(self._looked_at, 0.5 * FEWEST_SECONDS)
        waited = clock.now() - self._looked_when >= BETWEEN_LOOKS and self._finding.is_due
        return self._still_of_all >= FEWEST_SECONDS and (has_doubled or waited)

    def _look(self) -> None:
        self._looked_at, self._looked_when = self._still_of_all, clock.now()
        records = {name: unit.still.so_far() for name, unit in self._samples.items()}
        self._finding.begin(
            lambda: NoiseSoFar({name: channels_of(TRIADS, record()) for name, record in records.items()})
        )

    def _ended(self, step: RecordStep) -> Iterator[NoiseStep]:
        for unit in step.units:
            self._samples[unit.name].look(at_rest=unit.condition == "rest")
        self._is_complete = self._is_complete or (
            self._still_of_all >= self._wanted if self._wanted is not None else self._was_stopped
        )
        if self._still_of_all >= FEWEST_SECONDS:
            self._finding.wait()
            self._finding.take()
            self._look()
            self._finding.wait()
            self._so_far = self._finding.take() or self._so_far
        self._describe_what_was_reached({"at rest": self._still_of_all})
        if self._is_complete:
            yield self._step("done", step)
        else:
            yield self._step("ended early", step, text=self._early())

    def _early(self) -> str:
        why = "stopped" if self._was_stopped else self._why_early
        wanted = "" if self._wanted is None else f" of {length_of_time(self._wanted)}"
        return f"{why}; at rest for {length_of_time(self._still_of_all)}{wanted}; go on with the same session"

    @property
    def _still_of_all(self) -> float:
        """Time at rest, s, of the unit that has least."""
        return min(unit.still.seconds for unit in self._samples.values())

    def _warning(self, step: RecordStep, about: str, text: str) -> NoiseStep:
        return self._step("warning", step, about, text)

    def _step(self, kind: NoiseStepKind, step: RecordStep, subject: str = "", text: str = "") -> NoiseStep:
        return NoiseStep(
            kind,
            step.elapsed,
            step.units,
            {name: unit.still.seconds for name, unit in self._samples.items()},
            self._wanted,
            self._so_far.channels,
            subject,
            text,
        )

    def _take(self, name: str, chunk: LiveChunk) -> None:
        self._samples[name].take(chunk)

    def _go_on(self) -> None:
        """Adds what was recorded before."""
        for name, unit in self._samples.items():
            if recorded_so_far(self.session, name).samples:
                recording = open_recording(f"{self.session}:{name}")
                rests = np.array(acquire(recording).acquired.rest_times)
                unit.still.read(recording, rests)
                unit.still.begin_part()
                unit.is_received = True


class _UnitSamples:
    """Samples of one unit: those at rest are counted, the newest wait until it is known whether they are."""

    def __init__(self) -> None:
        self.still = StillSamples(TRIADS)
        self.is_received = False
        self._waiting: list[LiveChunk] = []
        self._rest, self._was_at_rest = 0, False
        self._disturbances = 0

    def take(self, chunk: LiveChunk) -> None:
        self.is_received = True
        self._waiting.append(chunk)

    def look(self, *, at_rest: bool) -> int:
        """Adds what waits to the present rest, or leaves it out; returns how often a rest ended by motion."""
        if at_rest and not self._was_at_rest:
            self._rest += 1
        elif self._was_at_rest and not at_rest:
            self._disturbances += 1
        self._was_at_rest = at_rest
        for chunk in self._due(at_rest):
            self.still.take(chunk, np.full(len(chunk), self._rest if at_rest else -1))
        return self._disturbances

    def _due(self, at_rest: bool) -> Iterator[Chunk]:
        """Removes and returns chunks; in motion, not those that a rest may begin with."""
        if not self._waiting:
            return
        until = math.inf if at_rest else float(self._waiting[-1].time[-1]) - SHORTEST_REST
        while self._waiting and self._waiting[0].time[-1] <= until:
            yield self._waiting.pop(0)


def _disturbed(unit: UnitProgress, times: int) -> Iterator[Objection]:
    if unit.condition == "motion" and times:
        text = "moves; let it lie untouched, away from motors and draughts: that part is left out"
        yield Objection(unit.name, f"{DISTURBED} {times}", text)
