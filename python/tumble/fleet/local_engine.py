"""Work on this machine: a process each, so that one that is killed takes nothing but its own task along."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
from collections.abc import Iterator
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from tumble.fleet.engine import Finished, WorkerLostError
from tumble.fleet.task import FleetTask, TaskDone, run_task
from tumble.foundation.errors import TumbleError, shown
from tumble.foundation.workers import beginning, find_modules_as_always

_CAN_FORK = "forkserver" in multiprocessing.get_all_start_methods()
_CONTEXT = multiprocessing.get_context("forkserver") if _CAN_FORK else multiprocessing.get_context("spawn")
_PRELOADED = ["tumble.fleet.task"]
"""Modules that a server of new processes imports once, so that a worker that was lost is soon replaced."""
_GONE_AFTER = 5.0
"""s that a worker gets to end by itself."""


class LocalEngine:
    """So many worker processes of this machine, each with one task at a time."""

    def __init__(self, workers: int) -> None:
        self.slots = workers
        # Workers share the cores already: threads of BLAS in each wait for one another. Ray does the same.
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        _CONTEXT.set_forkserver_preload(_PRELOADED)
        self._idle: list[_Worker] = []
        self._busy: dict[int, tuple[_Worker, FleetTask]] = {}
        self._next = 0

    def add_worker(self) -> None:
        """Starts a worker before there is work for it."""
        self._idle.append(_Worker())

    def submit(self, task: FleetTask) -> int:
        """Gives a task to an idle worker; returns its number."""
        worker = self._idle.pop() if self._idle else _Worker()
        self._next += 1
        self._busy[self._next] = worker, task
        worker.begin(task)
        return self._next

    def finished(self, seconds: float) -> Iterator[Finished]:
        """Yields what ended; waits at most so many s for the first."""
        by_pipe = {worker.pipe: number for number, (worker, _) in self._busy.items()}
        for pipe in wait(list(by_pipe), seconds):
            assert isinstance(pipe, Connection)
            number = by_pipe[pipe]
            worker, task = self._busy.pop(number)
            yield Finished(number, task, self._outcome(worker))

    def _outcome(self, worker: _Worker) -> TaskDone | TumbleError:
        try:
            found = worker.result()
        except (EOFError, OSError):
            return WorkerLostError(worker.how_it_ended())
        self._idle.append(worker)
        return found

    def close(self) -> None:
        """Ends all workers; what they work at is lost."""
        for worker, _ in self._busy.values():
            worker.kill()
        for worker in self._idle:
            worker.end()
        self._busy.clear()
        self._idle.clear()


def _started() -> tuple[Connection, BaseProcess]:
    """Starts a process that works; returns the end of its pipe, and the process."""
    pipe, other = _CONTEXT.Pipe()
    # The worker's end closes with the worker, so that its death ends the pipe.
    with other:
        process: BaseProcess = _CONTEXT.Process(target=_work, args=(other,), daemon=True)
        # The first one also starts the server of new processes.
        with beginning():
            process.start()
    return pipe, process


class _Worker:
    """A process that computes tasks which come through a pipe."""

    def __init__(self) -> None:
        try:
            self.pipe, self._process = _started()
        except (EOFError, OSError) as error:
            raise TumbleError(
                f"no worker can be started ({shown(str(error))}); free memory or give fewer --workers, then "
                "go on with --resume"
            ) from error

    def begin(self, task: FleetTask) -> None:
        """Sends a task; that the process has died meanwhile shows in `result`."""
        with contextlib.suppress(OSError):
            self.pipe.send(task)

    def result(self) -> TaskDone | TumbleError:
        """Receives the outcome; raises `EOFError` or `OSError` where the process has died."""
        found: TaskDone | TumbleError = self.pipe.recv()
        return found

    def how_it_ended(self) -> str:
        """Returns in words how the process ended."""
        self._process.join(_GONE_AFTER)
        code = self._process.exitcode
        return (
            f"killed by signal {-code}" if code is not None and code < 0 else f"ended with exit code {code}"
        )

    def kill(self) -> None:
        """Ends the process at once."""
        self._process.kill()
        self._process.join()

    def end(self) -> None:
        """Lets the process end."""
        self.pipe.close()
        self._process.join(_GONE_AFTER)
        if self._process.is_alive():
            self.kill()


def _work(pipe: Connection) -> None:
    """Computes tasks until the other end is closed, by will or because the driver was killed."""
    find_modules_as_always()
    with contextlib.suppress(EOFError, OSError):
        while True:
            pipe.send(_outcome_of(pipe.recv()))


def _outcome_of(task: FleetTask) -> TaskDone | TumbleError:
    try:
        return run_task(task)
    except TumbleError as error:
        with contextlib.suppress(Exception):
            pickle.loads(pickle.dumps(error))
            return error
        return TumbleError(str(error))
