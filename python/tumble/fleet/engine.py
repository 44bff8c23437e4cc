"""Interface of what computes tasks: this machine, or a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from tumble.fleet.task import FleetTask, TaskDone
from tumble.foundation.errors import CommandError, TumbleError

LOCAL, RAY = "local", "ray"


class WorkerLostError(TumbleError):
    """A worker ended before its task did: it was killed, or its node was."""


@dataclass(frozen=True, slots=True)
class Finished:
    """A task that ended."""

    number: int
    task: FleetTask
    outcome: TaskDone | TumbleError
    """Its figures, or the reason why it has none."""


class FleetEngine(Protocol):
    """Computes tasks, several at a time, in any order."""

    slots: int
    """Tasks that are worth being under way at a time."""

    def submit(self, task: FleetTask) -> int:
        """Begins a task; returns its number."""

    def finished(self, seconds: float) -> Iterator[Finished]:
        """Yields what ended; waits at most so many s for the first."""

    def close(self) -> None:
        """Ends all work; what is under way is lost."""


def engine_of(text: str, jobs: int) -> FleetEngine:
    """Starts an engine: `local`, or `ray` or `ray:ADDRESS`.

    Raises `CommandError` where it is unknown, `TumbleError` where a cluster cannot be reached.
    """
    kind, _, address = text.partition(":")
    if kind == LOCAL and not address:
        from tumble.fleet.local_engine import LocalEngine

        return LocalEngine(jobs)
    if kind == RAY:
        from tumble.fleet.ray_engine import RayEngine

        return RayEngine(address, jobs)
    raise CommandError(f"--engine {text}: is unknown; give local, ray or ray:ADDRESS")
