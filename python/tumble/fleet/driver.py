"""Runs a job: gives inputs to an engine in tasks, retries what was lost, isolates what kills its worker."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from itertools import islice

from tumble import _core
from tumble.cli.exit_code import ExitCode
from tumble.fleet import ledger
from tumble.fleet.engine import Finished, FleetEngine, WorkerLostError
from tumble.fleet.inputs import FleetInput, InputList
from tumble.fleet.job import FleetJob
from tumble.fleet.lease import DriverLease, driver_lease
from tumble.fleet.ledger import JobStatus
from tumble.fleet.parts import exit_codes, write_parts
from tumble.fleet.places import FileStore
from tumble.fleet.task import TRIES, FleetTask, TaskDone, lost_outcome
from tumble.foundation import clock
from tumble.foundation.errors import TumbleError

FIRST_TASK = 4
"""Inputs of a task before it is known how long one takes."""
LARGEST_TASK = 512
_TASKS_LEFT = 2
"""Least number of tasks for each worker among which what is left is shared."""
_LOOK = 0.5
"""s between two looks at whether the job is to end."""
_STATUS_EVERY = 2.0
"""s between two times that the status is written."""

ShowProgress = Callable[[JobStatus], None]


@dataclass
class FleetRun:
    """A run of a job: exhaust it with `run`.

    Raises `TumbleError` where results of another job stand there, inputs are wrong, or results cannot be
    written.
    """

    job: FleetJob
    start_engine: Callable[[], FleetEngine]
    """Called once the job is known to be in order, for a cluster may take long to begin."""
    engine_name: str
    resume: bool = False
    show: ShowProgress = lambda _: None
    _again: deque[FleetTask] = field(default_factory=deque)
    """Tasks that were lost with their worker."""
    _tries: dict[str, int] = field(default_factory=dict)
    """Workers that each input took along, by its place."""
    _engine: FleetEngine = field(init=False)
    _lease: DriverLease = field(init=False)
    _under_way: int = 0
    _given: int = 0
    """Inputs that were put into tasks."""
    _inputs: int = 0
    _earlier: int = 0
    _done: int = 0
    _failed: int = 0
    _not_well: int = 0
    _retried: int = 0
    _seconds_an_input: float = 0.0

    def run(self) -> JobStatus:
        """Computes all inputs that have no result yet; returns how it ended."""
        self._results = FileStore(self.job.results)
        if self._results.is_local:  # a function of others may change the working folder of its worker
            self.job = self.job.model_copy(update={"results": self._results.root})
        # Nothing is written until all is in order: a refused job leaves results of before as they are.
        with driver_lease(self._results) as self._lease:
            date = ledger.refuse_other_job(self._results, self.job, resume=self.resume)
            with closing(InputList(self.job)) as inputs, closing(self.start_engine()) as self._engine:
                self._date = date or ledger.begin(self._results, self.job)
                ledger.forget_cancelling(self._results)
                return self._run(inputs)

    def _run(self, inputs: InputList) -> JobStatus:
        self._begun = self._written = clock.now()
        self._inputs = len(inputs)
        self._open = self._without_result(inputs)
        state, reason = "failed", ""
        try:
            state = self._worked()
        except TumbleError as error:
            reason = str(error)
            raise
        except KeyboardInterrupt:
            state = "cancelled"
            raise
        finally:
            status = self._status(state, reason)
            ledger.write_status(self._results, status)
        self.show(status)
        return status

    def _without_result(self, inputs: InputList) -> Iterator[FleetInput]:
        """Counts the results of earlier runs, and returns the inputs that have none."""
        known = exit_codes(self._results) if self.resume else {}
        if not known:
            return iter(inputs)
        work = self.job.work
        codes = Counter(known.get(each.key(work)) for each in inputs)
        self._earlier = len(inputs) - codes[None]
        self._failed = codes[ExitCode.USER_ERROR]
        self._not_well = self._earlier - self._failed - codes[ExitCode.DONE]
        return (each for each in inputs if each.key(work) not in known)

    def _worked(self) -> str:
        cancelled = False
        while True:
            if not cancelled:
                self._give_work()
            if not self._under_way:
                return "cancelled" if cancelled else "done"
            for finished in self._engine.finished(_LOOK):
                self._under_way -= 1
                self._take(finished)
            cancelled = cancelled or self._looked()

    def _looked(self) -> bool:
        """Shows progress now and then; returns whether the job is to end."""
        status = self._status("running")
        self.show(status)
        if clock.now() - self._written < _STATUS_EVERY:
            return False
        self._lease.check()
        ledger.write_status(self._results, status)
        self._written = clock.now()
        return ledger.is_cancelled(self._results)

    def _give_work(self) -> None:
        while self._under_way < self._engine.slots and (task := self._next_task()) is not None:
            self._engine.submit(task)
            self._under_way += 1

    def _next_task(self) -> FleetTask | None:
        if self._again:
            return self._again.popleft()
        inputs = tuple(islice(self._open, self._task_size()))
        self._given += len(inputs)
        return FleetTask(self.job, inputs, self._date, _core.__version__) if inputs else None

    def _task_size(self) -> int:
        """Returns the number of inputs that take as long as a task should.

        Towards the end they are fewer, so that no worker is left with a task while others have none.
        """
        if self._seconds_an_input <= 0.0:
            return FIRST_TASK
        usual = round(self.job.task_seconds / self._seconds_an_input)
        left = self._inputs - self._earlier - self._given
        share = max(FIRST_TASK, left // (_TASKS_LEFT * self._engine.slots))
        return max(1, min(LARGEST_TASK, usual, share))

    def _take(self, finished: Finished) -> None:
        outcome = finished.outcome
        if isinstance(outcome, TaskDone):
            self._done += outcome.done
            self._failed += outcome.failed
            self._not_well += outcome.not_well
            self._seconds_an_input = outcome.seconds / max(1, outcome.done)
        elif isinstance(outcome, WorkerLostError):
            self._retried += 1
            self._again.extend(self._after_a_loss(finished.task, str(outcome)))
        else:
            raise outcome

    def _after_a_loss(self, task: FleetTask, how: str) -> Iterator[FleetTask]:
        """Yields what to try again: halves, so that an input that kills its worker is soon alone."""
        if len(task.inputs) > 1:
            yield from task.halves()
            return
        [given] = task.inputs
        self._tries[given.place] = self._tries.get(given.place, 0) + 1
        if self._tries[given.place] < TRIES:
            yield task
        else:
            self._tell_poisoned(given, how)

    def _tell_poisoned(self, given: FleetInput, how: str) -> None:
        failure = f"its worker was lost {TRIES} times: {how}"
        write_parts(self._results, [lost_outcome(self.job, given, failure)])
        self._done += 1
        self._failed += 1

    def _status(self, state: str, reason: str = "") -> JobStatus:
        seconds = clock.now() - self._begun
        return JobStatus(
            state=state,
            inputs=self._inputs,
            done=self._earlier + self._done,
            failed=self._failed,
            not_well=self._not_well,
            retried=self._retried,
            rate=self._done / seconds if seconds > 0.0 else 0.0,
            seconds=seconds,
            engine=self.engine_name,
            reason=reason,
            written=clock.utc(),
        )
