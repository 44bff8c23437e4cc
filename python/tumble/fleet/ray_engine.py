"""Work on a cluster of Ray."""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Iterator
from typing import Any

from tumble.fleet.engine import Finished, WorkerLostError
from tumble.fleet.ray_messages import RayMessages
from tumble.fleet.task import FleetTask, TaskDone, run_task
from tumble.foundation.errors import CommandError, TumbleError, shown
from tumble.foundation.numbers import whole_number
from tumble.foundation.words import quoted
from tumble.logs.optional import install_command

AHEAD = 2
"""Tasks a processor that are under way or wait on their node, so that none is idle between two."""
_ANSWERS_WITHIN = 5.0
"""s in which a cluster accepts a connection, and answers on it."""
_PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + b"\0\0\0\4\0\0\0\0\0"
"""Beginning of a line of HTTP/2 without settings (RFC 9113, section 3.4); services of Ray speak it."""
_FRAME, _SETTINGS = 9, 4
"""Bytes of the head of a frame; its kind, in the fourth of them, with which a server begins."""


class RayEngine:
    """A cluster of Ray: at an address, that of `RAY_ADDRESS`, or one of this machine while the job runs.

    Raises `CommandError` where Ray is not installed, `TumbleError` where the cluster cannot be reached.
    """

    def __init__(self, address: str, jobs: int) -> None:
        self._ray = _imported()
        self._is_ours = not self._ray.is_initialized()
        if self._is_ours:
            self._begin(address, jobs)
        self._messages = RayMessages()
        self._remote = self._ray.remote(max_retries=0, num_cpus=1)(run_task)
        self._busy: dict[Any, tuple[int, FleetTask]] = {}
        self._next = 0
        self.slots = self._slots()

    def _begin(self, address: str, jobs: int) -> None:
        _refuse_silent(address or os.environ.get("RAY_ADDRESS", ""))
        options: dict[str, Any] = {"address": address} if address else {}
        if not address and not _address_is_set():
            options = {"num_cpus": jobs, "include_dashboard": False}
        try:
            self._ray.init(**options, logging_level=logging.ERROR, log_to_driver=False)
        except Exception as error:
            place = shown(address) or "this machine"
            raise _unreachable(place, error) from error

    def _slots(self) -> int:
        return max(1, int(AHEAD * self._ray.cluster_resources().get("CPU", 1)))

    def submit(self, task: FleetTask) -> int:
        """Begins a task on any node."""
        self._next += 1
        self._busy[self._remote.remote(task)] = self._next, task
        return self._next

    def finished(self, seconds: float) -> Iterator[Finished]:
        """Yields what ended."""
        ended, _ = self._ray.wait(list(self._busy), num_returns=1, timeout=seconds)
        # Nodes come and go while the work goes on.
        self.slots = self._slots()
        for reference in ended:
            number, task = self._busy.pop(reference)
            yield Finished(number, task, self._outcome(reference))

    def _outcome(self, reference: Any) -> TaskDone | TumbleError:  # noqa: ANN401
        exceptions = self._ray.exceptions
        try:
            found: TaskDone = self._ray.get(reference)
        except exceptions.RayTaskError as error:
            cause = error.cause
            return cause if isinstance(cause, TumbleError) else TumbleError(shown(str(cause)))
        except exceptions.RayError as error:
            return WorkerLostError(shown(" ".join(str(error).split()))[:200])
        return found

    def close(self) -> None:
        """Cancels what is under way; ends the cluster if it began here."""
        for reference in self._busy:
            self._ray.cancel(reference, force=True)
        self._busy.clear()
        if self._is_ours:
            with self._messages.dropped_here():
                self._ray.shutdown()
        self._messages.close()


def _imported() -> Any:  # noqa: ANN401 - a module has no type of its own
    try:
        import ray
    except ModuleNotFoundError as error:
        raise CommandError(
            "--engine ray needs the Python package ray, which is not installed; type: "
            f"{install_command('fleet')}"
        ) from error
    return ray


def _refuse_silent(address: str) -> None:
    """Raises `TumbleError` where no service of Ray is at an address: Ray itself would try without end."""
    host, _, port = address.rpartition("://")[2].rpartition(":")
    number = whole_number(port)
    if not host:
        return
    if number is None:
        raise _unreachable(shown(address), ValueError(f"port {quoted(port)} is no number"))
    try:
        with (
            socket.create_connection((host.strip("[]"), number), _ANSWERS_WITHIN) as line,
            line.makefile("rb") as answer,
        ):
            line.sendall(_PREFACE)
            head = answer.read(_FRAME)
    except (OSError, OverflowError) as error:
        raise _unreachable(shown(address), error) from error
    if len(head) < _FRAME or head[3] != _SETTINGS:
        raise _unreachable(shown(address), ValueError("what answers there is no cluster"))


def _unreachable(place: str, error: Exception) -> TumbleError:
    reason = shown(" ".join(str(error).split()))
    return TumbleError(
        f"ray at {place} cannot be reached: {reason}; check the address, or leave it out to work on this "
        "machine"
    )


def _address_is_set() -> bool:
    return bool(os.environ.get("RAY_ADDRESS"))
