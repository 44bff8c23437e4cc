"""Record several units at once: every sample on the disk within two seconds, readable whatever happens."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Literal, TypeAlias

import numpy as np

from tumble import _core
from tumble.foundation import clock
from tumble.foundation.recording import FloatArray
from tumble.foundation.words import LISTENING, Listening
from tumble.live import FIRST_SAMPLE_WITHIN, LiveChunk, LiveSet, SourceEvent
from tumble.logs.session import Session, SessionProcedure
from tumble.tools.record.writer import EndReason, RecordedUnit, SessionWriter

REPORT_EVERY = 1.0
"""s between two reports of how far it is."""
SILENT_AFTER = 2.0
"""s without a sample after which a unit is called silent."""
REST_WINDOW = 2.5
"""s of the newest samples by which a unit is at rest or in motion."""
SHORTEST_REST = 1.0
"""s of rest at their end that count."""

UnitCondition: TypeAlias = Literal["waiting", "rest", "motion", "silent", "lost"]
RecordStepKind: TypeAlias = Literal[Listening, "progress", "lost", "returned", "silent", "done"]


@dataclass(frozen=True, slots=True)
class UnitProgress:
    """Progress of the recording of one unit."""

    name: str
    samples: int
    rate: float
    """Hz, gaps left out; NaN before it is known."""
    gaps: int
    missing: int
    """Samples that are missing: in gaps, while its source was opened anew, and since the newest one."""
    condition: UnitCondition
    trembles: bool
    """Indicates whether it is at rest except for the tremor of the hand that holds it."""


@dataclass(frozen=True, slots=True)
class RecordStep:
    """Latest event, and the progress of the recording."""

    kind: RecordStepKind
    elapsed: float
    """s since it began; of the logs, where logs are replayed."""
    units: tuple[UnitProgress, ...]
    bytes: int
    """Bytes on disk."""
    unit: str = ""
    """Name of the unit of the event."""
    reason: str = ""
    """Reason why a source was lost, or the recording ended."""
    is_final: bool = False
    """Indicates a loss after which the source is not opened again."""


@dataclass(slots=True)
class UnitWatch:
    """Recent samples of one unit, by which it is at rest or in motion."""

    heard: float = 0.0
    """s of `LiveSet.listened`."""
    is_lost: bool = False
    is_silent: bool = False
    newest: deque[LiveChunk] = field(default_factory=deque)
    """Samples of the last `REST_WINDOW`."""
    by_hand: bool = False

    def hear(self, chunk: LiveChunk, listened: float) -> None:
        """Adds samples, which came at `listened` s of the set."""
        self.heard, self.is_silent = listened, False
        self.newest.append(chunk)
        while len(self.newest) > 1 and chunk.time[-1] - self.newest[0].time[-1] > REST_WINDOW:
            self.newest.popleft()

    @property
    def condition(self) -> tuple[UnitCondition, bool]:
        """Its condition, and whether it is at rest but for the hand that holds it."""
        if self.is_lost:
            return "lost", False
        if not self.newest:
            return "waiting", False
        if self.is_silent:
            return "silent", False
        stamps = np.concatenate([chunk.time for chunk in self.newest])
        force = np.concatenate([chunk.accelerometer for chunk in self.newest])
        rate = np.concatenate([chunk.gyroscope for chunk in self.newest])
        if self._lies(stamps, force, rate):
            return "rest", False
        trembles = self.by_hand and _is_held(stamps, force, rate)
        return "rest" if trembles else "motion", trembles

    def _lies(self, stamps: FloatArray, force: FloatArray, rate: FloatArray) -> bool:
        segmenter = _core.Segmenter(SHORTEST_REST, self.by_hand)
        segmenter.push(stamps, force, rate)
        rests = segmenter.finish().rest_times
        return len(rests) > 0 and bool(stamps[-1] - rests[-1, 1] < SHORTEST_REST)


def _is_held(stamps: FloatArray, force: FloatArray, rate: FloatArray) -> bool:
    rests = _core.held_rests(stamps, force, rate, SHORTEST_REST)
    return len(rests) > 0 and bool(stamps[-1] - stamps[rests[-1][1]] < SHORTEST_REST)


@contextmanager
def halted_by_errors(halt: Callable[[], None]) -> Iterator[None]:
    """Calls `halt` where the block is left by an error or a signal, or is left half way, before all else."""
    try:
        yield
    except BaseException:
        halt()
        raise


class Recorder:
    """Records a `LiveSet` into a folder: a context manager; exhaust `steps`.

    `typed` is what was typed for each unit, `serials` the known serial numbers. `on_samples` receives
    what is recorded of each unit as soon as it came; `report_every` s there is a step at the latest. Units
    that are held `by_hand` need not be as still as those that lie, and may tremble. `on_failure` is called at
    an error before any source is closed. All else is as for `SessionWriter`, whose errors it raises.
    """

    def __init__(
        self,
        units: LiveSet,
        folder: Path,
        *,
        typed: Mapping[str, str],
        serials: Mapping[str, str] | None = None,
        resume: bool = False,
        on_samples: Callable[[str, LiveChunk], None] = lambda name, chunk: None,
        report_every: float = REPORT_EVERY,
        by_hand: bool = False,
        on_failure: Callable[[], None] = lambda: None,
    ) -> None:
        self._set = units
        self._on_failure = on_failure
        self._on_samples = on_samples
        self._report_every = report_every
        self._events: list[SourceEvent] = []
        units.on_event = self._events.append
        described = {
            name: RecordedUnit(source, typed[name], (serials or {}).get(name, ""))
            for name, source in units.sources.items()
        }
        clock: Literal["log", "host"] = "log" if units.is_replay else "host"
        self._writer = SessionWriter(folder, described, clock, resume=resume, clock_rate=units.clock_rate)
        self._units = {name: UnitWatch(by_hand=by_hand) for name in typed}
        self._began = math.nan
        self._oldest, self._newest = math.inf, -math.inf
        self._stopped = False

    def __enter__(self) -> Recorder:
        self._writer.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.__exit__(kind, error, trace)

    @property
    def session(self) -> Session:
        """Contents of `session.yaml`."""
        return self._writer.session

    def describe(self, procedure: SessionProcedure) -> None:
        """Stores the purpose of the recording in `session.yaml`."""
        self._writer.describe(procedure)

    def stop(self) -> None:
        """Requests `steps` to end soon; may be called by a handler of signals."""
        self._stopped = True

    def steps(self, duration: float | None = None, count: int | None = None) -> Iterator[RecordStep]:
        """Records until the set ends, for `duration` s, until each unit has `count` samples, or until `stop`.

        Raises `LogError` where a source cannot be opened, `OutputError` where the disk is full.
        """
        reason: EndReason | None = None
        with self._set as units, halted_by_errors(self._on_failure):
            self._began = report_at = clock.now()
            yield self._step(LISTENING)
            for name, chunk in units:
                yield from self._what_happened()
                self._take(name, chunk, count)
                self._writer.flush()
                if (now := clock.now()) >= report_at + self._report_every:
                    yield from self._silences()
                    yield self._step("progress")
                    report_at = now
                reason = self._end(duration, count)
                if reason is not None:
                    break
            reason = reason or "end of sources"
            self._writer.finish(reason, units.remarks)
        yield self._step("done", reason=reason)

    def _take(self, name: str, chunk: LiveChunk, count: int | None) -> None:
        if count is not None:
            chunk = chunk.part(slice(max(0, count - self._writer.samples(name))))
        if not len(chunk):
            return
        chunk = self._writer.take(name, chunk)
        self._units[name].hear(chunk, self._set.listened)
        self._oldest = min(self._oldest, float(chunk.time[0]))
        self._newest = max(self._newest, float(chunk.time[-1]))
        self._on_samples(name, chunk)

    def _end(self, duration: float | None, count: int | None) -> EndReason | None:
        if self._stopped:
            return "stopped"
        if duration is not None and self._elapsed >= duration:
            return "duration"
        if count is not None and all(self._writer.samples(name) >= count for name in self._units):
            return "count"
        return None

    @property
    def _elapsed(self) -> float:
        if self._set.is_replay:
            return max(0.0, self._newest - self._oldest)
        return clock.now() - self._began

    def _what_happened(self) -> Iterator[RecordStep]:
        while self._events:
            event = self._events.pop(0)
            self._units[event.name].is_lost = event.kind == "lost"
            yield self._step(event.kind, event.name, event.reason, is_final=event.is_final)

    def _silences(self) -> Iterator[RecordStep]:
        """Reports each silence once."""
        for name, unit in self._units.items():
            patience = SILENT_AFTER if unit.newest else FIRST_SAMPLE_WITHIN
            if self._set.listened - unit.heard > patience and not (unit.is_silent or unit.is_lost):
                unit.is_silent = True
                yield self._step("silent", name)

    def _step(
        self, kind: RecordStepKind, unit: str = "", reason: str = "", *, is_final: bool = False
    ) -> RecordStep:
        progress = tuple(self._progress(name) for name in self._units)
        return RecordStep(kind, self._elapsed, progress, self._writer.bytes, unit, reason, is_final)

    def _progress(self, name: str) -> UnitProgress:
        timing = self._set.timing[name]
        (loss,) = (each for each in self._set.losses if each.name == name)
        condition, trembles = self._units[name].condition
        return UnitProgress(
            name,
            self._writer.samples(name),
            1.0 / timing.interval,
            timing.gaps,
            loss.missing,
            condition,
            trembles,
        )
