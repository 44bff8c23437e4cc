"""The monitor beside running sensors: samples go in as they come, and what they lead to comes out at once."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import TypeAlias

from tumble.foundation import clock
from tumble.foundation.errors import ProcedureError
from tumble.foundation.log_reading import AS_LOGGED
from tumble.foundation.log_time import LogTime
from tumble.live import FIRST_SAMPLE_WITHIN, LiveChunk, LiveSet, SourceEvent, nothing_came
from tumble.live.host_clock import DelayCounts
from tumble.live.outputs import SetChunk
from tumble.logs.writer import Writer
from tumble.procedures.redundancy.aiding_live import LiveAiding
from tumble.procedures.redundancy.aiding_log import AidingLog
from tumble.procedures.redundancy.monitor import ALL_WITHIN, RedundancyMonitor
from tumble.procedures.redundancy.procedure import result_of
from tumble.procedures.redundancy.result import RedundancyEvent, RedundancyResult
from tumble.tools.record.writer import EndReason, SessionWriter

REPORT_EVERY = 0.5
"""s between two looks at how the set is."""


@dataclass(frozen=True, slots=True)
class UnitRate:
    """Rate of the samples of one unit."""

    name: str
    samples: int
    rate: float
    """Hz, gaps left out; NaN before it is known."""


@dataclass(frozen=True, slots=True)
class SetState:
    """Present state of the set."""

    elapsed: float
    """s since it began."""
    time: float
    """s of the common clock: of the newest sample; NaN before the first."""
    source: str
    """Name of the unit that the output comes from; empty where there is none."""
    units: tuple[UnitRate, ...]
    """Primary first."""


RedundancyStep: TypeAlias = RedundancyEvent | SetState


class LiveRedundancy:
    """Runs a monitor beside a `LiveSet` of the same units: exhaust `steps`, then ask for the `result`.

    The set goes on without a unit whose source is lost, if it was made with `keep_going`. Compensated output
    goes to `output` before anything else is done with a sample. `session` records all samples, in the order
    in which the monitor took them in, so that a replay of the session gives the same; `aiding_log` beside it
    records `measurements`. Adopted errors are in the store of the monitor at once.
    """

    def __init__(
        self,
        units: LiveSet,
        monitor: RedundancyMonitor,
        *,
        output: Writer | None = None,
        session: SessionWriter | None = None,
        measurements: Sequence[LiveAiding] = (),
        aiding_log: AidingLog | None = None,
    ) -> None:
        self._set = units
        self._monitor = monitor
        self._output = output
        self._session = session
        self._measurements = measurements
        self._aiding_log = aiding_log
        self._happened: list[SourceEvent] = []
        units.on_event = self._happened.append
        self._events: list[RedundancyEvent] = []
        self._samples = dict.fromkeys(monitor.units, 0)
        self._unheard = set(monitor.units)
        """Units that never sent anything, and were not reported."""
        self._began = self._ended = math.nan
        self._waited_since: float | None = None
        """s at which the first sample came."""
        self._waiting_for = set(monitor.units)
        self._is_watching = units.is_replay
        """Indicates whether samples count: those before all units sent some are left out."""
        self._heard = -math.inf
        """s of `clock.now()`: turn of the last sample."""
        self._latest_turn = -math.inf
        """s after which the next sample has its turn."""
        self._stopped = False
        self._of_lines: list[str] = []
        """Events of sources, which no recording holds."""
        self.delays = DelayCounts()
        """s from the arrival of samples to when what they gave was on its way."""

    def stop(self) -> None:
        """Requests `steps` to end soon; may be called by a handler of signals."""
        self._stopped = True

    def steps(self, duration: float | None = None) -> Iterator[RedundancyStep]:
        """Watches until the sources end, for `duration` s, or until `stop`; returns events at once.

        Besides the events of the monitor there are those of sources, `lost` and `returned`, and `silent` of a
        unit that never sent anything; every `REPORT_EVERY` there is a `SetState`.

        Raises `LogError` where a source cannot be opened, `OutputError` where output, store or session cannot
        be written, `ProcedureError` where no unit sent anything to the end.
        """
        reason: EndReason = "end of sources"
        with self._set as units, ExitStack() as listening:
            for aiding in self._measurements:
                listening.enter_context(aiding)
            self._monitor.save()
            self._began = report_at = clock.now()
            yield self._state()
            for name, chunk in units:
                yield from self._of_sources()
                yield from self._of_aiding_measurements()
                yield from self._take(name, chunk) if len(chunk) and self._counts(name) else self._wait()
                if self._session is not None:
                    self._session.flush()
                if (now := clock.now()) >= report_at + REPORT_EVERY:
                    report_at = now
                    yield from self._never_heard(now)
                    yield self._state()
                if self._stopped:
                    reason = "stopped"
                elif duration is not None and self._elapsed >= duration:
                    reason = "duration"
                if reason != "end of sources":
                    break
            yield from self._wait()
            self._ended = clock.now()
            if self._session is not None:
                self._session.finish(reason, units.remarks, closed=self._ended)
        yield self._state()
        if not any(self._samples.values()):
            raise ProcedureError(
                f"{', '.join(self._samples)}: none of these units sent a sample; are they on, and do they "
                "send to these addresses?"
            )

    def result(self, preset: str = "") -> RedundancyResult:
        """Returns what was done and found, once `steps` has come to its end; without traces and output.

        `preset` is what the settings began from, where these were not the usual ones.
        """
        silence = self._ended - self._heard if self._monitor.is_silent else 0.0
        found = result_of(
            self._monitor,
            self._events,
            end=self._monitor.newest + silence,
            warnings=(*self._remarks(), *self._of_lines, *self._monitor.notices()),
            preset=preset,
        )
        # A session holds samples in the axes of the case: so reads whoever replays it.
        return replace(found, readings={unit: {"axes": AS_LOGGED} for unit in self._monitor.units})

    def _counts(self, name: str) -> bool:
        """Returns whether samples of a unit count yet: the primary's are the first to."""
        if self._is_watching:
            return True
        now = clock.now()
        since = self._waited_since = now if self._waited_since is None else self._waited_since
        primary = self._monitor.units[0]
        hears_primary = primary not in self._waiting_for
        self._waiting_for.discard(name)
        together = not self._waiting_for or now - since >= ALL_WITHIN
        self._is_watching = together and (name == primary or not hears_primary)
        return self._is_watching

    def _take(self, name: str, chunk: LiveChunk) -> Iterator[RedundancyEvent]:
        came = clock.now() if chunk.arrival is None else chunk.arrival
        # No two turns are alike, so that a recording has them in this order.
        turn = max(came, math.nextafter(self._latest_turn, math.inf))
        yield from self._note(self._tick(turn))
        self._heard = self._latest_turn = turn
        happened = self._monitor.push(name, chunk)
        if self._aiding_log is not None and self._monitor.heard:
            self._aiding_log.write(self._monitor.heard, turn)
        output = self._monitor.output
        if self._output is not None and len(output):
            unit = int(output.source[0])
            said = (output.time, output.specific_force, output.angular_rate)
            self._output.write(SetChunk(*said, unit=unit, source=output.units[unit], flags=output.flags))
        if chunk.arrival is not None and len(output):
            self.delays.add([clock.now() - chunk.arrival])
        self._samples[name] += len(chunk)
        if self._session is not None:
            self._session.take(name, replace(chunk, arrival=turn))
        if any(event.event == "adopted" for event in happened):
            self._monitor.save()
        yield from self._note(happened)

    def _wait(self) -> Iterator[RedundancyEvent]:
        """Reports the passing of time to the monitor though no samples come."""
        now = clock.now()
        happened = self._tick(now)
        if happened:
            # Later samples come after this time.
            self._latest_turn = now
        yield from self._note(happened)

    def _tick(self, now: float) -> tuple[RedundancyEvent, ...]:
        return (
            self._monitor.tick(self._monitor.newest + (now - self._heard))
            if any(self._samples.values())
            else ()
        )

    def _note(self, events: Sequence[RedundancyEvent]) -> Iterator[RedundancyEvent]:
        self._events += events
        yield from events

    def _of_sources(self) -> Iterator[RedundancyEvent]:
        """Reports sources that were lost, and those that returned."""
        while self._happened:
            event = self._happened.pop(0)
            figures = {"reason": event.reason} if event.reason else {}
            yield self._told(RedundancyEvent(event.time, event.name, event.kind, figures))

    def _of_aiding_measurements(self) -> Iterator[RedundancyEvent]:
        """Passes on aiding measurements, and reports aiding sources that were lost."""
        for aiding in self._measurements:
            for heard in aiding.take():
                if isinstance(heard, RedundancyEvent):
                    yield self._told(heard)
                elif self._is_watching:
                    self._monitor.aiding(heard)

    def _never_heard(self, now: float) -> Iterator[RedundancyEvent]:
        """Reports, once, units that never sent anything."""
        if now - self._began <= FIRST_SAMPLE_WITHIN:
            return
        for name in [name for name in self._monitor.units if name in self._unheard]:
            self._unheard.discard(name)
            if not self._samples[name]:
                reason = str(nothing_came(name)).removeprefix(f"{name}: ")
                yield self._told(RedundancyEvent(now, name, "silent", {"reason": reason}))

    def _told(self, event: RedundancyEvent) -> RedundancyEvent:
        """Keeps for the summary the facts that a recording does not show."""
        reason = event.figures.get("reason")
        when = LogTime(self._monitor.start).at(event.time, 2)
        self._of_lines.append(f"{event.unit}: {event.event} at {when}{f': {reason}' if reason else ''}")
        return event

    def _remarks(self) -> Iterator[str]:
        for name, remarks in self._set.remarks.items():
            yield from (f"{name}: {remark}" for remark in remarks)
        for aiding in self._measurements:
            yield from (f"{aiding.name}: {remark}" for remark in aiding.remarks)

    @property
    def _elapsed(self) -> float:
        if self._set.is_replay and any(self._samples.values()):
            return self._monitor.newest - self._monitor.start
        return clock.now() - self._began

    def _state(self) -> SetState:
        rates = tuple(
            UnitRate(name, samples, 1.0 / self._set.timing[name].interval)
            for name, samples in self._samples.items()
        )
        newest = self._monitor.newest
        return SetState(
            self._elapsed, newest if math.isfinite(newest) else math.nan, self._monitor.source, rates
        )
