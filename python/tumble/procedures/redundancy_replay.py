"""Blocks of samples go through the monitor; its events and traces come together again."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np

from tumble import _core
from tumble.errors import ProcedureError
from tumble.procedures.redundancy_logs import Samples, SideBySide
from tumble.recording import FloatArray
from tumble.results_redundancy import RedundancyEvent, Selected, UnitTrace

Command: TypeAlias = Literal["evaluate", "return to primary"]
COMMANDS: tuple[Command, ...] = ("evaluate", "return to primary")
NONE_FIT = "none fit"
"""Reason of `selected` where nobody is the source any more."""

_TRACES = ("specific_force", "angular_rate", "specific_force_compensated", "angular_rate_compensated")


@dataclass(slots=True)
class Replayed:
    """What the monitor said, block after block."""

    names: tuple[str, ...]
    """Of the units, primary first."""
    events: list[RedundancyEvent] = field(default_factory=list)
    seconds: float = 0.0
    """Time the replay took."""
    parts: list[_core.RedundancyReplay] = field(default_factory=list)
    kept: list[slice] = field(default_factory=list)
    """Windows of each part: one that lies across two blocks is told of in both."""
    last_window: float = math.nan

    def add(self, part: _core.RedundancyReplay) -> None:
        """Take in what one block gave."""
        self.seconds += part["seconds"]
        self.parts.append(part)
        times = part["window_time"]
        again = len(times) > 0 and float(times[0]) == self.last_window
        self.kept.append(slice(int(again), None))
        self.last_window = float(times[-1]) if len(times) else self.last_window
        self.events += [
            RedundancyEvent(time, self.names[unit], event, figures)
            for time, unit, event, figures in part["events"]
        ]

    @property
    def window_time(self) -> FloatArray:
        """(n,) s, middle of each window."""
        return np.concatenate(
            [part["window_time"][kept] for part, kept in zip(self.parts, self.kept, strict=True)]
        )

    def traces(self) -> tuple[UnitTrace, ...]:
        """Means of each unit over all windows."""
        return tuple(
            UnitTrace(name, *(self._trace(which, unit) for which in _TRACES))
            for unit, name in enumerate(self.names)
        )

    def _trace(self, which: str, unit: int) -> FloatArray:
        return np.concatenate(
            [
                part[which][unit][kept]  # type: ignore[literal-required]
                for part, kept in zip(self.parts, self.kept, strict=True)
            ]
        )

    def selected(self, end: float) -> Iterator[Selected]:
        """Give the spans in which one unit was the source, up to the end, s; cut where time jumped."""
        since: Selected | None = None
        for event in self.events:
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


def _until(span: Selected, end: float) -> Selected:
    """End a span; what ends it may carry the time of a clock that is slightly behind."""
    return replace(span, end=max(span.start, end))


def replay(
    monitor: _core.RedundancyMonitor,
    blocks: SideBySide,
    commands: Sequence[tuple[float, Command]],
    names: tuple[str, ...],
) -> Replayed:
    """Push all blocks into the monitor, with commands at their times, s of the common clock.

    Raises `ProcedureError` where a command lies outside the logs.
    """
    replayed = Replayed(names)
    waiting = sorted(commands)
    for block in blocks:
        _refuse_early(waiting, blocks.start)
        # A command is given with the first sample that is not before it, so there has to be one.
        latest = max(float(time.max()) for time, _, _ in block if len(time))
        due = [command for command in waiting if command[0] <= latest]
        waiting = waiting[len(due) :]
        replayed.add(_push(monitor, block, due))
    if not replayed.parts:
        raise ProcedureError(f"{', '.join(names)}: none of these units says anything; check the logs")
    if waiting:
        raise ProcedureError(_outside(waiting[0], blocks))
    return replayed


def _push(
    monitor: _core.RedundancyMonitor, block: Sequence[Samples], commands: Sequence[tuple[float, Command]]
) -> _core.RedundancyReplay:
    times, specific_forces, angular_rates = zip(*block, strict=True)
    return monitor.replay(times, specific_forces, angular_rates, commands)


def _refuse_early(commands: Sequence[tuple[float, Command]], start: float) -> None:
    if commands and commands[0][0] < start:
        time, command = commands[0]
        raise ProcedureError(
            f"command {command!r} at {time:g} s: the logs begin at {start:.3f} s; give a time of their clock"
        )


def _outside(command: tuple[float, Command], blocks: SideBySide) -> str:
    return (
        f"command {command[1]!r} at {command[0]:g} s: the logs end at {blocks.end:.3f} s; give a time of "
        "their clock"
    )
