"""Several sources read at once, in one thread, with the samples of all of them on one clock.

>>> from tumble.live import open_set
>>> with open_set(["a=udp://:9000", "b=udp://:9001"]) as units:  # doctest: +SKIP
...     for name, chunk in units:
...         print(name, len(chunk), "samples")
"""

from __future__ import annotations

import math
import selectors
from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from types import TracebackType
from typing import Literal, TypeAlias

import numpy as np

from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.foundation.recording import FloatArray
from tumble.foundation.timing import TimeWatch
from tumble.foundation.words import count_of
from tumble.live.conditioning import EMPTY
from tumble.live.host_clock import HostClock
from tumble.live.iterated import IteratedSource
from tumble.live.losses import SampleLoss
from tumble.live.naming import parse_named_sources
from tumble.live.registry import open_source
from tumble.live.shared_line import SharedLines
from tumble.live.source import (
    BETWEEN_LOOKS,
    HEARTBEAT,
    LOG_CLOCK,
    LiveChunk,
    Source,
    UnreadableSourceError,
    readable,
)
from tumble.logs.options import ReadOptions, options_for

RETRY = 1.0
"""s between two attempts to open a source that was lost."""

SILENCE = 0.5
"""s without samples at the end of a set from which they are missing; devices that bundle samples send more
often."""

LEFT_WITHIN = 0.1
"""s for which the end of a set waits for sources that are being opened."""

ABREAST = 0.01
"""s by which one of several logs without pace may be given ahead of the others."""

Opening: TypeAlias = Callable[[], Source]
"""Makes a source, anew after it was lost."""


@dataclass(frozen=True, slots=True)
class SourceEvent:
    """Loss or return of the source of one unit."""

    kind: Literal["lost", "returned"]
    name: str
    """Name of the unit."""
    time: float
    """s of `clock.now()`."""
    reason: str = ""
    """Reason of the loss."""
    is_final: bool = False
    """Indicates a loss after which the source is not opened again: that would not mend it."""


class _Unit:
    """One unit of a set: its source, its clock, and the time of its last sample."""

    def __init__(self, name: str, opening: Opening) -> None:
        self.name = name
        self.opening = opening
        self.source = opening()
        self.clock: HostClock | None = None
        """Clock; None until samples show whether it is needed."""
        self.timing = TimeWatch()
        self.is_open = False
        self.line: int | None = None
        """Descriptor to wait for while the source is open; None where there is none."""
        self.heard = math.inf
        """s of `clock.now()` at which the reader of the set was last given anything of it."""
        self.kept = EMPTY
        """Samples of a log without pace, until older ones of others were given."""
        self.newest = -math.inf
        """s, of the samples that were given."""
        self.late = 0
        """Samples left out because they were no newer than that."""
        self.given_at = math.nan
        """s of `LiveSet.listened` at which its last samples were given."""
        self.is_back = False
        """Indicates whether it was opened anew, and has given nothing since."""
        self.silence = 0.0
        """s, of its clock, for which it gave nothing while it was opened anew."""
        self.unheard = 0
        """Samples that are missing in that time."""
        self.has_ended = False
        self.refusal = ""
        """Reason why it ended, where its source was refused."""
        self.retry_at = math.inf
        """s of `clock.now()` at which to open it again, if it was lost."""
        self.returning: Future[Source] | None = None
        """Its new source, while that is being opened."""

    @property
    def remarks(self) -> tuple[str, ...]:
        timing = self.timing
        gaps = f"{count_of('gap', timing.gaps)} in time, {timing.longest_gap:.3g} s at most"
        late = f"left out {count_of('sample', self.late)} older than those before"
        return (
            *self.source.remarks,
            *((self.clock.remark,) if self.clock is not None and self.clock.remark else ()),
            *((gaps,) if timing.gaps else ()),
            *((late,) if self.late else ()),
            *((f"was read no further: {self.refusal}",) if self.refusal else ()),
        )

    def host_times(self, chunk: LiveChunk, clock_rate: float) -> FloatArray:
        if self.clock is None:
            self.clock = HostClock(stamped=getattr(self.source, "stamped", True))
        arrival = self.heard if chunk.arrival is None else chunk.arrival
        if clock_rate == 1.0:
            return self.clock.host_times(chunk.time, arrival)
        return clock_rate * self.clock.host_times(chunk.time / clock_rate, arrival)

    def samples_in(self, seconds: float) -> int:
        """Returns how many samples are missing where none came for so many s of its clock."""
        interval = self.timing.interval
        return max(0, round(seconds / interval) - 1) if interval > 0.0 else 0

    def enter(self) -> None:
        try:
            self.source.__enter__()
        except LogError as error:
            raise self.named(error) from error

    def named(self, error: LogError) -> LogError:
        """Returns the error with the name of its unit."""
        return LogError(f"{self.name}: {error}")

    def open_anew(self) -> None:
        """Begins to open a new source, which `returning` then holds."""
        self.returning = Future()
        clock.thread(self._open, self.returning, name="opener").start()

    def _open(self, opened: Future[Source]) -> None:
        try:
            source = self.opening()
            # It may begin behind all that it once stated of itself.
            if source is not self.source and (follow := getattr(source, "follow", None)) is not None:
                follow(self.source)
            source.__enter__()
        except BaseException as error:
            opened.set_exception(error)
        else:
            opened.set_result(source)


class LiveSet:
    """Named sources read together: a context manager, iterated once.

    Iterating gives the name of a unit and samples of it, in order of arrival. Their `time` is s of
    `clock.now()`, by a `HostClock` for each, and `sensor_time` the stamp of the source; where all
    sources state the same clock, as replayed logs do, times stay as they are. Logs replayed as fast as they
    can be read are given in the order of their times. A unit that is silent is given with an empty chunk
    every `HEARTBEAT`. The set ends when the last of its sources does. `async for` iterates it beside other
    tasks.

    Raises `LogError`, which names the unit, where a source is lost. With `keep_going`, `on_event` receives
    instead, the others go on, and the source is opened anew every second until it is there again; that needs
    an `Opening` where a source is not to be entered twice. One that returns is read as it was before; where
    it states other columns or units, it has ended.

    `clock_rate` is that of simulated sources whose clocks go so many s in a second; times are then of those.
    """

    def __init__(
        self,
        sources: Mapping[str, Source | Opening],
        *,
        keep_going: bool = False,
        on_event: Callable[[SourceEvent], None] = lambda event: None,
        clock_rate: float = 1.0,
    ) -> None:
        self.clock_rate = clock_rate
        self._units = {name: _Unit(name, partial(_waitable, source)) for name, source in sources.items()}
        self._keep_going = keep_going
        self.on_event = on_event
        """Callback, with `keep_going`, for the loss and the return of a source."""
        clocks = {getattr(unit.source, "clock", "") for unit in self._units.values()}
        # A clock that may begin again is none for others.
        self._one_clock = self.is_replay or (len(clocks) == 1 and "" not in clocks and not keep_going)
        self._selector = selectors.DefaultSelector()
        self._polled: list[_Unit] = []
        """Open units with nothing to wait for."""
        self._may_be_more = False
        """Indicates whether a unit without a descriptor has just given samples."""
        self.listened = 0.0
        """s for which sources were waited for: while the computer did something else, nobody was silent."""
        self._looked = math.inf
        """s of `clock.now()` at which they were last looked at."""
        self._look_at = -math.inf
        """s of `clock.now()` before which they are not looked at again: one look takes as long as many
        samples, and those of all units come together."""
        self._heartbeat_at = -math.inf
        """s of `clock.now()` before which no unit is silent for `HEARTBEAT`."""

    @property
    def is_replay(self) -> bool:
        """Returns whether all of them replay logs, whose times are their own."""
        return all(getattr(unit.source, "clock", "") == LOG_CLOCK for unit in self._units.values())

    @property
    def sources(self) -> Mapping[str, Source]:
        """The source of each unit."""
        return {name: unit.source for name, unit in self._units.items()}

    @property
    def timing(self) -> Mapping[str, TimeWatch]:
        """Interval, jitter and gaps of each unit, by its own clock."""
        return {name: unit.timing for name, unit in self._units.items()}

    @property
    def losses(self) -> tuple[SampleLoss, ...]:
        """Samples of each unit that are missing: in gaps, while its source was opened anew, and until now.

        Those that were left out, as they came too late, are missing too.
        """
        return tuple(
            SampleLoss(
                name,
                unit.timing.samples - unit.late,
                unit.timing.missing + unit.unheard + unit.late + unit.samples_in(self._silent_for(unit)),
                getattr(unit.source, "unread", 0),
                unit.refusal,
            )
            for name, unit in self._units.items()
        )

    def _silent_for(self, unit: _Unit) -> float:
        """Returns s, of its clock, for which a unit that has not ended gave nothing until now."""
        if unit.has_ended or getattr(unit.source, "clock", "") == LOG_CLOCK:
            return 0.0
        silent = self.clock_rate * (self.listened - unit.given_at)
        return silent if silent > max(SILENCE, 2.0 * unit.timing.interval) else 0.0

    @property
    def remarks(self) -> Mapping[str, tuple[str, ...]]:
        """Remarks on each unit for the user: those of its source, errors of its clock, gaps and silence."""
        return {name: (*unit.remarks, *self._on_silence(unit)) for name, unit in self._units.items()}

    def _on_silence(self, unit: _Unit) -> Iterator[str]:
        if silence := unit.silence + self._silent_for(unit):
            yield f"gave nothing for {silence:.3g} s, while it was opened again or at the end"

    def __enter__(self) -> LiveSet:
        try:
            for unit in self._units.values():
                unit.enter()
                self._watch(unit)
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        until = clock.now() + LEFT_WITHIN
        for unit in self._units.values():
            if unit.returning is not None:
                clock.wait(unit.returning, max(0.0, until - clock.now()))
                unit.returning.add_done_callback(_leave_opened)
            if unit.is_open:
                self._leave(unit)
        self._selector.close()

    def __iter__(self) -> Iterator[tuple[str, LiveChunk]]:
        while not self._has_ended:
            patience = self._patience
            ready = clock.select(self._selector, patience)
            if patience and (early := self._look_at - clock.now()) > 0.0:
                clock.sleep(early)
                ready = self._selector.select(0.0)
            yield from self._come(ready)

    async def __aiter__(self) -> AsyncIterator[tuple[str, LiveChunk]]:
        # Where the system has none for all lines together, they are looked at again and again.
        line = getattr(self._selector, "fileno", lambda: None)()
        while not self._has_ended:
            patience = self._patience
            await readable(line, patience)
            if patience and (early := self._look_at - clock.now()) > 0.0:
                await readable(None, early)
            for named in self._come(self._selector.select(0.0)):
                yield named

    @property
    def _has_ended(self) -> bool:
        return all(unit.has_ended for unit in self._units.values())

    @property
    def _patience(self) -> float:
        """Longest time, s, to wait for the next samples."""
        if self._may_be_more or any(unit.kept is not EMPTY for unit in self._units.values()):
            return 0.0
        until_heartbeat = self._heartbeat_at - clock.now()
        return max(0.0, min(until_heartbeat, BETWEEN_LOOKS) if self._polled else until_heartbeat)

    def _come(self, ready: Sequence[tuple[selectors.SelectorKey, int]]) -> Iterator[tuple[str, LiveChunk]]:
        """Returns what has come, then what is due besides."""
        self._listen()
        if self._keep_going:
            self._bring_back()
        self._may_be_more = False
        for unit in [unit for key, _ in ready for unit in key.data] + self._polled:
            chunk = self._read(unit) if unit.is_open and unit.kept is EMPTY else EMPTY
            if len(chunk) and chunk.arrival is None:
                unit.kept = chunk
            elif len(chunk):
                self._may_be_more |= unit.line is None
                yield unit.name, self._given(unit, chunk)
            elif unit.refusal and unit.has_ended:
                # Whoever reads the set looks at events once it is given something.
                yield unit.name, EMPTY
        if kept := [unit for unit in self._units.values() if unit.kept is not EMPTY]:
            oldest, *others = sorted(kept, key=lambda unit: float(unit.kept.time[0]))
            until = float(others[0].kept.time[0]) + ABREAST if others else math.inf
            count = int(np.searchsorted(oldest.kept.time, until, side="right"))
            chunk = oldest.kept.part(slice(count))
            oldest.kept = oldest.kept.part(slice(count, None)) if count < len(oldest.kept) else EMPTY
            yield oldest.name, self._given(oldest, chunk)
        yield from self._heartbeats()

    def _listen(self) -> None:
        now = clock.now()
        self.listened += min(max(0.0, now - self._looked), HEARTBEAT)
        self._looked, self._look_at = now, now + BETWEEN_LOOKS

    def _read(self, unit: _Unit) -> LiveChunk:
        try:
            return unit.source.read()
        except EOFError:
            self._leave(unit)
            unit.has_ended, unit.heard = True, math.inf
        except LogError as error:
            named = unit.named(error)
            if not self._keep_going:
                raise named from error
            self._leave(unit)
            is_final = isinstance(error, UnreadableSourceError)
            if is_final:
                unit.has_ended, unit.heard, unit.refusal = True, math.inf, str(named)
            else:
                unit.retry_at = clock.now() + RETRY
            self.on_event(SourceEvent("lost", unit.name, clock.now(), str(named), is_final))
        return EMPTY

    def _given(self, unit: _Unit, chunk: LiveChunk) -> LiveChunk:
        """Puts samples on the clock of the set; leaves out what is no newer than those before."""
        unit.heard = clock.now()
        if unit.is_back:
            # The first samples of a source come together, once their units are known.
            came_in = float(chunk.time[-1] - chunk.time[0])
            silence = max(0.0, self.clock_rate * (self.listened - unit.given_at) - came_in)
            unit.silence += silence
            unit.unheard += unit.samples_in(silence)
            unit.is_back = False
        unit.given_at = self.listened
        unit.timing.push(chunk.time)
        if not self._one_clock:
            chunk = chunk.on_clock(unit.host_times(chunk, self.clock_rate))
        if chunk.time[0] <= unit.newest:
            old = int(np.searchsorted(chunk.time, unit.newest, side="right"))
            unit.late += old
            chunk = chunk.part(slice(old, None))
        unit.newest = max(unit.newest, float(chunk.time[-1])) if len(chunk) else unit.newest
        return chunk

    def _heartbeats(self) -> Iterator[tuple[str, LiveChunk]]:
        now = clock.now()
        if now < self._heartbeat_at:
            return
        for unit in self._units.values():
            if now - unit.heard >= HEARTBEAT:
                unit.heard = now
                # Samples may wait for one that does not come any more.
                chunk = self._read(unit) if unit.is_open and unit.kept is EMPTY else EMPTY
                yield (
                    unit.name,
                    self._given(unit, chunk) if len(chunk) and chunk.arrival is not None else EMPTY,
                )
        self._heartbeat_at = min(unit.heard for unit in self._units.values()) + HEARTBEAT

    def _bring_back(self) -> None:
        """Opens anew what was lost, each in a thread of its own: a host may never answer."""
        now = clock.now()
        for unit in self._units.values():
            if unit.retry_at <= now:
                unit.retry_at = math.inf
                unit.open_anew()
            if unit.returning is not None and unit.returning.done():
                self._take_back(unit, unit.returning)

    def _take_back(self, unit: _Unit, opened: Future[Source]) -> None:
        unit.returning = None
        try:
            unit.source = opened.result()
        except LogError:
            unit.retry_at = clock.now() + RETRY
            return
        unit.timing.begin_part()
        unit.is_back = not math.isnan(unit.given_at)
        self._watch(unit)
        self.on_event(SourceEvent("returned", unit.name, clock.now()))

    def _watch(self, unit: _Unit) -> None:
        """Waits for a unit that was opened; several may be on one line."""
        unit.is_open, unit.heard, unit.line = True, clock.now(), unit.source.fileno()
        if unit.line is None:
            self._polled.append(unit)
        elif unit.line in self._selector.get_map():
            self._selector.get_key(unit.line).data.append(unit)
        else:
            self._selector.register(unit.line, selectors.EVENT_READ, [unit])

    def _leave(self, unit: _Unit) -> None:
        """Waits for a unit no longer, and lets go of its line."""
        unit.is_open = False
        if unit.line is None:
            self._polled = [other for other in self._polled if other is not unit]
        else:
            here = self._selector.get_key(unit.line).data
            here.remove(unit)
            if not here:
                self._selector.unregister(unit.line)
        unit.source.__exit__(None, None, None)


def _leave_opened(opened: Future[Source]) -> None:
    """Closes a source that was opened too late."""
    if opened.exception() is None:
        opened.result().__exit__(None, None, None)


def open_set(
    words: Sequence[str],
    options: ReadOptions | Mapping[str, ReadOptions] | None = None,
    *,
    sender: str | None = None,
    keep_going: bool = False,
    on_event: Callable[[SourceEvent], None] = lambda event: None,
) -> LiveSet:
    """Opens a set of `NAME=SOURCE` words; enter it with `with` to open the lines.

    `options` and `sender` are those of `open_source`, for all of them; options may be given by unit.

    Raises `LogError` where words do not name units, and where nothing reads such a source.
    """
    lines = SharedLines()
    addresses = parse_named_sources(words)
    openings = {
        name: partial(open_source, address.text, options_for(name, options), sender, lines)
        for name, address in addresses.items()
    }
    rates = {address.clock_rate for address in addresses.values()}
    if len(rates) > 1:
        raise LogError(f"clock-rate of {' and '.join(map(str, sorted(rates)))}: give all units the same")
    return LiveSet(openings, keep_going=keep_going, on_event=on_event, clock_rate=rates.pop())


def _waitable(given: Source | Opening) -> Source:
    """Returns a source that can be waited for; other packages bring some that can only be iterated."""
    source = given() if callable(given) else given
    return source if hasattr(source, "read") else IteratedSource(source)
