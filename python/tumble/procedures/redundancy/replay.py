"""Blocks of samples go through the monitor; its events and traces come together again."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile

import numpy as np

from tumble import _core
from tumble.foundation.errors import ProcedureError
from tumble.foundation.recording import FloatArray
from tumble.logs.aiding import NativeAiding, order
from tumble.procedures.redundancy.logs import SideBySide
from tumble.procedures.redundancy.monitor import Command, RedundancyMonitor
from tumble.procedures.redundancy.result import NONE_FIT, RedundancyEvent, Selected, SetOutput, UnitTrace

_TRACES = ("specific_force", "angular_rate", "specific_force_compensated", "angular_rate_compensated")
_OUTPUT = ("time", "unit", "specific_force", "angular_rate", "flags")
_MOST_PARTS = 256
"""Parts kept before they are joined: thousands of short ones would take more memory than what they hold."""


@dataclass(slots=True)
class Replayed:
    """Output of the monitor, block after block."""

    names: tuple[str, ...]
    """Names of the units, primary first."""
    events: list[RedundancyEvent] = field(default_factory=list)
    seconds: float = 0.0
    """Time the replay took."""
    blocks: int = 0
    _times: list[FloatArray] = field(default_factory=lambda: [np.empty(0)])
    _output: dict[str, list[FloatArray]] = field(default_factory=dict)
    """Parts of each column of the output."""
    _parts: dict[tuple[str, int], list[FloatArray]] = field(default_factory=dict)
    """Parts of each trace of each unit."""

    def add(self, events: Sequence[RedundancyEvent], block: _core.RedundancyReplay) -> None:
        """Adds the output of one block."""
        self.blocks += 1
        self.seconds += block["seconds"]
        self.events += events
        for column in _OUTPUT:
            part = block[f"output_{column}"]  # type: ignore[literal-required]
            self._output[column] = _with(self._output.get(column, []), part)
        times, before = block["window_time"], self._times[-1]
        # A window that lies across two blocks is in both.
        new = slice(int(len(times) > 0 and len(before) > 0 and times[0] == before[-1]), None)
        if not len(times[new]):
            return
        self._times = _with(self._times, times[new])
        for which in _TRACES:
            for unit, means in enumerate(block[which]):  # type: ignore[literal-required]
                self._parts[which, unit] = _with(self._parts.get((which, unit), []), means[new])

    @property
    def window_time(self) -> FloatArray:
        """(n,) s, middle of each window."""
        return np.concatenate(self._times)

    def traces(self) -> tuple[UnitTrace, ...]:
        """Means of each unit over all windows."""
        nothing = [np.empty((0, 3))]
        return tuple(
            UnitTrace(name, *(np.concatenate(self._parts.get((which, unit), nothing)) for which in _TRACES))
            for unit, name in enumerate(self.names)
        )

    def output(self) -> SetOutput:
        """Joins the output of the set."""
        time, source, force, rate, flags = (np.concatenate(self._output[column]) for column in _OUTPUT)
        return SetOutput(self.names, time, source.astype(np.int64), force, rate, flags.astype(np.int64))


def selected_spans(events: Sequence[RedundancyEvent], end: float) -> Iterator[Selected]:
    """Returns the spans in which one unit was the source, up to the end, s; cut where time jumped."""
    since: Selected | None = None
    for event in events:
        if event.event == "selected":
            reason = str(event.figures["reason"])
            unit = "" if reason == NONE_FIT else event.unit
            if since is not None:
                yield _until(since, event.time)
            since = Selected(event.time, event.time, unit, reason)
        elif event.event == "time jumped" and since is not None:
            yield _until(since, event.time - float(str(event.figures["by"])))
            since = replace(since, start=event.time)
    if since is not None:
        yield _until(since, end)


def _with(parts: list[FloatArray], part: FloatArray) -> list[FloatArray]:
    joined = [np.concatenate(parts)] if len(parts) >= _MOST_PARTS else parts
    return [*joined, part]


def _until(span: Selected, end: float) -> Selected:
    """Ends a span; what ends it may carry the time of a clock that is slightly behind."""
    return replace(span, end=max(span.start, end))


def replay(
    monitor: RedundancyMonitor,
    blocks: SideBySide,
    commands: Sequence[tuple[float, Command]],
    *,
    measurements: Sequence[NativeAiding] = (),
    keep_output: bool = False,
) -> Replayed:
    """Pushes all blocks into the monitor, with commands and aiding measurements.

    Commands are at times from the start of the logs, s, aiding measurements at times of their common clock,
    as `in_order` gives them; those before and after the logs are left out.

    Raises `ProcedureError` where a command lies outside the logs, or all measurements do.
    """
    replayed = Replayed(monitor.units)
    _refuse_early(commands)
    waiting: list[tuple[float, Command]] = []
    if blocks.arrivals is None:
        # Then turns are those of the time itself.
        measurements = sorted(((*aiding[:5], -math.inf) for aiding in measurements), key=order)
    heard = 0
    for block in blocks:
        if not replayed.blocks:
            waiting = sorted((blocks.start + time, command) for time, command in commands)
        # A command is given with the first sample that is not before it, so there has to be one.
        latest = max(float(time.max()) for time, _, _ in block if len(time))
        due = [command for command in waiting if command[0] <= latest]
        waiting = waiting[len(due) :]
        arrivals = blocks.arrivals
        said = list(takewhile(_is_due(latest, arrivals), measurements[heard:]))
        heard += len(said)
        if arrivals is not None and (silence := blocks.silence):
            replayed.events += monitor.tick(monitor.newest + silence)
        given = monitor.replay(
            block,
            due,
            said,
            arrivals=arrivals,
            temperatures=blocks.temperatures or None,
            keep_output=keep_output,
        )
        replayed.add(*given)
    replayed.events += monitor.tick(monitor.newest + blocks.last_silence)
    if not replayed.blocks:
        raise ProcedureError(f"{', '.join(monitor.units)}: none of these units has a sample; check the logs")
    if waiting:
        raise ProcedureError(_outside(waiting[0], blocks))
    if measurements and not (heard and measurements[heard - 1][0] >= blocks.start):
        raise ProcedureError(
            f"aiding: speaks from {measurements[0][0]:.3f} to {measurements[-1][0]:.3f} s, the logs from "
            f"{blocks.start:.3f} to {blocks.end:.3f} s; give times of their clock"
        )
    return replayed


def _is_due(latest: float, arrivals: Sequence[FloatArray] | None) -> Callable[[NativeAiding], bool]:
    """Returns for each aiding measurement whether it counts by the end of a block, s."""
    until = max((float(each[-1]) for each in arrivals or () if len(each)), default=math.inf)
    return lambda aiding: aiding[0] <= latest and aiding[5] <= until


def _refuse_early(commands: Sequence[tuple[float, Command]]) -> None:
    for time, command in commands:
        if time < 0.0:
            raise ProcedureError(
                f"command {command!r} at {time:g} s: lies before the logs; give seconds from their start"
            )


def _outside(command: tuple[float, Command], blocks: SideBySide) -> str:
    return (
        f"command {command[1]!r} at {command[0] - blocks.start:g} s: the logs end at "
        f"{blocks.end - blocks.start:.3f} s; give seconds from their start"
    )
